#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Bad input: the diagnoser stays alive, counts what it left out, and answers from what was good."""
import copy
import shutil
import tempfile
import unittest

import rospy
import rostest
from diagnoser_support import START, Connected, Diagnoser, Diagnostics, build_curve, level, send, simulated_messages
from sensor_msgs.msg import JointState
from simulator_support import TIMEOUT

HALF_GAP = 4e-5  # m
NAN, INF = float("nan"), float("inf")


class DiagnoserInputTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.curve = build_curve(cls.folder)
        cls.times, cls.messages = simulated_messages(cls.folder, HALF_GAP)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def setUp(self):
        self.topic = "/states_of_" + self.id().rpartition(".")[2]
        connected = Connected()
        self.publisher = rospy.Publisher(self.topic, JointState, connected, queue_size=10000)
        self.diagnoser = Diagnoser({"curve": self.curve}, self.topic).ready()
        self.addCleanup(self.diagnoser.__exit__)
        self.diagnostics = Diagnostics()
        self.assertTrue(connected.wait(TIMEOUT), "the diagnoser does not subscribe")

    def send(self, message, time):
        send(self.publisher, message, time)

    def send_run(self, offset=0.0, until=1.2):
        for time, message in zip(self.times, self.messages):
            if time < until:
                self.send(message, offset + time)

    def assert_right_answer(self, periods=10):
        answer = self.diagnoser.diagnose(periods=periods, timeout=TIMEOUT)
        self.assertTrue(answer.success, answer.message)
        best = answer.estimates[answer.verdict.estimate]
        self.assertAlmostEqual(best.backlash, 2 * HALF_GAP, delta=3e-6)  # goal for estimates from motor position

    def wait_for_count(self, key, count):
        status, values = self.diagnostics.wait_for(
            "joint: input", lambda l, m, v: int(v.get(key, 0)) >= count, "%s >= %d" % (key, count))
        self.assertEqual(int(values[key]), count)
        return values

    def test_bad_values_are_left_out(self):
        for i, (time, good) in enumerate(zip(self.times, self.messages)):
            self.send(good, time)
            if i % 100 == 50:
                for place, bad in (("effort", NAN), ("effort", INF), ("position", NAN)):
                    message = copy.deepcopy(good)
                    getattr(message, place)[0 if place == "position" else 1] = bad
                    self.send(message, time + 0.0005)
        self.assert_right_answer()
        values = self.wait_for_count("Malformed messages", 12)
        self.assertEqual(int(values["Samples with NaN"]), 24)
        self.assertEqual(int(values["Samples accepted"]), 1200)

    def test_wrong_sizes_and_names_are_left_out(self):
        for i, (time, good) in enumerate(zip(self.times, self.messages)):
            self.send(good, time)
            if i % 200 == 100:
                short, twice, other = copy.deepcopy(good), copy.deepcopy(good), copy.deepcopy(good)
                short.effort = [1.0]
                twice.name = ["joint_motor", "joint_motor"]
                other.name = ["elbow_motor", "elbow_sensor"]  # another joint on the same topic: none of our business
                self.send(short, time + 0.0005)
                self.send(twice, time + 0.0005)
                self.send(other, time + 0.0005)
        self.assert_right_answer()
        values = self.wait_for_count("Malformed messages", 12)
        self.assertIn("appears twice", values["Last problem"])

    def test_zero_stamps_are_left_out(self):
        self.send_run()
        self.publisher.publish(self.messages[0])
        self.assert_right_answer()
        self.wait_for_count("Malformed messages", 1)

    def test_repeated_stamps_lose_the_later_sample(self):
        for time, message in zip(self.times, self.messages):
            self.send(message, time)
            self.send(self.messages[0], time)
        self.assert_right_answer()
        self.wait_for_count("Repeated stamps", 1200)

    def test_clock_that_goes_back_starts_a_new_run(self):
        self.send_run(offset=500.0)
        self.assert_right_answer()
        self.send_run(offset=0.0)
        self.wait_for_count("Clock jumps", 1)
        self.assert_right_answer()

    def test_clock_that_jumps_ahead_starts_a_new_run(self):
        self.send_run(offset=0.0)
        self.send_run(offset=7200.0)
        self.wait_for_count("Clock jumps", 1)
        self.assert_right_answer()

    def test_gap_costs_only_the_periods_it_lies_in(self):
        for time, message in zip(self.times, self.messages):
            if not 0.52 < time < 0.58:
                self.send(message, time)
        answer = self.diagnoser.diagnose(periods=10, timeout=TIMEOUT)
        self.assertEqual(answer.distribution.periods, 9)
        self.assertAlmostEqual(answer.estimates[1].backlash, 2 * HALF_GAP, delta=3e-6)

    def test_publisher_that_vanishes_is_said(self):
        self.send_run(until=0.55)
        self.assertTrue(self.diagnoser.diagnose(periods=3, timeout=TIMEOUT).success)
        self.publisher.unregister()
        stale = 3
        self.diagnostics.wait_for("joint: input", lambda l, m, v: level(l) == stale, "STALE")
        answer = self.diagnoser.diagnose(periods=100, timeout=0.1)
        self.assertFalse(answer.success)
        self.assertIn("only 3 of 100 whole periods", answer.message)
        self.assertTrue(self.diagnoser.alive())

    def test_nothing_received_is_said(self):
        answer = self.diagnoser.diagnose(periods=1, timeout=0.1)
        self.assertFalse(answer.success)
        self.assertIn("has named joint yet", answer.message)
        self.assertEqual(answer.verdict.grade, "cannot_tell")

    def test_other_excitation_is_out_of_domain_for_the_curve(self):
        for time, message in zip(self.times, self.messages):
            louder = copy.deepcopy(message)
            louder.effort = [1.3 * e for e in message.effort]
            self.send(louder, time)
        answer = self.diagnoser.diagnose(periods=10, timeout=TIMEOUT)
        self.assertEqual(answer.estimates[0].method, "apd_skewness")
        self.assertEqual(answer.estimates[0].status_name, "out_of_domain")
        self.assertIn("excitation", answer.estimates[0].message)


if __name__ == "__main__":
    rospy.init_node("diagnoser_input_test")
    rostest.rosrun("backlash_diagnosis", "diagnoser_input_test", DiagnoserInputTest)
