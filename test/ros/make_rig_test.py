#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""make_rig beside the simulated robot: from its topics alone to a rig file for each joint, with which its recording is diagnosed."""
import json
import os
import tempfile
import unittest

import rospy
import rostest
import yaml
from diagnoser_support import run_tool
from sensor_msgs.msg import JointState
from simulator_support import TIMEOUT

PLAY = 5.4e-4  # rad: that of config/simulated_robot/shoulder.yaml


class MakeRigTest(unittest.TestCase):
    def setUp(self):
        for topic in ("/joint_states", "/link_states"):
            rospy.wait_for_message(topic, JointState, TIMEOUT)
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def test_topics_become_a_rig_file_for_each_joint(self):
        done = run_tool("make_rig", "--topic", "joint_states", "link_states", "--duration", 20, "--out", self.folder.name)
        self.assertIn("robot.launch rig_folder:=", done.stdout)
        rigs = {}
        for joint in ("shoulder_joint", "elbow_joint", "wrist_joint"):
            with open(self.path(joint + ".yaml")) as stream:
                rigs[joint] = yaml.safe_load(stream)
        # The encoder of the link is on another topic and has another name: it is found as it goes along.
        load = rigs["shoulder_joint"]["channels"]["load_position"]
        self.assertEqual((load["topic"], load["name"]), ("link_states", "shoulder_link"))
        self.assertNotIn("load_position", rigs["elbow_joint"]["channels"])
        # All of the wrist's inertia, 1.2 kg m^2, is seen at its motor.
        self.assertAlmostEqual(rigs["wrist_joint"]["gear_train"]["motor"]["inertia"], 1.2, delta=0.12)
        run_tool("diagnose_record", self.path("robot.bag"), "--rig", self.path("shoulder_joint.yaml"),
                 "--json", self.path("report.json"))
        with open(self.path("report.json")) as stream:
            low, high = json.load(stream)["verdict"]["angle_interval"]
        self.assertTrue(low <= PLAY <= high, (low, high))

    def test_robot_description_is_kept_beside_the_file(self):
        run_tool("make_rig", "--robot-description", "--out", self.path("arm.yaml"))
        with open(self.path("arm.urdf")) as stream:
            self.assertIn("two_link_arm", stream.read())
        with open(self.path("arm.yaml")) as stream:
            self.assertEqual([j["name"] for j in yaml.safe_load(stream)["joints"]], ["shoulder", "elbow"])

    def test_a_silent_topic_is_refused_with_those_that_are_there(self):
        done = run_tool("make_rig", "--topic", "nothing", "--out", self.path("x.yaml"), codes=(66,))
        self.assertIn("/joint_states", done.stderr)
        self.assertEqual(os.listdir(self.folder.name), [])


if __name__ == "__main__":
    rospy.init_node("make_rig_test")
    rostest.rosrun("backlash_diagnosis", "make_rig_test", MakeRigTest)
