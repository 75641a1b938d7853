#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The simulator node at five times real time: it provides /clock and the other nodes follow it."""
import unittest

import rospy
import rostest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from simulator_support import Inbox, nanoseconds, steps


class SimulatorClockTest(unittest.TestCase):
    def test_clock_and_joint_states_have_the_same_time(self):
        clock, joint_states = Inbox("/clock", Clock), Inbox("joint_states", JointState)
        samples = joint_states.wait_for_count(2001)[:2001]
        self.assertEqual(set(steps(samples)), {1000000})  # ns
        last = nanoseconds(samples[-1])
        ticks = clock.wait_for(lambda m: list(m) if m and m[-1].clock.to_nsec() >= last else None, "clock")
        times = [m.clock.to_nsec() for m in ticks]
        # Every 5 ms simulated, that is every millisecond of wall time. A slow subscriber may miss some, but
        # each one is the stamp of a sample. The latched tick that a new subscriber gets may be followed by itself.
        for earlier, later in zip(times, times[1:]):
            self.assertGreaterEqual(later, earlier)
            self.assertEqual((later - earlier) % 5000000, 0)
        self.assertGreater(times[-1], times[0])
        self.assertEqual((last - times[-1]) % 1000000, 0)

    def test_ros_time_follows_the_simulation(self):
        self.assertTrue(rospy.get_param("/use_sim_time"))
        joint_states = Inbox("joint_states", JointState)
        stamp = nanoseconds(joint_states.wait_for_count(1)[0])
        later = stamp + 1000000000  # ns
        joint_states.wait_for(lambda m: nanoseconds(m[-1]) > later, "sample one simulated second later")
        # A sample is at most one tick (5 ms) ahead of /clock, which travels on a connection of its own.
        joint_states.wait_for(lambda m: rospy.get_rostime().to_nsec() >= later - 5000000, "ROS time")


if __name__ == "__main__":
    rospy.init_node("simulator_clock_test")
    rostest.rosrun("backlash_diagnosis", "simulator_clock_test", SimulatorClockTest)
