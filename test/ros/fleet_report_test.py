#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""fleet_report on simulated joints whose play is known: results, page, and that no kill loses or repeats anything."""
import concurrent.futures
import datetime
import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import unittest

import rospkg
import rostest

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


class FleetReportTest(unittest.TestCase):
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

    # What it tells.

    def test_results_are_those_of_the_commands_and_the_simulated_play(self):
        count = self.records()
        self.run_fleet("--reports", "0", code=2)
        self.assert_whole(count)
        for row in self.rows():
            play, growth = JOINTS[row["joint"]]
            week = round((row["time"] - 1785736800) / (7 * 86400))  # 2026-08-03 06:00 UTC
            # The estimator's own interval must hold the truth; it is 0.3 % to either side, see doc/reference/estimators.md.
            self.assertLessEqual(row["angle_lower"], play + growth * week, row["name"])
            self.assertGreaterEqual(row["angle_upper"], play + growth * week, row["name"])
        one = self.rows()[5]
        direct = json.loads(subprocess.run([program("diagnose_record"), one["path"], "--rig", RIG, "--json", "-"],
                                           capture_output=True, text=True).stdout)
        self.assertEqual(json.loads(one["verdict"]), direct["verdict"])
        self.assertEqual(json.loads(one["estimates"]), direct["estimates"])
        self.assertEqual(one["rig_digest"], direct["rig_digest"])
        told = json.loads(self.read("out/fleet.json"))
        self.assertEqual([(j["joint"], j["level"]) for j in told["joints"]],
                         [("cell1/worn", "fault"), ("cell1/ageing", "good"), ("cell2/still", "good")])
        for joint in told["joints"]:
            play, growth = JOINTS[joint["joint"]]
            low, high = (rate * 7 * 86400 for rate in joint["trend"]["rate_interval"])
            # 95 % of three joints: 2e-7 rad per week besides, a tenth of a thousandth of the play.
            self.assertLess(low - 2e-7, growth, joint)
            self.assertGreater(high + 2e-7, growth, joint)
            self.assertEqual(joint["trend"]["grows"], growth > 0)
            self.assertEqual(joint["trend"]["warnings"], [])
        # From 0.5 mrad by 0.02 mrad per week to 1.2 mrad: 35 weeks after the first record, 2027-04-05.
        self.assertEqual(told["joints"][1]["trend"]["reaches"]["date"][:7], "2027-04")

    def test_what_cannot_be_used_is_a_row_with_its_reason(self):
        count = self.records(2)
        first = sorted(os.listdir(self.path("records/cell2/still")))[0]
        still = self.path("records/cell2/still", first)
        shutil.copy(still, self.path("records/cell2/still/20270101T000000.csv"))  # the same content again
        with open(still) as stream:
            lines = stream.read().splitlines()
        lines[20] = lines[20].replace(",", ",x", 1)
        self.write("records/cell2/still/20270102T000000.csv", "\n".join(lines) + "\n")
        self.write("records/notes.csv", "of no joint")
        self.write("records/cell2/still/yesterday.csv", self.read("records/cell1/worn", sorted(
            os.listdir(self.path("records/cell1/worn")))[0]))
        ended = self.run_fleet(*self.stand_in(), code=0)
        self.assertIn("%d records found" % (count + 4), ended.stdout)
        calls = self.calls()
        self.assertEqual(len(calls), count + 1)  # the damaged one, but neither copy and nothing of no joint
        self.assertEqual(len(set(calls)), len(calls))
        rows = {row["name"]: row for row in self.rows()}
        self.assertEqual(len(rows), count + 4)
        damaged = rows["cell2/still/20270102T000000.csv"]
        self.assertEqual(damaged["status"], "refused")
        self.assertIn(":21: ", damaged["reason"])
        self.assertEqual(rows["notes.csv"]["reason"], "no entry of the map matches it")
        self.assertEqual(rows["cell2/still/20270101T000000.csv"]["key"], rows["cell2/still/" + first]["key"])
        self.assertIsNone(rows["cell2/still/yesterday.csv"]["time"])
        told = json.loads(self.read("out/fleet.json"))
        self.assertEqual(told["without_joint"], [{"record": "notes.csv", "reason": "no entry of the map matches it"}])
        notes = [n for joint in told["joints"] if joint["joint"] == "cell2/still" for n in joint["notes"]]
        self.assertIn("1 of 5 records cannot be used", notes[0])
        self.assertIn("{time} in the name is none", notes[1])

    def test_only_what_changed_is_computed_again(self):
        count = self.records(2)
        stand_in = self.stand_in()
        self.run_fleet(*stand_in)
        self.assertEqual(len(self.calls()), count)
        self.run_fleet(*stand_in)
        self.assertEqual(self.calls(), [])
        worn = sorted(os.listdir(self.path("records/cell1/worn")))
        shutil.copy(self.path("records/cell2/still", worn[0]), self.path("records/cell1/worn", worn[1]))
        os.rename(self.path("records/cell1/ageing", worn[0]), self.path("records/cell1/ageing/20260801T000000.csv"))
        self.run_fleet(*stand_in)
        self.assertEqual(self.calls(), [])  # contents that were seen before, under other names
        self.assertEqual(self.rows("key", "name = 'cell1/worn/%s'" % worn[1])[0]["key"],
                         self.rows("key", "name = 'cell2/still/%s'" % worn[0])[0]["key"])
        self.write("shoulder.yaml", self.read("shoulder.yaml") + "# a remark\n")
        self.run_fleet(*stand_in)
        self.assertEqual(len(self.calls()), count - 1)  # all contents, of which one is there twice

    def test_times_from_stamps_and_files(self):
        self.records(1)
        record = self.path("records/cell1/worn", os.listdir(self.path("records/cell1/worn"))[0])
        # A CSV whose time counts since 1970, made by hand: the stamps of the simulation plus 2026-08-03 06:00.
        with open(record) as stream:
            head, *lines = stream.read().splitlines()
        self.assertTrue(head.startswith("time,"))
        shifted = ["%.6f,%s" % (float(line.split(",", 1)[0]) + 1785736800, line.split(",", 1)[1]) for line in lines]
        self.write("records/dated.csv", "\n".join([head] + shifted) + "\n")
        subprocess.run([program("convert_record"), self.path("records/dated.csv"), self.path("records/dated.bag")], check=True,
                       capture_output=True)
        shutil.copy(record, self.path("records/undated.csv"))
        shutil.copy(self.path("records/dated.csv"), self.path("records/file.csv"))
        os.utime(self.path("records/file.csv"), (1600000000, 1600000000))
        self.write("map.yaml", "schema_version: 1\nrecords:\n"
                   "  - {match: 'dated.*', joint: dated, rig: shoulder.yaml}\n"
                   "  - {match: undated.csv, joint: undated, rig: shoulder.yaml}\n"
                   "  - {match: file.csv, joint: file, rig: shoulder.yaml, time: mtime}\n")
        self.run_fleet(*self.stand_in())
        rows = {row["name"]: row for row in self.rows("*", "joint IS NOT NULL")}
        last = float(shifted[-1].split(",")[0])
        self.assertAlmostEqual(rows["dated.csv"]["time"], last, delta=1e-6)
        self.assertIsNone(rows["undated.csv"]["time"])
        self.assertEqual(rows["file.csv"]["time"], 1600000000)
        if rows["dated.bag"]["status"] == "done":
            self.assertAlmostEqual(rows["dated.bag"]["time"], last, delta=1e-6)

    # What may happen to it.

    def test_a_killed_worker_loses_nothing(self):
        count = self.records(4)
        once = "mkdir {0} 2>/dev/null && kill -9 $PPID".format(self.path("killed"))
        self.run_fleet(*self.stand_in(once))
        self.assertTrue(os.path.isdir(self.path("killed")))
        self.assert_whole(count)
        calls = self.calls()
        # The record of the killed worker once more, and what the worker beside it may have lost with it: nothing.
        self.assertEqual(set(calls), {row["name"] for row in self.rows()})
        self.assertLessEqual(len(calls), count + 2)

    def test_a_record_that_kills_every_worker_is_a_row(self):
        count = self.records(2)
        name = sorted(os.listdir(self.path("records/cell1/worn")))[1]
        self.run_fleet(*self.stand_in("[[ $1 == */worn/%s ]] && kill -9 $PPID" % name))
        rows = self.rows()
        self.assertEqual(len(rows), count)
        bad = [row for row in rows if row["status"] != "done"]
        self.assertEqual([row["name"] for row in bad], ["cell1/worn/" + name])
        self.assertEqual(bad[0]["status"], "crashed")
        self.assertIn("the worker died", bad[0]["reason"])

    def once_after(self, calls, signal_name):
        """Words of a stand-in that send a signal to the client. Two stand-ins may count the same calls: one sends it."""
        return "(( $(wc -l <{0}) >= {1} )) && mkdir {2} 2>/dev/null && kill -{3} $(cat {4})".format(
            self.path("calls"), calls, self.path("sent"), signal_name, self.path("out/fleet.lock"))

    def test_a_killed_client_goes_on_where_it_was(self):
        count = self.records(6)
        after = 8
        ended = self.run_fleet(*self.stand_in(self.once_after(after, "KILL")))
        self.assertEqual(ended.returncode, -signal.SIGKILL)
        self.assertFalse(os.path.exists(self.path("out/fleet.json")))
        kept = {row["name"] for row in self.rows("name", "status = 'done'")}
        first = self.calls()
        self.assertGreaterEqual(len(first), after)
        self.assertLessEqual(kept, set(first))
        self.run_fleet(*self.stand_in())
        self.assert_whole(count)
        second = self.calls()
        self.assertEqual(len(set(second)), len(second))
        self.assertEqual(set(second), {row["name"] for row in self.rows()} - kept)

    def test_ctrl_c_ends_it_and_it_goes_on(self):
        count = self.records(4)
        ended = self.run_fleet(*self.stand_in(self.once_after(4, "INT")), code=130)
        self.assertIn("the same command goes on from there", ended.stderr)
        self.assertNotIn("Traceback", ended.stderr)
        kept = {row["name"] for row in self.rows("name", "status = 'done'")}
        self.calls()
        self.run_fleet(*self.stand_in())
        self.assert_whole(count)
        self.assertEqual(set(self.calls()), {row["name"] for row in self.rows()} - kept)

    def test_commands_that_crash_or_hang_are_rows_until_asked_again(self):
        count = self.records(2)
        before = "case $1 in */worn/*) kill -SEGV $$ ;; */ageing/*) exec sleep 600 ;; esac"
        self.run_fleet(*self.stand_in(before), "--time-limit", "6", code=3)
        rows = self.rows()
        self.assertEqual(len(rows), count)
        for row in rows:
            self.assertEqual(row["status"], {"cell1/worn": "crashed", "cell1/ageing": "timed_out", "cell2/still": "done"}[
                row["joint"]], row["reason"])
        self.assertIn("signal 11", [row["reason"] for row in rows if row["joint"] == "cell1/worn"][0])
        self.calls()
        self.run_fleet(*self.stand_in(), code=3)
        self.assertEqual(self.calls(), [])
        self.run_fleet(*self.stand_in(), "--retry", code=0)
        self.assertEqual(len(self.calls()), 4)
        self.assert_whole(count)

    def test_a_cluster_that_is_there(self):
        count = self.records(2)
        cluster = subprocess.Popen([sys.executable, "-c", "if __name__ == '__main__':\n"
                                    " import sys, distributed\n"
                                    " c = distributed.LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=None)\n"
                                    " print(c.scheduler_address, flush=True)\n"
                                    " sys.stdin.read()"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd="/",
                                   env=dict(os.environ, DASK_TEMPORARY_DIRECTORY=self.folder))
        try:
            address = cluster.stdout.readline().strip()
            self.run_fleet(*self.stand_in(), "--scheduler", address)
        finally:
            cluster.communicate("")
        self.assert_whole(count)
        self.assertEqual(len(self.calls()), count)

    # What it refuses.

    def test_refusals_name_their_reason(self):
        self.records(1)
        name = os.listdir(self.path("records/cell1/worn"))[0]
        self.write("empty/nothing.txt", "")
        entry = "  - {match: '**', joint: all, rig: shoulder.yaml}\n"
        for text, code, reason in (
                (MAP + entry, 65, "map.yaml:6: matches cell1/ageing/%s, and so does " % name),
                (MAP + "    colour: red\n", 65, "map.yaml:6: colour: is no key here"),
                (MAP + "    time: sunday\n", 65, "map.yaml:6: time: 'sunday': must be one of"),
                (MAP.replace("}/{joint}\"", "}/{arm}\"", 1).replace("joint: \"{cell}/{arm}", "joint: \"{cell}/{leg}"), 65, "{leg}"),
                (MAP.replace("1", "2", 1), 65, "map.yaml:1: schema_version: '2': must be 1"),
                ("records: [", 65, "map.yaml:1: no YAML"),
                ("", 65, "map.yaml: is empty"),
                (MAP.replace("    rig: shoulder.yaml\n", ""), 65, "rig: is missing")):
            self.write("map.yaml", text)
            ended = self.run_fleet(code=code)
            self.assertIn(reason, ended.stderr)
            self.assertIn("fleet_report: ", ended.stderr)
        self.write("map.yaml", MAP)
        self.assertIn("there is no such folder or list", self.run_fleet(code=66, source="nowhere").stderr)
        self.assertIn("holds no record", self.run_fleet(code=66, source="empty").stderr)
        self.assertIn("is a record", self.run_fleet(code=65, source="records/cell1/worn/" + name).stderr)
        self.assertIn("see --help", self.run_fleet("--cores", "0", code=64).stderr)
        self.assertIn("does not answer", self.run_fleet("--scheduler", "tcp://127.0.0.1:1", code=66).stderr)
        self.assertIn("--scheduler", self.run_fleet("--scheduler", "nonsense://x", code=64).stderr)
        self.write("file", "")
        self.assertIn("cannot be written", self.run_fleet("--out", self.path("file/out"), code=73).stderr)
        shutil.rmtree(self.path("out"))
        self.write("out/fleet.sqlite", "no state " * 200)
        self.assertIn("is no state of fleet_report", self.run_fleet(code=65).stderr)

    def test_a_list_with_what_is_not_there(self):
        self.records(1)
        names = [row for joint in JOINTS for row in [joint + "/" + os.listdir(self.path("records", joint))[0]]]
        self.write("records/list.txt", "# of monday\n" + "\n".join(names) + "\n\ncell1/worn/20270101T000000.csv\n")
        self.run_fleet(*self.stand_in(), source="records/list.txt", code=0)
        rows = {row["name"]: row for row in self.rows()}
        self.assertEqual(sorted(rows), sorted(names + ["cell1/worn/20270101T000000.csv"]))
        self.assertEqual(rows["cell1/worn/20270101T000000.csv"]["reason"], "there is no such file")

    # The page.

    def test_the_page_in_a_browser(self):
        sys.path.insert(0, os.path.join(SOURCE, "test/tools"))
        import look_at_pages
        try:
            from selenium.webdriver.common.by import By
        except ImportError as error:
            self.skipTest("%s (Debian: python3-selenium)" % error)
        if not (os.access(look_at_pages.BROWSER, os.X_OK) and os.access(look_at_pages.DRIVER, os.X_OK)):
            self.skipTest("no Chromium (Debian: chromium, chromium-driver)")
        self.records()
        self.write("records/<b>.csv", "of no joint")
        self.run_fleet()
        driver = look_at_pages.browser(self.path("profile"))
        self.addCleanup(driver.quit)
        driver.get("about:blank")
        driver.get_log("performance"), driver.get_log("browser")
        driver.get("file://" + self.path("out/fleet.html"))

        def shown():
            rows = driver.find_elements(By.CSS_SELECTOR, "#joints tbody tr")
            return [row.find_element(By.CSS_SELECTOR, ".joint").text for row in rows if row.is_displayed()]

        def press(text):
            [b for b in driver.find_elements(By.TAG_NAME, "button") if text in b.text][0].click()
        self.assertEqual(shown(), ["cell1/worn", "cell1/ageing", "cell2/still"])
        press("2 growing")
        self.assertEqual(shown(), ["cell1/worn", "cell1/ageing"])
        press("2 good")
        self.assertEqual(shown(), ["cell1/ageing"])
        press("2 growing"), press("2 good")
        driver.find_element(By.ID, "find").send_keys("CELL2")
        self.assertEqual(shown(), ["cell2/still"])
        self.assertEqual(driver.find_element(By.ID, "shown").text, "1 of 3 joints")
        driver.find_element(By.ID, "find").clear()
        driver.find_element(By.ID, "find").send_keys(" ")
        press("joint")
        self.assertEqual(shown(), ["cell1/ageing", "cell1/worn", "cell2/still"])
        press("backlash"), press("backlash")
        self.assertEqual(shown(), ["cell2/still", "cell1/ageing", "cell1/worn"])
        self.assertIn("<b>.csv", driver.find_element(By.CSS_SELECTOR, ".others").text)
        curves = driver.find_elements(By.CSS_SELECTOR, "#joints svg .dots")
        self.assertEqual(len(curves), 3)
        for curve in curves:  # a dot per record, over all of the width
            self.assertEqual(curve.get_attribute("d").count("M"), WEEKS)
            self.assertGreater(curve.rect["width"], 100)
        driver.find_element(By.LINK_TEXT, "cell1/worn").click()
        self.assertEqual(driver.title, "cell1/worn")
        rows = driver.find_elements(By.CSS_SELECTOR, "#records tbody tr")
        self.assertEqual(len(rows), WEEKS)
        self.assertIn("2026-10-12 06:00:00", rows[0].text)
        self.assertIn("service", rows[0].text)
        rows[0].find_element(By.LINK_TEXT, "report").click()
        self.assertIn("position_difference", driver.find_element(By.TAG_NAME, "body").text)
        self.assertEqual([entry["message"] for entry in driver.get_log("browser")], [])
        self.assertEqual([url for url in look_at_pages.requests(driver) if not url.startswith("file://")], [])
        for page in ("fleet.html", "joints/" + sorted(os.listdir(self.path("out/joints")))[0]):
            driver.get("file://" + self.path("out", page))
            for width in look_at_pages.WIDTHS:
                look_at_pages.set_width(driver, width)
                self.assertEqual(driver.execute_script("return document.documentElement.scrollWidth - innerWidth"), 0, page)


if __name__ == "__main__":
    rostest.rosrun(PACKAGE, "fleet_report_test", FleetReportTest)
