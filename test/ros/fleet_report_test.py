#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""fleet_report on simulated joints whose play is known: results, and that no kill loses or repeats anything."""
import json
import os
import shutil
import subprocess

import rostest
from fleet_support import JOINTS, MAP, PACKAGE, RIG, FleetTest, program


class FleetReportTest(FleetTest):
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
        fleet = json.loads(self.read("out/fleet.json"))
        self.assertEqual([(j["joint"], j["level"]) for j in fleet["joints"]],
                         [("cell1/worn", "fault"), ("cell1/ageing", "good"), ("cell2/still", "good")])
        for joint in fleet["joints"]:
            play, growth = JOINTS[joint["joint"]]
            low, high = (rate * 7 * 86400 for rate in joint["trend"]["rate_interval"])
            # 95 % of three joints: 2e-7 rad per week besides, a tenth of a thousandth of the play.
            self.assertLess(low - 2e-7, growth, joint)
            self.assertGreater(high + 2e-7, growth, joint)
            self.assertEqual(joint["trend"]["grows"], growth > 0)
            self.assertEqual(joint["trend"]["warnings"], [])
        self.assertIn("cell1/worn", self.read("out/fleet.html"))
        # From 0.5 mrad by 0.02 mrad per week to 1.2 mrad: 35 weeks after the first record, 2027-04-05.
        self.assertEqual(fleet["joints"][1]["trend"]["reaches"]["date"][:7], "2027-04")

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
        fleet = json.loads(self.read("out/fleet.json"))
        self.assertEqual(fleet["without_joint"], [{"record": "notes.csv", "reason": "no entry of the map matches it"}])
        notes = [n for joint in fleet["joints"] if joint["joint"] == "cell2/still" for n in joint["notes"]]
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

    def test_a_wrong_map_is_refused_with_its_line(self):
        self.records(1)
        self.write("map.yaml", MAP + "    colour: red\n")
        self.assertIn("map.yaml:6: colour: is no key here", self.run_fleet(code=65).stderr)

    def test_a_list_with_what_is_not_there(self):
        self.records(1)
        names = [row for joint in JOINTS for row in [joint + "/" + os.listdir(self.path("records", joint))[0]]]
        self.write("records/list.txt", "# of monday\n" + "\n".join(names) + "\n\ncell1/worn/20270101T000000.csv\n")
        self.run_fleet(*self.stand_in(), source="records/list.txt", code=0)
        rows = {row["name"]: row for row in self.rows()}
        self.assertEqual(sorted(rows), sorted(names + ["cell1/worn/20270101T000000.csv"]))
        self.assertEqual(rows["cell1/worn/20270101T000000.csv"]["reason"], "there is no such file")


if __name__ == "__main__":
    rostest.rosrun(PACKAGE, "fleet_report_test", FleetReportTest)
