#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The action TraceResidual of the diagnoser, and the simulator with the rig that it leaves."""
import json
import os
import re
import shutil
import signal
import tempfile
import threading
import time
import unittest

import actionlib
import rospy
import rostest
from backlash_diagnosis.msg import TraceResidualAction, TraceResidualGoal
from diagnoser_support import Diagnoser, build_curve, result_of, rig_path, run_tool
from sensor_msgs.msg import JointState
from simulator_support import TIMEOUT, Inbox, Simulator, nanoseconds

MISSING = "\nterms:\n  - id: asymmetric_viscous\n    body: motor\n    damping: 30\n"
SHAKING = ("excitation:\n  type: random\n  rms: 40\n  lower_frequency: 0.15\n  upper_frequency: 3\n"
           "  lines: 60\n  seed: %d\n")


class TraceResidualTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.rig = os.path.join(cls.folder, "emps.yaml")
        shutil.copy(rig_path("emps"), cls.rig)
        with open(cls.rig) as stream:
            declared = stream.read()
        for seed, name in ((1, "train"), (2, "test")):
            machine = cls.path("machine.yaml")
            with open(machine, "w") as stream:
                stream.write(re.sub(r"excitation:\n(  .*\n)+", SHAKING % seed, declared) + MISSING)
            run_tool("simulate", machine, "--duration", 12, "--sample-rate", 250, "--seed", seed,
                     "--out", cls.path(name + ".csv"))
        cls.diagnoser = Diagnoser({"rig": cls.rig, "folder": cls.folder}).ready()
        cls.client = actionlib.SimpleActionClient(cls.diagnoser.topic("trace_residual"), TraceResidualAction)
        assert cls.client.wait_for_server(rospy.Duration(TIMEOUT))

    @classmethod
    def tearDownClass(cls):
        cls.diagnoser.__exit__()
        shutil.rmtree(cls.folder)

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    def goal(self, **changes):
        goal = {"train": [self.path("train.csv")], "test": self.path("test.csv"), "out": self.path("out")}
        goal.update(changes)
        return TraceResidualGoal(**goal)

    def result(self):
        return result_of(self.client)

    def test_finds_what_the_nodes_own_rig_lacks(self):
        feedback = []
        self.client.send_goal(self.goal(), feedback_cb=feedback.append)
        result = self.result()
        self.assertTrue(result.success, result.message)
        self.assertEqual(self.client.get_state(), actionlib.GoalStatus.SUCCEEDED)
        self.assertEqual(result.verdict, "effect_found")
        self.assertIn("asymmetric_viscous", result.message)
        self.assertEqual([e.id for e in result.effects], ["asymmetric_viscous"])
        with open(self.path("out/report.json")) as stream:
            report = json.load(stream)
        errors = report["channels"]["torque"]
        self.assertEqual([(c.name, c.before, c.after, c.floor) for c in result.channels],
                         [("torque", errors["before"], errors["after"], errors["floor"])])
        effect, step = result.effects[0], report["steps"][0]
        self.assertEqual((effect.channel, effect.error_before, effect.error_after, list(effect.equivalent_to)),
                         (step["channel"], step["test_error_before"], step["test_error_after"], step["equivalent_to"]))
        self.assertLess(effect.error_after, effect.error_before)
        self.assertEqual(result.report, self.path("out/report.html"))
        self.assertTrue(os.path.exists(result.report))
        fractions = [f.fraction for f in feedback]
        self.assertTrue(fractions)
        self.assertEqual(sorted(fractions), fractions)
        self.assertTrue(all(f.phase for f in feedback))
        self.assertTrue(any("asymmetric_viscous: torque" in f.best for f in feedback), [f.best for f in feedback])
        # The simulator runs what was found.
        with Simulator({"rig": result.augmented_rig}) as simulator:
            states = Inbox(simulator.topic("joint_states"), JointState)
            self.assertIn("joint_motor", states.wait_for_count(10)[-1].name)

    def test_takes_a_rig_from_the_goal_and_can_be_cancelled(self):
        first = threading.Event()
        self.client.send_goal(self.goal(rig=self.rig, out=self.path("cancelled")),
                              feedback_cb=lambda _: first.set())
        self.assertTrue(first.wait(TIMEOUT))
        self.client.cancel_goal()
        asked = time.monotonic()
        result = self.result()
        # A goal is a second; the rest is for a machine that does other things as well.
        self.assertLess(time.monotonic() - asked, 5)
        self.assertEqual(self.client.get_state(), actionlib.GoalStatus.PREEMPTED)
        self.assertFalse(result.success)
        self.assertFalse(os.path.exists(self.path("cancelled")))

    def test_a_job_that_is_killed_is_reported_and_the_node_goes_on(self):
        first = threading.Event()
        self.client.send_goal(self.goal(out=self.path("killed")), feedback_cb=lambda f: f.fraction > 0 and first.set())
        self.assertTrue(first.wait(TIMEOUT))
        for job in self.diagnoser.jobs():
            os.kill(job, signal.SIGKILL)
        result = self.result()
        self.assertEqual(self.client.get_state(), actionlib.GoalStatus.ABORTED)
        self.assertFalse(result.success)
        self.assertIn("trace_residual was ended by signal 9", result.message)
        self.assertTrue(self.diagnoser.alive())
        self.client.send_goal(self.goal(out=self.path("after")))
        self.assertTrue(self.result().success)

    def test_a_job_without_memory_fails_alone(self):
        with Diagnoser({"rig": self.rig, "folder": self.folder, "job_memory": 0.01}).ready() as diagnoser:
            client = actionlib.SimpleActionClient(diagnoser.topic("trace_residual"), TraceResidualAction)
            self.assertTrue(client.wait_for_server(rospy.Duration(TIMEOUT)))
            client.send_goal(self.goal(out=self.path("small")))
            result = result_of(client)
            self.assertEqual(client.get_state(), actionlib.GoalStatus.ABORTED)
            self.assertTrue(result.message)
            self.assertTrue(diagnoser.alive())

    def test_estimates_come_while_a_job_runs(self):
        curve = build_curve(self.folder)
        with Simulator({"half_gap": 3e-5}) as simulator:
            with Diagnoser({"curve": curve, "folder": self.folder}, simulator.topic("joint_states")).ready() as diagnoser:
                estimates = diagnoser.estimates()
                client = actionlib.SimpleActionClient(diagnoser.topic("trace_residual"), TraceResidualAction)
                self.assertTrue(client.wait_for_server(rospy.Duration(TIMEOUT)))
                estimates.wait_for_count(1)
                before = len(estimates.messages)
                stamps = []
                for _ in range(10):  # jobs one after the other, as one may take no longer than three estimates
                    client.send_goal(self.goal(rig=self.rig, out=self.path("beside")))
                    self.assertTrue(result_of(client).success)
                    stamps = [nanoseconds(m) for m in estimates.messages[before:] if m.method == "lost_motion"]
                    if len(stamps) > 3:
                        break
        self.assertGreater(len(stamps), 3)
        self.assertEqual({b - a for a, b in zip(stamps, stamps[1:])}, {300_000_000})  # three periods, none left out

    def test_wrong_goals_are_answered_with_the_reason(self):
        motor_only = self.path("motor.csv")
        with open(self.path("train.csv")) as stream:
            record = stream.read()
        with open(motor_only, "w") as stream:  # its load encoder is gone
            stream.write(record.replace("load_position", "reference_position", 1))
        self.servo = self.path("servo.yaml")
        shutil.copy(rig_path("two_inertia_servo"), self.servo)
        for changes, words in (
                ({"train": []}, "train"), ({"test": ""}, "test"), ({"out": ""}, "out"),
                ({"train": [self.path("none.csv")]}, "none.csv"), ({"rig": "none.yaml"}, "none.yaml"),
                ({"joint": "elbow"}, "elbow"), ({"cutoff": -1.0}, "cutoff"), ({"cutoff": float("nan")}, "cutoff"),
                ({"rig": rig_path()}, "must lie in"), ({"out": "../out"}, "must lie in"),
                ({"train": ["/etc/passwd"]}, "must lie in"),
                ({"rig": self.servo, "train": [motor_only]}, "load_position"),
                ({"out": self.path("test.csv")}, "test.csv")):
            self.client.send_goal(self.goal(**changes))
            result = self.result()
            self.assertEqual(self.client.get_state(), actionlib.GoalStatus.ABORTED, words)
            self.assertFalse(result.success)
            self.assertIn(words, result.message)


if __name__ == "__main__":
    rospy.init_node("trace_residual_test")
    rostest.rosrun("backlash_diagnosis", "trace_residual_test", TraceResidualTest)
