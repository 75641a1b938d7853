#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""simulated_robot.launch: a robot that picks and places is watched from its own topics while one of its joints wears."""
import time
import unittest

import rospy
import rostest
from backlash_diagnosis.srv import Diagnose, SetBacklash
from sensor_msgs.msg import JointState
from simulator_support import TIMEOUT

# Widest interval that still says something. Of the motor side alone, gap_traverse is never surer than 20 % either way.
WIDEST = {"shoulder": 0.3, "elbow": 0.5}
NEW, WORN = 5.4e-4, 1.3e-3  # rad: that of the rig files; between their limits `service` and `stop`


def service(name, kind):
    rospy.wait_for_service(name, TIMEOUT)
    return rospy.ServiceProxy(name, kind)


class SimulatedRobotTest(unittest.TestCase):
    def until(self, joint, holds):
        """Asks for a diagnosis again and again until it is as it should be; all answers."""
        diagnose, answers = service("/diagnoser/diagnose", Diagnose), []
        end = time.monotonic() + TIMEOUT
        while time.monotonic() < end:
            answers.append(diagnose(joint, 0, 0))
            if answers[-1].success and holds(answers[-1].verdict):
                return answers
            time.sleep(0.2)
        self.fail("%s: %s" % (joint, "\n".join(a.message for a in answers[-20:])))

    @staticmethod
    def holds(joint, backlash, grade):
        # The verdict's own interval holds the truth.
        return lambda v: (v.grade == grade and v.angle_lower <= backlash <= v.angle_upper
                          and v.angle_upper - v.angle_lower < WIDEST[joint] * backlash)

    def test_1_topics_are_those_of_the_robot(self):
        states = rospy.wait_for_message("/joint_states", JointState, TIMEOUT)
        self.assertEqual((sorted(states.name), states.velocity), (["elbow_joint", "shoulder_joint", "wrist_joint"], ()))
        self.assertEqual(rospy.wait_for_message("/link_states", JointState, TIMEOUT).name, ["shoulder_link"])

    def test_2_ordinary_motion_shows_both_joints(self):
        for joint, method in (("shoulder", "position_difference"), ("elbow", "gap_traverse")):
            holds = self.holds(joint, NEW, "good")
            self.until(joint, lambda v, holds=holds, method=method: holds(v) and method in v.members)

    def test_3_a_joint_that_wears_is_reported_and_the_other_not_accused(self):
        service("/simulator/shoulder/set_backlash", SetBacklash)(WORN)
        answers = self.until("shoulder", self.holds("shoulder", WORN, "service"))
        for a in answers:
            rospy.loginfo(a.message)
        # As long as old motion is in the record, or the motion is short, the answer may lie between, never outside.
        for answer in (a for a in answers if a.success):
            self.assertLessEqual(answer.verdict.angle_lower, WORN, answer.message)
            self.assertGreaterEqual(answer.verdict.angle_upper, NEW, answer.message)
        self.until("elbow", self.holds("elbow", NEW, "good"))


if __name__ == "__main__":
    rospy.init_node("simulated_robot_test")
    rostest.rosrun("backlash_diagnosis", "simulated_robot_test", SimulatedRobotTest)
