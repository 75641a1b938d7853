# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of fleet_report share: records of simulated joints whose play is known, and a command that notes its calls."""
import concurrent.futures
import datetime
import os
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import unittest

import rospkg

PACKAGE = "backlash_diagnosis"
SOURCE = os.path.realpath(os.path.join(rospkg.RosPack().get_path(PACKAGE), "package.xml")).rpartition("/")[0]
RIG = os.path.join(SOURCE, "config/simulated_robot/shoulder.yaml")
LONG = 120  # s, far beyond what anything here takes

# joint -> play at the first record [rad] and growth per week [rad]; limits of the rig: watch 0.8, service 1.2, stop 2 mrad.
JOINTS = {"cell1/worn": (5.0e-4, 8e-5), "cell1/ageing": (5.0e-4, 2e-5), "cell2/still": (5.0e-4, 0.0)}
WEEKS = 11  # one more than a trend needs
MAP = """schema_version: 1
records:
  - match: "{cell}/{joint}/{time}.csv"
    joint: "{cell}/{joint}"
    rig: shoulder.yaml
"""
# A stand-in for diagnose_record that notes each call and then does it; `{}` is what a test puts before that.
STAND_IN = """#!/bin/bash
[[ $1 == --version ]] && exec {real} "$@"
echo "$1" >>{log}
{before}
exec {real} "$@"
"""


def program(name):
    """Absolute path of an executable of the package."""
    return subprocess.run(["catkin_find", "--first-only", "--libexec", PACKAGE, name], check=True, capture_output=True,
                          text=True).stdout.strip()


def simulate(joint, week, folder):
    play, growth = JOINTS[joint]
    date = datetime.datetime(2026, 8, 3, 6) + datetime.timedelta(weeks=week)
    path = os.path.join(folder, joint, date.strftime("%Y%m%dT%H%M%S.csv"))
    subprocess.run([program("simulate"), RIG, "--duration", "8", "--backlash", repr(play + growth * week), "--seed",
                    str(100 * sorted(JOINTS).index(joint) + week), "--out", path], check=True, stdout=subprocess.DEVNULL)


class FleetTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.clean = tempfile.mkdtemp()
        for joint in JOINTS:
            os.makedirs(os.path.join(cls.clean, joint))
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            list(pool.map(lambda job: simulate(*job, cls.clean), [(j, w) for j in JOINTS for w in range(WEEKS)]))

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.clean)

    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)
        shutil.copy(RIG, self.path("shoulder.yaml"))
        self.write("map.yaml", MAP)

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def write(self, name, text):
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "w") as stream:
            stream.write(text)
        return self.path(name)

    def read(self, *names):
        with open(self.path(*names)) as stream:
            return stream.read()

    def records(self, weeks=WEEKS):
        """The first weeks of all joints, in this test's folder."""
        for joint in JOINTS:
            os.makedirs(self.path("records", joint))
            for name in sorted(os.listdir(os.path.join(self.clean, joint)))[:weeks]:
                shutil.copy(os.path.join(self.clean, joint, name), self.path("records", joint, name))
        return len(JOINTS) * weeks

    def words(self, *more, source="records"):
        return [sys.executable, program("fleet_report"), self.path(source), "--rigs", self.path("map.yaml"), "--out",
                self.path("out"), "--cores", "2", *more]

    def run_fleet(self, *more, code=None, source="records"):
        ended = subprocess.run(self.words(*more, source=source), capture_output=True, text=True, timeout=LONG, cwd=self.folder)
        if code is not None:
            self.assertEqual(ended.returncode, code, ended.stdout + ended.stderr)
        return ended

    def stand_in(self, before=":"):
        text = STAND_IN.format(real=program("diagnose_record"), log=self.path("calls"), before=before)
        os.chmod(self.write("bin/diagnose_record", text), 0o755)
        for name in ("backlash_trend", "detect_changes"):
            if not os.path.exists(self.path("bin", name)):
                os.symlink(program(name), self.path("bin", name))
        return "--diagnose-record", self.path("bin/diagnose_record"), "--reports", "0"

    def calls(self):
        """Names of the records that the stand-in was called for since the last time."""
        if not os.path.exists(self.path("calls")):
            return []
        names = [os.path.relpath(line, self.path("records")) for line in self.read("calls").splitlines()]
        os.unlink(self.path("calls"))
        return names

    def rows(self, what="*", where="1"):
        with sqlite3.connect(self.path("out/fleet.sqlite")) as base:
            base.row_factory = sqlite3.Row
            return base.execute("SELECT %s FROM fleet WHERE %s ORDER BY path" % (what, where)).fetchall()

    def assert_whole(self, count):
        """Each record has its row, each row its result."""
        self.assertEqual(len(self.rows()), count)
        self.assertEqual([dict(row) for row in self.rows("name, status, reason", "status != 'done'")], [])

    def once_after(self, calls, signal_name):
        """Words of a stand-in that send a signal to the client. Two stand-ins may count the same calls: one sends it."""
        return "(( $(wc -l <{0}) >= {1} )) && mkdir {2} 2>/dev/null && kill -{3} $(cat {4})".format(
            self.path("calls"), calls, self.path("sent"), signal_name, self.path("out/fleet.lock"))
