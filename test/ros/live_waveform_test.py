#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""A diagnoser whose rig file is not the machine's: `waveform`, fitted in the background, knows the play all the same."""
import shutil
import tempfile
import unittest

import rospy
import rostest
from backlash_diagnosis.srv import SetBacklash
from diagnoser_support import Diagnoser, Diagnostics, build_curve, level
from sensor_msgs.msg import JointState
from simulator_support import TIMEOUT, Inbox, Simulator, default_rig, nanoseconds, steps, write_rig

RATE = 2000  # Hz
BACKLASH, OTHER = 8e-5, 4e-5  # m
CHANGED = {"motor": {"viscous_damping": 0.5, "inertia": 1.15}, "pinion": {"inertia": 0.9},
           "input_coupling": {"stiffness": 1.12}}  # of the simulated machine, times what the diagnoser's rig file says


def machine():
    rig = default_rig()
    for part, factors in CHANGED.items():
        for key, factor in factors.items():
            rig["gear_train"][part][key] *= factor
    rig["sensors"].update(sampling_rate=RATE, sensor_torque={"noise": 0.002}, motor_position={"noise": 2e-6})
    return rig


class LiveWaveformTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.curve = build_curve(cls.folder, RATE)
        cls.simulator = Simulator({"rig": write_rig(cls.folder, machine()), "backlash": BACKLASH})
        cls.states = Inbox(cls.simulator.topic("joint_states"), JointState)
        cls.diagnoser = Diagnoser({"curve": cls.curve}, cls.simulator.topic("joint_states")).ready()
        cls.distributions = cls.diagnoser.distributions()
        cls.estimates = cls.diagnoser.estimates()

    @classmethod
    def tearDownClass(cls):
        cls.diagnoser.__exit__()
        cls.simulator.__exit__()
        shutil.rmtree(cls.folder)

    def fitted(self, later_than=0):
        """The first sound estimate by waveform of samples beyond a stamp [ns]."""
        return self.estimates.wait_for(lambda messages: next(
            (m for m in messages if m.method == "waveform" and m.status_name == "ok" and nanoseconds(m) > later_than),
            None), "estimate by waveform")

    def test_1_the_verdict_stands_on_it_and_holds(self):
        estimate = self.fitted()
        self.assertTrue(estimate.lower <= BACKLASH <= estimate.upper, estimate)
        answer = self.diagnoser.diagnose(periods=5, timeout=TIMEOUT)
        self.assertEqual(list(answer.verdict.members), ["waveform"], answer.message)
        self.assertTrue(answer.verdict.lower <= BACKLASH <= answer.verdict.upper, answer.message)
        self.assertLess(answer.verdict.upper - answer.verdict.lower, 3e-6)  # by the other methods some 30 um
        self.assertRegex(answer.message, r"waveform is of samples that ended \d+\.\d s before")

    def test_2_an_old_answer_has_the_stamp_of_its_samples(self):
        first = nanoseconds(self.fitted())
        later = nanoseconds(self.fitted(later_than=first))
        fitted = [m for m in self.estimates.messages
                if m.method == "waveform" and m.status_name == "ok" and nanoseconds(m) in (first, later)]
        self.assertGreater(later - first, 0)
        self.assertGreater(len(fitted), 2)  # reported again beside the running estimates of the others
        for message in fitted:
            self.assertRegex(message.message, r"of samples that ended \d+\.\d s before")

    def test_3_no_sample_is_lost_to_a_fit(self):
        first = self.fitted()
        self.fitted(later_than=nanoseconds(first))
        self.assertEqual(set(steps(self.distributions.messages)), {100_000_000})
        diagnostics = Diagnostics()
        sent = len(self.states.messages)
        _, values = diagnostics.wait_for("joint: input", lambda l, m, v: "Samples accepted" in v, "input")
        for count in ("Clock jumps", "Repeated stamps", "Samples with NaN", "Malformed messages"):
            self.assertEqual(values[count], "0", values)
        for message in self.distributions.messages:
            self.assertEqual(message.samples, RATE // 10)
        self.assertGreater(sent, 2 * RATE)

    def test_4_what_in_the_file_is_wrong_is_reported(self):
        self.fitted()
        warn = 1
        status, _ = Diagnostics().wait_for("joint: curve domain", lambda l, m, v: "run identify" in m, "a wrong value")
        self.assertEqual(level(status.level), warn)
        for value in (r"declared motor damping 0.0048 N m s/rad, this record says 0.002[34]\d* \+- ",
                      r"declared sensor stiffness 28.7 N m/rad, this record says 32(\.\d+)? \+- "):
            self.assertRegex(status.message, value)
            self.assertRegex(self.diagnoser.diagnose(periods=5).message, value)

    def test_5_a_changed_machine_makes_the_answer_worthless_at_once(self):
        self.fitted()
        service = self.simulator.topic("set_backlash")
        rospy.wait_for_service(service, TIMEOUT)
        self.assertTrue(rospy.ServiceProxy(service, SetBacklash)(OTHER).success)
        stamp = nanoseconds(self.states.messages[-1])
        self.distributions.since(stamp, 1, later_than=stamp + 8 * 100_000_000)
        answer = self.diagnoser.diagnose(periods=5, timeout=TIMEOUT)
        waveform = next(e for e in answer.estimates if e.method == "waveform")
        if nanoseconds(waveform) < stamp:
            self.fail("an answer of before the change counts: %s" % answer.message)
        estimate = self.fitted(later_than=stamp + 8 * 100_000_000)
        self.assertTrue(estimate.lower <= OTHER <= estimate.upper, estimate)


if __name__ == "__main__":
    rospy.init_node("live_waveform_test")
    rostest.rosrun("backlash_diagnosis", "live_waveform_test", LiveWaveformTest)
