# SPDX-License-Identifier: BSD-3-Clause
"""The history of a joint in the format of the diagnoser (a CSV that backlash_trend reads), and its trend."""
import concurrent.futures
import datetime
import hashlib
import json
import os
import re
import subprocess

from . import digests
from .errors import cannot_write, internal

HEADER = ("time,date,event,grade,backlash,lower,upper,backlash_angle,angle_lower,angle_upper,skewness,methods,rig_digest")
_NUMBERS = ("backlash", "lower", "upper", "angle", "angle_lower", "angle_upper", "skewness")
_EPOCH = datetime.datetime(1970, 1, 1)


def date(seconds):
    """UTC as in a history; empty for a time that no calendar has."""
    try:
        return (_EPOCH + datetime.timedelta(seconds=int(seconds // 1))).strftime("%Y-%m-%dT%H:%M:%SZ")
    except OverflowError:
        return ""


def file_name(joint):
    """A name for files of a joint: readable, and another one for another joint."""
    plain = re.sub(r"[^A-Za-z0-9_.-]", "_", joint).lstrip(".")
    if plain == joint and len(plain) <= 100:
        return plain
    return "%s-%s" % (plain[:100], hashlib.sha256(joint.encode("utf-8", "surrogatepass")).hexdigest()[:8])


def usable(rows):
    """Of the records of a joint those with a verdict and a time, each content once."""
    seen, found = set(), []
    for row in rows:
        if row["status"] == "done" and row["time"] is not None and row["key"] not in seen:
            seen.add(row["key"])
            found.append(row)
    return found


def text(rows):
    lines = [HEADER]
    for row in rows:
        numbers = ["" if row[name] is None else repr(row[name]) for name in _NUMBERS]
        lines.append(",".join([repr(row["time"]), date(row["time"]), "estimate", row["grade"], *numbers, row["methods"]])
                     + ',"%s"' % (row["rig_digest"] or ""))
    return "\n".join(lines) + "\n"


class Trends:
    """Trends of all joints by the command backlash_trend; one whose history is as it was is not asked for again."""

    def __init__(self, state, folder, command, horizon, version):
        self._state, self._command, self._horizon, self._version = state, command, horizon, version
        self._folder = os.path.join(folder, "history")
        try:
            os.makedirs(self._folder, exist_ok=True)
        except OSError as error:
            raise cannot_write(self._folder, error.strerror) from None

    def run(self, joints, each=lambda: None):
        with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
            asked = {}
            for joint in joints:
                question = self._question(joint)
                if question is not None:
                    asked[pool.submit(self._ask, *question[1:])] = (joint, question[0])
                if len(asked) >= 64:
                    self._store(asked, each)
            while asked:
                self._store(asked, each)

    def _question(self, joint):
        """Digest of all that the answer rests on, path of the history, words of the command; None: is known."""
        rows = usable(self._state.of_joint(joint))
        if not rows:
            return None
        content = text(rows)
        words = self._words(rows[-1]["settings"])
        digest = digests.of_words([content, words, rows[-1]["settings"], self._version])
        path = os.path.join(self._folder, file_name(joint) + ".csv")
        before = self._state.trend(joint)
        if before is not None and before["input"] == digest and os.path.exists(path):
            return None
        try:
            with open(path + ".tmp", "w", encoding="utf-8") as stream:
                stream.write(content)
            os.replace(path + ".tmp", path)
        except OSError as error:
            raise cannot_write(path, error.strerror) from None
        return digest, path, words

    def _words(self, settings):
        options = json.loads(self._state.settings(settings)["options"])
        words = ["--horizon", repr(self._horizon), "--json", "-"]
        for name in ("rig", "limits", "baseline"):
            if name in options:
                words += ["--" + name, options[name]]
        return words

    def _ask(self, path, words):
        try:
            ended = subprocess.run([self._command, path] + words, stdin=subprocess.DEVNULL, capture_output=True, timeout=600)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise internal("backlash_trend: %s" % error) from None
        if ended.returncode > 3 or ended.returncode < 0:
            reason = ended.stderr.decode("utf-8", "replace").strip() or "ended with %d" % ended.returncode
            return ended.returncode, {"message": "no trend: " + reason, "known": False, "grows": False, "exceeded": False}
        return ended.returncode, json.loads(ended.stdout)

    def _store(self, asked, each):
        done, _ = concurrent.futures.wait(asked, return_when=concurrent.futures.FIRST_COMPLETED)
        with self._state.transaction():
            for future in done:
                joint, digest = asked.pop(future)
                exit_code, result = future.result()
                self._state.put_trend(joint, digest, exit_code, json.dumps(result))
                each()
