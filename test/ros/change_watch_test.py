#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""simulated_robot.launch with changes:=true: the healthy robot is learned from its own topics, then joints change."""
import json
import os
import shutil
import subprocess
import threading
import time
import unittest

import roslib.packages
import rospy
import rostest
from backlash_diagnosis.msg import Change, ChangeReport
from backlash_diagnosis.srv import SetBacklash, SetRig
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from simulator_support import PACKAGE, TIMEOUT, Inbox

ADDED = 0.8  # N m of dry friction, of 4
BACKLASH, WEAR = 5.4e-4, 2e-4  # rad, of the shoulder, and what is added to it


class Statuses:
    """The latest status of each name on /diagnostics."""

    def __init__(self):
        self._latest = {}
        self._changed = threading.Condition()
        self._subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, self._receive)

    def _receive(self, message):
        with self._changed:
            for status in message.status:
                self._latest[status.name.split("change_watch: ")[-1]] = status
            self._changed.notify_all()

    def wait_for(self, name, condition, what, timeout=TIMEOUT):
        deadline = time.monotonic() + timeout
        with self._changed:
            while not (name in self._latest and condition(self._latest[name])):
                left = deadline - time.monotonic()
                if left <= 0:
                    raise AssertionError("%s: no %s; latest: %s" % (name, what, self._latest.get(name)))
                self._changed.wait(left)
            return self._latest[name]


def number(status, key):
    return int(next(v.value for v in status.values if v.key == key))


def rig_text(added):
    """The wrist's rig file with so much more dry friction."""
    folder = roslib.packages.get_pkg_dir(PACKAGE)
    text = open(os.path.join(folder, "config", "simulated_robot", "wrist.yaml")).read()
    old = "coulomb_friction: 4 "
    assert text.count(old) == 1
    return text.replace(old, "coulomb_friction: %g " % (4 + added))


