# SPDX-License-Identifier: BSD-3-Clause
"""The clean inputs that faults are put into, and what is known of them: the oracle of the campaign."""
import copy
import csv
import io
import math
import os
import subprocess
import tempfile

from case import BAD, CANNOT_TELL, RIGHT, read_json

BACKLASH = 80e-6  # m, simulated
BASE_RADIUS = 0.014917  # m, of config/sarkar_1997.yaml
TOLERANCE = 0.05  # of it: the clean record is answered to 1 %, a fault may cost it samples
DURATION, RATE = 1.2, 1000  # s, Hz: ten periods behind the two of settling


class Clean:
    """Made once per campaign by the commands themselves from the rig files of the repository."""

    def __init__(self, program_of, config):
        self.program_of = program_of
        self.config = {name: read_bytes(os.path.join(config, name)) for name in sorted(os.listdir(config))
                       if name.endswith(".yaml")}
        self.rig = self.config["sarkar_1997.yaml"]
        with tempfile.TemporaryDirectory() as folder:
            self._make(folder)
        self.header, self.rows = table_of(self.record)

    def servo(self):
        """The same view of a motor and load with an encoder each."""
        other = copy.copy(self)
        other.record, other.rig = self.servo_record, self.config["two_inertia_servo.yaml"]
        other.header, other.rows = table_of(other.record)
        return other

    def _make(self, folder):
        def path(name):
            return os.path.join(folder, name)
        with open(path("rig.yaml"), "wb") as out:
            out.write(self.rig)
        self._run("simulate", path("rig.yaml"), "--backlash", BACKLASH, "--duration", DURATION, "--sample-rate", RATE,
                  "--out", path("record.csv"))
        self._run("build_curve", path("rig.yaml"), "--out", path("curve.yaml"), "--points", 11, "--periods", 3,
                  "--seeds", 4, "--sample-rate", RATE)
        self._run("diagnose_record", path("record.csv"), "--rig", path("rig.yaml"), "--curve", path("curve.yaml"),
                  "--json", path("out.json"), "--save-baseline", path("baseline.yaml"))
        with open(path("servo.yaml"), "wb") as out:
            out.write(self.config["two_inertia_servo.yaml"])
        self._run("simulate", path("servo.yaml"), "--duration", 3, "--out", path("servo.csv"))
        self.servo_record = read_bytes(path("servo.csv"))
        self.record, self.curve, self.baseline = (read_bytes(path(name)) for name in
                                                  ("record.csv", "curve.yaml", "baseline.yaml"))

    def _run(self, name, *arguments):
        subprocess.run([self.program_of(name)] + [str(a) for a in arguments], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)

    limits = b"schema_version: 1\nbacklash: {watch: 1.0e-4, service: 1.5e-4, stop: 2.0e-4}  # m\n"


def table_of(record):
    header, *rows = csv.reader(io.StringIO(record.decode()))
    return header, rows


def read_bytes(path):
    with open(path, "rb") as stream:
        return stream.read()


def judge_diagnosis(folder, code, err):
    """The verdict holds the known backlash, or says that it cannot tell, or that its methods disagree."""
    return judged(folder, code, "backlash", "interval", BACKLASH)


def judge_angle(folder, code, err):
    return judged(folder, code, "backlash_angle", "angle_interval", BACKLASH / BASE_RADIUS)


def judged(folder, code, value_key, interval_key, truth):
    report = read_json(folder, "out.json")
    verdict = report["verdict"]
    if code == 3:
        return (CANNOT_TELL, verdict["message"]) if verdict["message"] else (BAD, "cannot tell, but not why")
    value, interval = verdict[value_key], verdict[interval_key]
    if value is None or interval is None:
        return BAD, "graded %s without a value" % verdict["grade"]
    lower = -math.inf if interval[0] is None else interval[0]
    upper = math.inf if interval[1] is None else interval[1]
    holds = lower <= truth <= upper or abs(value - truth) <= TOLERANCE * truth
    text = "%.4g [%.4g, %.4g] by %s; %s" % (value, lower, upper, ", ".join(verdict["members"]), verdict["message"])
    if verdict["dissenters"] and (holds or lower <= truth <= upper):
        return CANNOT_TELL, "methods disagree: " + text
    return (RIGHT if holds else BAD), text


def finite_rows(path):
    """Number of rows of a CSV whose fields are all finite numbers; None where one is not."""
    count = 0
    with open(path, newline="") as stream:
        for row in list(csv.reader(stream))[1:]:
            if not all(math.isfinite(float(field)) for field in row):
                return None
            count += 1
    return count
