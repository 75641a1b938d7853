#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The simulator node with a /clock from elsewhere, here the test: it simulates that far and no further."""
import unittest

import rospy
import rostest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from simulator_support import Inbox, nanoseconds, steps

MILLISECOND = 1000000  # ns
START = 100000  # ms


class SimulatorFollowTest(unittest.TestCase):
    def test_samples_stop_where_the_clock_stands(self):
        clock = rospy.Publisher("/clock", Clock, latch=True, queue_size=10)

        def tick(milliseconds):
            clock.publish(rospy.Time(milliseconds // 1000, milliseconds % 1000 * MILLISECOND))

        tick(START)
        joint_states = Inbox("joint_states", JointState)
        joint_states.wait_for_count(1)
        # 570 ms: 0.57 * 1000 rounds to less than 570. Then the clock goes back, as when a bag starts again:
        # no stamp may follow it. At last a jump ahead: no sample may be left out.
        for milliseconds, stand in ((570, 570), (100, 570), (2000, 2000)):
            tick(START + milliseconds)
            stamp = (START + stand) * MILLISECOND
            joint_states.wait_for(lambda m: nanoseconds(m[-1]) >= stamp, "sample at %d ms" % stand)
            self.assertEqual(len(joint_states.messages), stand + 1)
        self.assertEqual(nanoseconds(joint_states.messages[0]), START * MILLISECOND)
        self.assertEqual(set(steps(joint_states.messages)), {MILLISECOND})


if __name__ == "__main__":
    rospy.init_node("simulator_follow_test")
    rostest.rosrun("backlash_diagnosis", "simulator_follow_test", SimulatorFollowTest)
