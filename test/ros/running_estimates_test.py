#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Running estimates go on for as long as samples come: a play that changes late is on the topic, on /diagnostics, in the history
and in the report, of a joint with two encoders and of one with the motor's alone."""
import csv
import json
import os
import shutil
import subprocess
import tempfile
import time
import unittest

import rospy
import rostest
from backlash_diagnosis.msg import BacklashEstimate
from backlash_diagnosis.srv import SetBacklash
from diagnoser_support import Diagnostics, level, run_tool
from sensor_msgs.msg import JointState
from simulator_support import TIMEOUT, Inbox, nanoseconds

METHODS = {"shoulder": "position_difference", "elbow": "gap_traverse"}
WORN = 1.5e-3  # rad; between the limits service and stop of both joints
# s of stamps: what is kept (60 s) is trimmed at 75 s, from which no more whole periods come to be at hand.
LATE = 100
ERROR = 2
LONG = 5 * TIMEOUT  # s: LATE at ten times real time on a busy machine


def wait(condition, what):
    end = time.monotonic() + LONG
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(0.2)
    raise AssertionError("not within %d s: %s" % (LONG, what))


class RunningEstimatesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.history = tempfile.mkdtemp()
        cls.log = tempfile.TemporaryFile(mode="w+")
        cls.launch = subprocess.Popen(["roslaunch", "backlash_diagnosis", "simulated_robot.launch", "real_time_factor:=10",
                                       "history:=" + cls.history], stdout=cls.log, stderr=subprocess.STDOUT)
        cls.states = Inbox("/joint_states", JointState)
        cls.estimates = Inbox("/backlash_estimate", BacklashEstimate)
        cls.diagnostics = Diagnostics()

    @classmethod
    def tearDownClass(cls):
        cls.launch.send_signal(2)
        cls.launch.wait(TIMEOUT)
        cls.log.close()
        shutil.rmtree(cls.history, ignore_errors=True)

    def answers(self, joint, later_than=0):
        return [m for m in list(self.estimates.messages) if m.joint == joint and m.method == METHODS[joint]
                and m.status_name == "ok" and nanoseconds(m) > later_than]

    def entries(self, joint):
        path = os.path.join(self.history, joint + ".csv")
        if not os.path.exists(path):
            return []
        with open(path, newline="") as stream:
            return list(csv.DictReader(stream))

    def test_1_estimates_come_past_every_ring(self):
        first = nanoseconds(self.states.wait_for_count(1)[0])
        for joint in METHODS:
            wait(lambda joint=joint: self.answers(joint, first + LATE * 10**9), "an estimate of %s after %d s" % (joint, LATE))
            wait(lambda joint=joint: self.entries(joint), "history of %s" % joint)

    def test_2_a_late_change_is_everywhere(self):
        for joint in METHODS:
            self.assertTrue(rospy.ServiceProxy("/simulator/%s/set_backlash" % joint, SetBacklash)(WORN).success)
        changed = nanoseconds(self.states.messages[-1])

        def on_topic(joint):
            return next((m for m in self.answers(joint, changed) if m.angle_lower <= WORN <= m.angle_upper
                         and m.backlash_angle > 0.8 * WORN), None)
        for joint in METHODS:
            wait(lambda joint=joint: on_topic(joint), "the new play of %s on the topic" % joint)
            self.diagnostics.wait_for("diagnoser: %s: backlash" % joint,
                                      lambda l, m, v: level(l) == ERROR and v.get("Grade") == "service", "service")
            wait(lambda joint=joint: self.entries(joint)[-1]["grade"] == "service", "the new play of %s in the history" % joint)

    def test_3_and_in_the_report(self):
        out = os.path.join(self.history, "day")
        run_tool("day_report", self.history, "--out", out + ".html", "--json", out + ".json", codes=(2,))
        with open(out + ".json") as stream:
            joints = {joint["joint"]: joint for joint in json.load(stream)["joints"]}
        for joint in METHODS:
            self.assertEqual(joints[joint]["grade"], "service")
            last = joints[joint]["series"][-1]["angle_interval"]
            self.assertTrue(last[0] <= WORN <= last[1], last)


if __name__ == "__main__":
    rospy.init_node("running_estimates_test")
    rostest.rosrun("backlash_diagnosis", "running_estimates_test", RunningEstimatesTest)
