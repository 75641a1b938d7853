#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The simulator node with its built-in rig: topics, stamps, services, diagnostics."""
import math
import unittest

import rospy
import rostest
import yaml
from backlash_diagnosis.srv import SetBacklash
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState
from simulator_support import Inbox, TIMEOUT, default_rig, latched, nanoseconds, steps
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger

INTERVAL = 1000000  # ns, the built-in rig samples at 1 kHz
MOTOR, SENSOR, LOAD = 0, 1, 2


def travel_between_walls(messages):
    """Distance of the motor positions at which it rests before the torque changes its sign [rad]."""
    ends = [(a.effort[MOTOR], a.position[MOTOR]) for a, b in zip(messages, messages[1:])
            if a.effort[MOTOR] * b.effort[MOTOR] < 0]
    upper = [position for effort, position in ends if effort > 0]
    lower = [position for effort, position in ends if effort < 0]
    return upper[-1] - lower[-1]


def rests(messages):
    """Where the rig starts: nothing else is exactly 0."""
    return [i for i, m in enumerate(messages) if m.position[MOTOR] == 0 and m.velocity[MOTOR] == 0]


class SimulatorTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.wait_for_service("/simulator/reset", TIMEOUT)
        cls.set_backlash = staticmethod(rospy.ServiceProxy("/simulator/set_backlash", SetBacklash))
        cls.reset = staticmethod(rospy.ServiceProxy("/simulator/reset", Trigger))
        cls.joint_states = Inbox("joint_states", JointState)

    def setUp(self):
        self.assertTrue(self.reset().success)

    def next_samples(self, count):
        """Samples of after this call: at real time no stamp is ahead of ROS time."""
        return self.joint_states.since(rospy.Time.now().to_nsec(), count)

    def samples_around_reset(self, count):
        """What is published from before a reset until `count` samples after it."""
        before = nanoseconds(self.next_samples(1)[0])
        self.assertTrue(self.reset().success)
        return self.joint_states.since(before, count, rospy.Time.now().to_nsec())

    def test_joint_states_name_the_joints_and_fill_the_arrays(self):
        for message in self.next_samples(10):
            self.assertEqual(message.name, ["joint_motor", "joint_sensor", "joint_load"])
            self.assertEqual((len(message.position), len(message.velocity), len(message.effort)), (3, 3, 3))
            self.assertTrue(all(map(math.isfinite, message.position + message.velocity + message.effort)))
            self.assertIn(message.effort[MOTOR], (0.05, -0.05))  # N m, the square wave of the rig file
            self.assertEqual((message.position[LOAD], message.velocity[LOAD]), (0, 0))  # locked

    def test_stamps_are_one_sampling_interval_apart_to_the_nanosecond(self):
        self.assertEqual(set(steps(self.next_samples(1001))), {INTERVAL})

    def test_rig_description_is_latched_and_is_the_rig_file(self):
        text = latched("rig_description", String).data
        first = text.splitlines()[0]
        self.assertTrue(first.startswith("# source: built-in sarkar_1997"), first)
        self.assertIn("excitation_frequency = 2", first)
        self.assertEqual(yaml.safe_load(text), default_rig())

    def test_set_backlash_widens_the_travel_by_the_backlash_over_the_base_radius(self):
        settled, needed = 500, 1600  # samples; the period is 500
        before = travel_between_walls(self.next_samples(needed)[settled:])
        backlash = 1e-4  # m
        self.assertTrue(self.set_backlash(backlash).success)
        self.assertEqual(latched("true_backlash", Float64).data, backlash)
        after = travel_between_walls(self.next_samples(needed)[settled:])
        base_radius = default_rig()["gear_train"]["mesh"]["base_radius"]
        # At rest at a wall all springs carry the same torque with and without play: travel grows by the play
        # alone. 1e-4 of it covers what is left of the motion after 250 ms. The motor's damper takes that down
        # with a time constant of 2 J / c = 27 ms (J = 2.24e-5 + 4.2e-5 kg m^2), that is by exp(-9) = 1e-4.
        self.assertAlmostEqual((after - before) * base_radius / backlash, 1, delta=1e-4)

    def test_reset_starts_again_at_rest_while_the_stamps_go_on(self):
        self.assertTrue(self.set_backlash(5e-5).success)
        samples = self.samples_around_reset(50)
        self.assertEqual(latched("true_backlash", Float64).data, 0)  # of the rig file
        self.assertEqual(set(steps(samples)), {INTERVAL})
        self.assertEqual(len(rests(samples)), 1)

    def test_two_resets_give_the_same_motion(self):
        def motion():
            samples = self.samples_around_reset(300)
            start = rests(samples)[-1]
            return [(m.position, m.velocity, m.effort) for m in samples[start:start + 300]]
        self.assertEqual(motion(), motion())

    def test_impossible_backlash_is_refused_with_a_reason(self):
        self.assertTrue(self.set_backlash(2e-5).success)
        for value, shown in ((-1e-6, "-1e-06"), (math.nan, "nan"), (math.inf, "inf")):
            answer = self.set_backlash(value)
            self.assertFalse(answer.success, value)
            self.assertIn(shown, answer.message)
            self.assertIn("must be", answer.message)
        self.assertEqual(latched("true_backlash", Float64).data, 2e-5)

    def test_diagnostics_report_lag_and_integrator_steps(self):
        def status(messages):
            found = [s for m in messages for s in m.status if s.name == "simulator: simulation"]
            return found[-1] if found else None
        status = Inbox("/diagnostics", DiagnosticArray).wait_for(status, "status of the simulator")
        self.assertEqual(status.hardware_id, "sarkar_1997")
        values = {v.key: float(v.value) for v in status.values}
        self.assertGreaterEqual(values["lag [s]"], 0)
        self.assertGreater(values["samples published"], 0)
        self.assertGreater(values["integrator steps"], 0)
        self.assertEqual(values["real time factor demanded"], 1)


if __name__ == "__main__":
    rospy.init_node("simulator_test")
    rostest.rosrun("backlash_diagnosis", "simulator_test", SimulatorTest)
