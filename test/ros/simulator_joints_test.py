#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Several joints in one simulator: each is as it would be alone, and all are in the same messages."""
import os
import shutil
import tempfile
import unittest

import rospy
import rostest
from backlash_diagnosis.srv import SetBacklash
from sensor_msgs.msg import JointState
from simulator_support import Inbox, Simulator, TIMEOUT, default_rig, latched, package_folder, write_rig
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger

PARTS = ["motor", "sensor", "load"]


def motion(messages, joint):
    """Position, velocity and effort of one joint's parts in each message."""
    rows = []
    for message in messages:
        at = [message.name.index("%s_%s" % (joint, part)) for part in PARTS]
        rows.append([(message.position[i], message.velocity[i], message.effort[i]) for i in at])
    return rows


def recorded(parameters, count):
    with Simulator(dict(parameters, wait_for_subscriber=True)) as simulator:
        return Inbox(simulator.topic("joint_states"), JointState).wait_for_count(count)


class SimulatorJointsTest(unittest.TestCase):
    def test_each_joint_moves_as_it_would_alone(self):
        common = {"excitation_frequency": 4.0, "seed": 7}
        several = recorded(dict(common, joints=["hip", "knee", "ankle"], knee={"backlash": 1e-4, "seed": 3},
                                ankle={"half_gap": 2e-5, "excitation_amplitude": 0.03}), 600)
        self.assertEqual(several[0].name, ["%s_%s" % (j, p) for j in ("hip", "knee", "ankle") for p in PARTS])
        alone = {"hip": {}, "knee": {"backlash": 1e-4, "seed": 3},
                 "ankle": {"half_gap": 2e-5, "excitation_amplitude": 0.03, "seed": 7 + 2}}
        for joint, own in alone.items():
            one = recorded(dict(common, joint=joint, **own), 600)
            self.assertEqual(motion(several, joint), motion(one, joint), joint)

    def test_a_folder_of_rig_files_that_is_wrong_is_refused(self):
        robot = os.path.join(package_folder(), "config", "simulated_robot")
        shoulder = os.path.join(robot, "shoulder.yaml")
        for parameters, words in (({"rig_folder": "/nowhere"}, ("~rig_folder", "/nowhere")),
                                  ({"rig_folder": robot, "rig": shoulder}, ("~rig_folder", "beside ~rig")),
                                  ({"rig_folder": robot, "joint": "elbow"}, ("~joint", "~rig_folder")),
                                  ({"rig_folder": robot, "joints": ["ankle"]}, ("ankle", "no rig file in ~rig_folder")),
                                  ({"rig": shoulder, "joints": ["shoulder", "knee"]}, ("knee", "of joint shoulder"))):
            with Simulator(parameters) as simulator:
                code, output = simulator.wait()
            self.assertEqual(code, 64, output)
            for word in words:
                self.assertIn(word, output)

    def test_topics_and_services_are_below_the_name_of_the_joint(self):
        parameters = {"joints": ["left", "right"], "right": {"backlash": 1e-4}}
        with Simulator(parameters) as simulator:
            rospy.wait_for_service(simulator.name + "/reset", TIMEOUT)
            self.assertEqual(latched("/left/true_backlash", Float64).data, 0)
            self.assertEqual(latched("/right/true_backlash", Float64).data, 1e-4)
            description = latched("/right/rig_description", String).data.splitlines()[0]
            self.assertIn("backlash = 1e-04", description)
            self.assertIn("joint = right", description)
            widen = rospy.ServiceProxy(simulator.name + "/left/set_backlash", SetBacklash)
            self.assertTrue(widen(5e-5).success)
            self.assertEqual(latched("/left/true_backlash", Float64).data, 5e-5)
            self.assertEqual(latched("/right/true_backlash", Float64).data, 1e-4)
            self.assertTrue(rospy.ServiceProxy(simulator.name + "/reset", Trigger)().success)
            self.assertEqual(latched("/left/true_backlash", Float64).data, 0)

    def test_a_joint_may_have_a_rig_of_its_own_at_the_common_rate(self):
        folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, folder)
        rig = default_rig()
        rig["gear_train"]["motor"]["inertia"] *= 2
        path = write_rig(folder, rig)
        a, b = (recorded({"joints": ["a", "b"], "b": own}, 300) for own in ({"rig": path}, {}))
        self.assertEqual(motion(a, "a"), motion(b, "a"))
        self.assertNotEqual(motion(a, "b"), motion(b, "b"))
        rig["sensors"]["sampling_rate"] = 500.0
        write_rig(folder, rig)
        self.assert_refused({"joints": ["a", "b"], "b": {"rig": path}}, "~b/rig", "500", "~sampling_rate")

    def assert_refused(self, parameters, *shown):
        with Simulator(parameters) as simulator:
            code, output = simulator.wait()
        self.assertEqual(code, 64, output)
        for text in shown:
            self.assertIn(text, output)

    def test_what_cannot_be_is_refused(self):
        self.assert_refused({"joints": ["a", "a"]}, "~joints", "twice")
        self.assert_refused({"joints": ["a"], "joint": "b"}, "~joint", "~joints")
        self.assert_refused({"joints": ["a b"]}, "~joints", "a b")
        self.assert_refused({"joints": []}, "~joints", "list of names")
        self.assert_refused({"joints": ["a"], "a": {"backlash": -1.0}}, "~a/backlash", "-1")
        self.assert_refused({"joints": ["a"], "a": {"backlash": 1e-4, "half_gap": 1e-4}}, "~a/half_gap", "~a/backlash")
        self.assert_refused({"joints": ["a"], "a": {"sampling_rate": 10.0}}, "~a/sampling_rate")
        self.assert_refused({"joints": ["a"], "b": {"backlash": 1e-4}}, "~b/backlash")


if __name__ == "__main__":
    rospy.init_node("simulator_joints_test")
    rostest.rosrun("backlash_diagnosis", "simulator_joints_test", SimulatorJointsTest)