class ChangeWatchTest(unittest.TestCase):
    wrong = 0  # nodes with wrong parameters so far: each has a name, and parameters, of its own

    @classmethod
    def setUpClass(cls):
        cls.statuses = Statuses()
        cls.reports = Inbox("/changes", ChangeReport)
        cls.folder = rospy.get_param("/change_watch/folder")
        rospy.wait_for_service("/simulator/wrist/set_rig", TIMEOUT)
        cls.set_rig = rospy.ServiceProxy("/simulator/wrist/set_rig", SetRig)
        cls.set_backlash = rospy.ServiceProxy("/simulator/shoulder/set_backlash", SetBacklash)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    def change_by(self, added):
        """Between which two stamps the joint became another."""
        before = rospy.Time.now()
        answer = self.set_rig(rig_text(added))
        self.assertTrue(answer.success, answer.message)
        return before, rospy.Time.now()

    def began_between(self, change, before, after):
        """A 95 % interval misses once in twenty moments, and the moment is never the same: it may by its own length."""
        length = change.since_to - change.since_from
        self.assertLessEqual(change.since_from - length, after)
        self.assertGreaterEqual(change.since_to + length, before)

    def looked(self, more):
        """Waits for so many further looks with an answer."""
        first = number(self.statuses.wait_for("wrist: model", lambda s: True, "status"), "Looks with an answer")
        return self.statuses.wait_for("wrist: model", lambda s: number(s, "Looks with an answer") >= first + more,
                                      "further look")

    def test_1_says_why_it_cannot_tell(self):
        status = self.statuses.wait_for("wrist: model", lambda s: "learned" in s.message, "learning")
        self.assertEqual(status.level, DiagnosticStatus.STALE)
        status = self.statuses.wait_for("shoulder: model", lambda s: "learned" in s.message, "learning")
        self.assertEqual(status.level, DiagnosticStatus.STALE)

    def test_2_a_healthy_robot_has_not_changed(self):
        # 40 s of wall time are simulated before it can be learned, and three joints are learned by one after the other.
        self.statuses.wait_for("wrist: model", lambda s: s.level == DiagnosticStatus.OK, "OK", 2 * TIMEOUT)
        learned = os.path.join(self.folder, "wrist_healthy.csv")
        self.assertTrue(os.path.exists(learned), learned)
        status = self.looked(3)
        self.assertEqual((status.level, self.reports.messages), (DiagnosticStatus.OK, []), status.message)

    def test_3_friction_that_grows_is_named_with_its_time(self):
        before, after = self.change_by(ADDED)
        report = self.reports.wait_for(lambda all_of: all_of and all_of[-1], "report")
        self.assertEqual([c.joint for c in report.news], ["wrist"])
        change = report.news[0]
        rospy.loginfo(change.text)
        self.assertEqual((change.effect, change.state, change.id), ("motor_coulomb", Change.STANDING, 1))
        self.began_between(change, before, after)
        self.assertLess((change.since_to - change.since_from).to_sec(), 5)
        size = change.size[0]
        self.assertEqual((size.name, size.unit), ("motor_coulomb", "N m"))
        self.assertLessEqual(size.lower, ADDED)
        self.assertGreaterEqual(size.upper, ADDED)
        self.assertLess(change.error_after, change.error_before)
        self.statuses.wait_for("wrist: model", lambda s: s.level == DiagnosticStatus.WARN
                               and s.message.startswith("changed: motor_coulomb since "), "warning")
        # What it saw, the command sees in the record that the node has kept of it.
        kept = [os.path.join(self.folder, "wrist_%s.csv" % what) for what in ("healthy", "changed")]
        seen = os.path.join(self.folder, "seen.json")
        rig = os.path.join(roslib.packages.get_pkg_dir(PACKAGE), "config", "simulated_robot", "wrist.yaml")
        subprocess.run(["rosrun", PACKAGE, "detect_changes", "--rig", rig, "--healthy", kept[0], "--json", seen, kept[1]],
                       timeout=TIMEOUT, check=False)
        with open(seen) as found:
            self.assertIn("motor_coulomb", [c["effect"] for c in json.load(found)["changes"]])

    def test_4_what_is_undone_has_an_end(self):
        before, after = self.change_by(0)
        report = self.reports.wait_for(lambda all_of: any(c.state == Change.ENDED for c in all_of[-1].changes)
                                       and all_of[-1], "end")
        self.assertEqual([(c.joint, c.id) for c in report.changes], [("wrist", 1)])
        until = report.changes[0].until.to_sec()
        # As wide as the onset's interval may be.
        self.assertTrue(before.to_sec() - 5 < until < after.to_sec() + 5, (before, until, after))
        self.statuses.wait_for("wrist: model", lambda s: s.level == DiagnosticStatus.OK, "OK")

    def test_5_a_joint_with_two_encoders_wears(self):
        self.statuses.wait_for("shoulder: model", lambda s: s.level == DiagnosticStatus.OK, "OK")
        before = rospy.Time.now()
        answer = self.set_backlash(BACKLASH + WEAR)
        self.assertTrue(answer.success, answer.message)
        after = rospy.Time.now()
        report = self.reports.wait_for(lambda all_of: all_of[-1].news[0].joint == "shoulder" and all_of[-1], "report")
        change = report.news[0]
        rospy.loginfo(change.text)
        self.assertEqual((change.effect, change.state), ("backlash", Change.STANDING))
        self.began_between(change, before, after)
        self.assertEqual((change.size[0].name, change.size[0].unit), ("angle", "rad"))
        self.assertLessEqual(change.size[0].lower, WEAR)
        self.assertGreaterEqual(change.size[0].upper, WEAR)

    def test_6_a_machine_that_cannot_go_on_is_refused(self):
        for text, reason in (("name: x", "schema_version"), (rig_text(-4), "friction")):
            answer = self.set_rig(text)
            self.assertFalse(answer.success)
            self.assertIn(reason, answer.message)

    def test_7_wrong_parameters_end_the_node_with_their_name(self):
        rig = os.path.join(roslib.packages.get_pkg_dir(PACKAGE), "config", "ur10e_joint.yaml")
        for words, code, shown in (([], 64, ("~rig", "must be given")),
                                   (["_rig:=" + rig, "_windw:=100"], 64, ("~windw",)),
                                   (["_rig:=" + rig, "_window:=5"], 64, ("~window", "5")),
                                   (["_rig:=" + rig, "_false_alarms:='1 per moon'"], 64, ("~false_alarms", "1 per moon")),
                                   (["_rig:=" + rig, "_history:=/nowhere"], 64, ("~history", "/nowhere")),
                                   (["_rig:=" + rig, "_healthy:=monday.csv"], 64, ("~healthy", "list")),
                                   (["_rig:=" + rig], 66, ("/nowhere/monday.csv",)),
                                   (["_rig:=/nowhere/rig.yaml"], 66, ("/nowhere/rig.yaml",))):
            name = "wrong_%d" % self.wrong
            ChangeWatchTest.wrong += 1
            if code == 66:  # a list comes from a launch file
                rospy.set_param("/%s/healthy" % name, ["/nowhere/monday.csv"])
            done = subprocess.run(["rosrun", PACKAGE, "change_watch", "__name:=" + name] + words, timeout=TIMEOUT,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
            self.assertEqual(done.returncode, code, done.stdout)
            for text in shown:
                self.assertIn(text, done.stdout)


if __name__ == "__main__":
    rospy.init_node("change_watch_test")
    rostest.rosrun("backlash_diagnosis", "change_watch_test", ChangeWatchTest)
