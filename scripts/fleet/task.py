# SPDX-License-Identifier: BSD-3-Clause
"""One record on one worker: runs the offline command and reports how it ended.

This module is sent to the workers as it is, so that they need Dask and the commands but no file of this folder: only
the standard library here.
"""
import json
import os
import signal
import socket
import subprocess
import time

_REASON = 2000  # characters of an error that are kept
_VERDICT = {"backlash": "backlash", "angle": "backlash_angle"}
_INTERVAL = {("lower", "upper"): "interval", ("angle_lower", "angle_upper"): "angle_interval"}
_KINDS = {64: "refused", 65: "refused", 66: "missing"}


class _Ended(Exception):
    """How a record ended that has no answer: status and reason."""


def _last_words(err, name):
    """What a command complained of, without its own name and its progress."""
    lines = [line for line in err.decode("utf-8", "replace").replace("\r", "\n").splitlines() if line.strip()]
    marked = [line[len(name) + 2:] for line in lines if line.startswith(name + ": ")]
    return (marked or lines or ["without a word"])[-1][:_REASON]


def _run(words, time_limit):
    """Exit code and answer of a command that dies with this worker."""
    name = os.path.basename(words[0])
    try:
        process = subprocess.Popen(["setpriv", "--pdeathsig", "KILL", "--"] + words, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)
    except OSError as error:
        raise _Ended("crashed", "%s: cannot be started: %s" % (error.filename, error.strerror)) from None
    try:
        out, err = process.communicate(timeout=time_limit)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        raise _Ended("timed_out", "%s did not end within %g s" % (name, time_limit)) from None
    if process.returncode < 0:
        raise _Ended("crashed", "%s was ended by signal %d" % (name, -process.returncode))
    if process.returncode > 3:
        kind = _KINDS.get(process.returncode, "crashed")
        raise _Ended(kind, _last_words(err, name) if kind != "crashed" else
                     "%s ended with %d: %s" % (name, process.returncode, _last_words(err, name)))
    try:
        return process.returncode, json.loads(out) if out else None
    except ValueError as error:
        raise _Ended("crashed", "%s wrote no JSON: %s" % (name, error)) from None


def _ends(interval):
    return interval if interval else [None, None]


def _answer(result):
    """Of the JSON of diagnose_record what the state keeps."""
    verdict = result["verdict"]
    row = {"grade": verdict["grade"], "message": verdict["message"], "methods": "+".join(verdict["members"]),
           "rig": result["rig"], "rig_digest": result["rig_digest"]}
    for column, key in _VERDICT.items():
        row[column] = verdict[key]
    for columns, key in _INTERVAL.items():
        row.update(zip(columns, _ends(verdict[key])))
    row["begin"], row["end"] = _ends(result["time"])
    skewness = [e["skewness"] for e in result["estimates"] if e["method"] == "apd_skewness"]
    row["skewness"] = skewness[0] if skewness else None
    row["estimates"] = json.dumps(result["estimates"])
    row["verdict"] = json.dumps(verdict)
    row["warnings"] = json.dumps(result["warnings"])
    return row


def _changes(words, time_limit):
    """Residual and change points by detect_changes, or why there are none."""
    try:
        _, result = _run(words, time_limit)
    except _Ended as ended:
        return {"changes": json.dumps({"status": ended.args[0], "reason": ended.args[1]})}
    if result is None:
        return {"changes": json.dumps({"status": "cannot_tell", "reason": "the record cannot be judged"})}
    found = result["changes"]
    if not found and result["cannot_tell"]:
        return {"changes": json.dumps({"status": "cannot_tell", "reason": result["cannot_tell"]}),
                "residual": result["healthy_residual"]}
    return {"changes": json.dumps({"status": "done", "changes": found}),
            "residual": found[0]["error_before"] if found else result["healthy_residual"]}


def run(spec):
    """The row of a record's result; never throws for what a record or a command can do."""
    start = time.time()
    row = {"key": spec["key"], "host": socket.gethostname()}
    try:
        row["exit_code"], result = _run(spec["command"], spec["time_limit"])
        if result is None:
            raise _Ended("crashed", "diagnose_record printed no JSON")
        if result["version"] != spec["version"]:
            raise _Ended("crashed", "this worker has version %s of diagnose_record, the run is of %s"
                         % (result["version"], spec["version"]))
        row.update(_answer(result), status="done", reason=result["verdict"]["message"])
        if spec["changes"]:
            row.update(_changes(spec["changes"], spec["time_limit"]))
    except _Ended as ended:
        row["status"], row["reason"] = ended.args
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        row["status"], row["reason"] = "crashed", "diagnose_record wrote another JSON than expected: %r" % error
    try:
        now = os.stat(spec["record"])
        same = (now.st_size, now.st_mtime_ns) == (spec["size"], spec["mtime"])
    except OSError:
        same = False
    if not same:
        row["status"], row["reason"] = "changed", "changed while it was read"
    row["seconds"] = time.time() - start
    row["finished"] = time.time()
    return row


def run_all(specs):
    """The rows of several records, one after the other."""
    return [run(spec) for spec in specs]
