#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What an earlier launch file left on the parameter server: private parameters are cleared, a clock that nobody sets is reported
with its remedy. And a robot that does not publish is reported at once."""
import os
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree

import rospy
import rostest
from backlash_diagnosis.srv import Diagnose, SetBaseline
from diagnoser_support import Diagnostics, level, rig_path
from sensor_msgs.msg import JointState
from simulator_support import TIMEOUT, package_folder

WARN = 1


class LaunchAgainTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        # As diagnoser.launch use_sim_time:=true leaves them.
        rospy.set_param("/diagnoser/rig", rig_path())
        rospy.set_param("/diagnoser/curve", "")
        rospy.set_param("/use_sim_time", True)
        cls.log = tempfile.TemporaryFile(mode="w+")
        cls.launch = subprocess.Popen(
            ["roslaunch", "backlash_diagnosis", "robot.launch",
             "rig_folder:=" + os.path.join(package_folder(), "config", "simulated_robot")],
            stdout=cls.log, stderr=subprocess.STDOUT)
        rospy.wait_for_service("/diagnoser/diagnose", TIMEOUT)

    @classmethod
    def tearDownClass(cls):
        cls.launch.send_signal(2)
        cls.launch.wait(TIMEOUT)
        cls.log.close()

    def test_1_no_robot_is_reported_at_once(self):
        # The longest timeout that the service takes: an answer at all is one that did not wait for it.
        answer = rospy.ServiceProxy("/diagnoser/diagnose", Diagnose)("shoulder", 10, 1e6)
        self.assertFalse(answer.success)
        self.assertIn("/joint_states", answer.message)
        self.assertIn("shoulder", answer.message)
        self.assertEqual(answer.estimates, [])
        baseline = rospy.ServiceProxy("/diagnoser/set_baseline", SetBaseline)("shoulder", False)
        self.assertFalse(baseline.success)
        self.assertEqual(baseline.message, "no baseline set: " + answer.message)

    def test_2_a_clock_that_nobody_sets_is_one_finding(self):
        publisher = rospy.Publisher("/joint_states", JointState, queue_size=10)
        message = JointState()
        message.name = ["wrist_joint"]
        message.position, message.effort = [0.1], [0.2]
        diagnostics = Diagnostics()
        timer = rospy.Timer(rospy.Duration(0.02), lambda unused: self.publish(publisher, message))
        status, values = diagnostics.wait_for("diagnoser: wrist: input", lambda l, m, v: "/use_sim_time" in m, "a finding")
        timer.shutdown()
        self.assertEqual(level(status.level), WARN)
        self.assertIn("nobody publishes /clock", status.message)
        self.assertIn("rosparam set /use_sim_time false", status.message)
        self.assertEqual(status.hardware_id, "simulated_robot_wrist")

    @staticmethod
    def publish(publisher, message):
        message.header.stamp = rospy.Time.now()
        message.position[0] += 1e-3
        publisher.publish(message)

    def test_3_every_launch_file_clears(self):
        folder = os.path.join(package_folder(), "launch")
        nodes = 0
        for name in os.listdir(folder):
            for node in xml.etree.ElementTree.parse(os.path.join(folder, name)).iter("node"):
                if node.get("pkg") == "backlash_diagnosis":
                    nodes += 1
                    self.assertEqual(node.get("clear_params"), "true", "%s: %s" % (name, node.get("name")))
        self.assertGreater(nodes, 8)


if __name__ == "__main__":
    rospy.init_node("launch_again_test")
    rostest.rosrun("backlash_diagnosis", "launch_again_test", LaunchAgainTest)
