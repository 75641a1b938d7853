# SPDX-License-Identifier: BSD-3-Clause
"""One fault, given to one real command, and the judgement of what came of it."""
import json
import os
import re
import resource
import signal
import subprocess
from collections import namedtuple

RIGHT, CANNOT_TELL, REFUSED, BAD = "right", "cannot tell", "refused", "bad"
VERDICTS = (RIGHT, CANNOT_TELL, REFUSED, BAD)

TIMEOUT = 300  # s; the slowest clean run takes 4 s on an idle machine, a study of an absurd tooth 15 s
MEMORY = 6 << 30  # bytes of address space; a clean run takes less than 1 GiB
EARLIER = b"what an earlier run has written\n"
REFUSALS = (64, 65, 66)

# A fault: `what` repeats it in words; `files` are written beside each other, `faulty` is the one that is wrong.
# `command` is the program's name and arguments, `outputs` the files it writes. `judge(folder, code, err)` looks at an
# answer (exit code 0 to 3) and returns (verdict, why). `refuse`: it must not be accepted. `says`: parts of the message
# that a refusal must hold beside the file's name, as (regular) expressions.
Case = namedtuple("Case", "kind what files faulty command outputs judge refuse says")


class Result:
    def __init__(self, case, verdict, why, err=""):
        self.case, self.verdict, self.why, self.err = case, verdict, why, err


def limits():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def run(case, folder, program_of):
    """Runs the case in an empty folder."""
    for name, content in case.files.items():
        with open(os.path.join(folder, name), "wb") as out:
            out.write(content)
    for name in case.outputs:
        with open(os.path.join(folder, name), "wb") as out:
            out.write(EARLIER)
    before = set(os.listdir(folder))
    words = [program_of(case.command[0])] + [str(word) for word in case.command[1:]]
    process = subprocess.Popen(words, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, preexec_fn=limits)
    try:
        _, err = process.communicate(timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return Result(case, BAD, "did not end within %d s" % TIMEOUT)
    err = err.decode("utf-8", "replace")
    verdict, why = judged(case, folder, process.returncode, err)
    damage = damage_of(case, folder, before, process.returncode)
    if damage:
        verdict, why = BAD, damage
    return Result(case, verdict, why, err)


def judged(case, folder, code, err):
    if code < 0:
        return BAD, "ended by signal %s" % signal.Signals(-code).name
    if code in REFUSALS:
        return judged_refusal(case, code, err)
    if code not in (0, 1, 2, 3):
        return BAD, "exit code %d: %s" % (code, err.strip()[-300:])
    if case.refuse:
        return BAD, "accepted with exit code %d" % code
    return case.judge(folder, code, err)


def judged_refusal(case, code, err):
    """A message names the file and the place in it; an operator reads no more than some lines."""
    message = err.strip()
    if case.faulty not in message:
        return BAD, "exit code %d without the name of the file: %s" % (code, message[-300:])
    if re.search(r"[\x00-\x08\x0b-\x1f\x7f]", message.replace("\r", "\n")):
        return BAD, "the message holds control characters: %r" % message[-300:]
    if len(message) > 3000:
        return BAD, "a message of %d characters" % len(message)
    if not case.faulty.endswith(".bag") and code == 65 and not named_place(case.faulty, message):
        return BAD, "the message names no line: " + message[-300:]
    for part in case.says:
        if not re.search(part, message):
            return BAD, "the message lacks '%s': %s" % (part, message[-300:])
    return REFUSED, message[-300:]


def named_place(name, message):
    """A line, a channel, a key with its value, or that the file as a whole is too short, too large or of something else."""
    whole = r"(no data|larger than|is of the rig|channels|no sample|needs|need|has|samples|record|cannot be simulated)"
    if re.search(re.escape(name) + r".*: .+ = \S+: ", message):
        return True
    channel = r": (time|acceleration|(motor|load|sensor|output|reference)_\w+)"
    if re.search(re.escape(name) + channel, message):
        return True
    return re.search(re.escape(name) + r":\d+", message) or re.search(re.escape(name) + r".*" + whole, message)


def damage_of(case, folder, before, code):
    for name, content in case.files.items():
        with open(os.path.join(folder, name), "rb") as stream:
            if stream.read() != content:
                return "the input %s is another than before" % name
    left = set(os.listdir(folder)) - before
    if left:
        return "left %s behind" % ", ".join(sorted(left))
    if code in (0, 1, 2, 3):
        return ""
    for name in case.outputs:
        path = os.path.join(folder, name)
        if not os.path.exists(path):
            return "removed the earlier %s" % name
        with open(path, "rb") as stream:
            if stream.read() != EARLIER:
                return "refused, but has written %s" % name
    return ""


def read_json(folder, name):
    with open(os.path.join(folder, name)) as stream:
        return json.load(stream)
