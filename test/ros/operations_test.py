#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a robot that runs for months needs: statuses per concern, histories, live parameters, the aggregator."""
import copy
import csv
import os
import shutil
import tempfile
import unittest

import rospy
import rostest
from diagnoser_support import (START, Connected, Diagnoser, Diagnostics, build_curve, level, run_tool, send,
                               simulated_messages)
from diagnostic_msgs.msg import DiagnosticArray
from dynamic_reconfigure.client import Client
from sensor_msgs.msg import JointState
from simulator_support import TIMEOUT, Inbox, Simulator
from std_msgs.msg import Float64

OK, WARN, ERROR = 0, 1, 2
HALF_GAP = 4e-5  # m
CONCERNS = ("backlash", "input", "excitation", "signal quality", "curve domain")


class OperationsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.curve = build_curve(cls.folder)
        cls.run_of_samples = simulated_messages(cls.folder, HALF_GAP)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def setUp(self):
        self.history = tempfile.mkdtemp(dir=self.folder)
        self.topic = "/states_of_" + self.id().rpartition(".")[2]
        self.diagnostics = Diagnostics()

    def start(self, **parameters):
        """A diagnoser that listens, and its publisher."""
        connected = Connected()
        self.publisher = rospy.Publisher(self.topic, JointState, connected, queue_size=10000)
        diagnoser = Diagnoser({"curve": self.curve, **parameters}, self.topic).ready()
        self.addCleanup(diagnoser.__exit__)
        self.assertTrue(connected.wait(TIMEOUT), "the diagnoser does not subscribe")
        return diagnoser

    def send_run(self, offset=0.0, change=lambda message: message):
        for time, message in zip(*self.run_of_samples):
            send(self.publisher, change(copy.deepcopy(message)), offset + time)

    def entries(self):
        with open(os.path.join(self.history, "joint.csv"), newline="") as stream:
            return list(csv.DictReader(stream))

    def wait_for_entries(self, diagnoser, count):
        self.diagnostics.wait_for(
            diagnoser.name[1:] + ": joint: backlash", lambda l, m, v: int(v.get("History entries written", 0)) >= count,
            "%d entries written" % count)

    def test_every_concern_has_a_status_and_says_what_is_wrong(self):
        diagnoser = self.start(hold=0.2)
        self.send_run()
        self.assertTrue(diagnoser.diagnose(periods=10, timeout=TIMEOUT).success)
        for concern in CONCERNS:
            self.diagnostics.wait_for("%s: joint: %s" % (diagnoser.name[1:], concern),
                                      lambda l, m, v: level(l) in (OK, WARN), "a level")

        def louder(message):
            message.effort = [1.3 * e for e in message.effort]
            return message

        # Another run far away: the excitation is not what the curve was made with.
        self.send_run(100, louder)
        status, _ = self.diagnostics.wait_for(diagnoser.name[1:] + ": joint: excitation",
                                              lambda l, m, v: level(l) == WARN, "WARN")
        self.assertIn("excitation level", status.message)
        self.diagnostics.wait_for(diagnoser.name[1:] + ": joint: curve domain", lambda l, m, v: level(l) == OK, "OK")

        def broken(message):
            message.effort[1] = float("nan")
            return message

        self.send_run(200)
        send(self.publisher, broken(copy.deepcopy(self.run_of_samples[1][0])), 201.2)
        self.diagnostics.wait_for(diagnoser.name[1:] + ": joint: signal quality",
                                  lambda l, m, v: level(l) == WARN and "NaN" in m, "WARN of NaN")
        self.send_run(300)
        for concern in ("excitation", "signal quality"):
            self.diagnostics.wait_for("%s: joint: %s" % (diagnoser.name[1:], concern),
                                      lambda l, m, v: level(l) == OK, "OK again")

    def test_history_survives_a_kill_and_goes_on(self):
        parameters = {"history": self.history, "history_interval": 0.1, "estimate_interval": 0.0}
        first = self.start(**parameters)
        self.send_run()
        self.wait_for_entries(first, 3)
        first.kill()
        kept = self.entries()
        self.assertGreaterEqual(len(kept), 3)
        with open(os.path.join(self.history, "joint.csv"), "a") as stream:
            stream.write("1000000001.5,cut off by the po")  # as a power cut leaves a line
        second = self.start(**parameters)
        self.assertIn("joint.csv:%d: " % (len(kept) + 2), second.output())
        self.send_run(10)
        self.wait_for_entries(second, 3)
        self.diagnostics.wait_for(second.name[1:] + ": joint: backlash", lambda l, m, v: "no trend" in v.get("Trend", ""),
                                  "a trend that knows too little")
        second.__exit__()
        lines = self.entries()
        self.assertEqual(lines[:len(kept)], kept)
        fresh = [line for line in lines[len(kept):] if line["rig_digest"]]
        self.assertGreaterEqual(len(fresh), 3)
        times = [float(line["time"]) for line in kept + fresh]
        self.assertEqual(sorted(set(times)), times)
        self.assertTrue(all(START < t < START + 12 for t in times), times)
        for line in fresh[-3:]:
            self.assertLess(float(line["lower"]), 2 * HALF_GAP)
            self.assertGreater(float(line["upper"]), 2 * HALF_GAP)
        done = run_tool("backlash_trend", os.path.join(self.history, "joint.csv"), codes=(3,))
        self.assertIn("no trend", done.stdout + done.stderr)

    def test_history_of_a_looped_bag_has_no_entry_twice(self):
        diagnoser = self.start(history=self.history, history_interval=0.1, estimate_interval=0.0, hold=0.2)
        self.send_run(10)
        self.wait_for_entries(diagnoser, 3)
        self.send_run(0)
        self.send_run(10)
        _, values = self.diagnostics.wait_for(
            diagnoser.name[1:] + ": joint: backlash", lambda l, m, v: int(v.get("History entries left out", 0)) > 3,
            "entries left out")
        self.diagnostics.wait_for(diagnoser.name[1:] + ": joint: backlash",
                                  lambda l, m, v: level(l) == WARN and "older than" in m, "WARN of the history")
        self.assertEqual(values["History entries lost"], "0")
        # Its stamps are beyond the last entry again: what was left out is past.
        self.send_run(20)
        self.diagnostics.wait_for(
            diagnoser.name[1:] + ": joint: backlash",
            lambda l, m, v: level(l) == OK and int(v.get("History entries left out", 0)) > 3, "OK again")
        times = [float(line["time"]) for line in self.entries()]
        self.assertEqual(sorted(set(times)), times)

    def test_histories_that_cannot_be_kept_are_refused(self):
        with Diagnoser({"history": os.path.join(self.history, "none")}) as diagnoser:
            code, output = diagnoser.wait()
        self.assertEqual(code, 64, output)
        self.assertIn("~history", output)
        with open(os.path.join(self.history, "joint.csv"), "w") as stream:
            stream.write("time,motor_torque\n0,1\n")
        with Diagnoser({"history": self.history}) as diagnoser:
            code, output = diagnoser.wait()
        self.assertEqual(code, 65, output)
        self.assertIn("joint.csv", output)
        with open(os.path.join(self.history, "joint.csv")) as stream:
            self.assertEqual(stream.read(), "time,motor_torque\n0,1\n")

    def test_live_parameters_of_the_diagnoser(self):
        diagnoser = self.start()
        self.send_run()
        self.assertEqual(diagnoser.diagnose(periods=10, timeout=TIMEOUT).verdict.grade, "good")
        limits = Client(diagnoser.topic("joint/live"), timeout=TIMEOUT)
        before = limits.get_configuration(TIMEOUT)
        answer = limits.update_configuration({"watch": 5e-5, "service": 2e-5})
        self.assertIn("service = 2e-05: must be > watch", answer["refused"])
        self.assertEqual((answer["watch"], answer["service"]), (before["watch"], before["service"]))
        answer = limits.update_configuration({"watch": 1e-5, "service": 2e-5, "stop": 5e-4})
        self.assertEqual(answer["refused"], "")
        self.assertEqual(diagnoser.diagnose(periods=10, timeout=TIMEOUT).verdict.grade, "service")
        common = Client(diagnoser.topic("live"), timeout=TIMEOUT)
        answer = common.update_configuration({"window": -3})
        self.assertEqual((answer["window"], answer["refused"]), (5, "window = -3: must be >= 1"))
        self.assertEqual(common.update_configuration({"window": 2, "stale": 0.5})["window"], 2)
        self.diagnostics.wait_for(diagnoser.name[1:] + ": joint: input", lambda l, m, v: level(l) == 3, "STALE")
        # What was set live is no configuration: the next diagnoser of this name starts as its parameters say.
        self.assertEqual(rospy.get_param(diagnoser.topic("live/window")), 2)
        self.assertFalse(rospy.has_param(diagnoser.topic("window")))

    def test_live_parameters_of_the_simulator(self):
        with Simulator({"half_gap": 1e-5}) as simulator:
            truth = Inbox(simulator.topic("true_backlash"), Float64)
            states = Inbox(simulator.topic("joint_states"), JointState)
            self.assertEqual(truth.wait_for_count(1)[0].data, 2e-5)
            live = Client(simulator.topic("live"), timeout=TIMEOUT)
            answer = live.update_configuration({"backlash": -1e-5})
            self.assertIn("backlash = -1e-05: must be finite and >= 0", answer["refused"])
            self.assertEqual(answer["backlash"], 2e-5)
            answer = live.update_configuration({"backlash": 9e-5, "noise_motor_position": 0.25})
            self.assertEqual((answer["backlash"], answer["refused"]), (9e-5, ""))
            self.assertEqual(truth.wait_for_count(2)[1].data, 9e-5)
            # The motor itself moves by milliradians; one of 22 samples is beyond 2 standard deviations.
            states.wait_for(lambda messages: any(abs(m.position[0]) > 0.5 for m in messages[-2000:]), "noise")

    def test_the_aggregator_groups_concerns(self):
        diagnoser = self.start()
        self.send_run()
        aggregated = Inbox("/diagnostics_agg", DiagnosticArray)
        wanted = {"/Backlash/%s/%s" % (group, diagnoser.name[1:] + ": joint: " + concern)
                  for group, concern in (("Verdict", "backlash"), ("Input", "input"), ("Excitation", "excitation"),
                                         ("Signal quality", "signal quality"), ("Curve domain", "curve domain"))}
        shown = [name.replace(":", "") for name in wanted]  # the aggregator writes no colons

        def complete(messages):
            names = {s.name.replace(":", "") for m in messages for s in m.status}
            return all(name in names for name in shown)
        aggregated.wait_for(complete, "all of %s" % shown)


if __name__ == "__main__":
    rospy.init_node("operations_test")
    rostest.rosrun("backlash_diagnosis", "operations_test", OperationsTest)
