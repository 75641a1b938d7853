#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""three_joints.launch: one diagnoser distinguishes three joints that one simulator moves."""
import unittest

import rospy
import rostest
from backlash_diagnosis.srv import Diagnose
from simulator_support import TIMEOUT, latched
from std_msgs.msg import Float64

# Published goal for estimates from motor position; the simulated encoder is exact, so this has a wide margin.
POSITION_TOLERANCE = 3e-6  # m


class ThreeJointsTest(unittest.TestCase):
    def test_each_joint_has_its_own_backlash(self):
        rospy.wait_for_service("/diagnoser/diagnose", TIMEOUT)
        diagnose = rospy.ServiceProxy("/diagnoser/diagnose", Diagnose)
        for joint, backlash in (("base", 2e-5), ("shoulder", 8e-5), ("elbow", 1.4e-4)):
            self.assertEqual(latched("/%s/true_backlash" % joint, Float64).data, backlash)
            answer = diagnose(joint, 10, TIMEOUT)
            self.assertTrue(answer.success, answer.message)
            found = {e.method: e for e in answer.estimates}["lost_motion"]
            self.assertEqual((found.joint, found.status_name), (joint, "ok"), found.message)
            self.assertAlmostEqual(found.backlash, backlash, delta=POSITION_TOLERANCE)
            self.assertTrue(answer.verdict.lower <= backlash <= answer.verdict.upper, answer.message)

    def test_a_joint_must_be_named(self):
        rospy.wait_for_service("/diagnoser/diagnose", TIMEOUT)
        answer = rospy.ServiceProxy("/diagnoser/diagnose", Diagnose)("", 1, 0)
        self.assertFalse(answer.success)
        self.assertIn("base, shoulder, elbow", answer.message)


if __name__ == "__main__":
    rospy.init_node("three_joints_test")
    rostest.rosrun("backlash_diagnosis", "three_joints_test", ThreeJointsTest)
