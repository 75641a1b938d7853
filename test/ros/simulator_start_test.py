#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Simulators started with parameters of their own: what is refused, followed and repeatable."""
import math
import re
import shutil
import tempfile
import unittest

import rospy
import rostest
from sensor_msgs.msg import JointState
from simulator_support import Inbox, Simulator, default_rig, latched, steps, write_rig
from std_msgs.msg import Float64, String

MOTOR = 0


class SimulatorStartTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def rig(self, **changes):
        rig = default_rig()
        for key, value in changes.items():
            rig.setdefault(key, {}).update(value) if isinstance(value, dict) else rig.update({key: value})
        return write_rig(self.folder, rig)

    def assert_refused(self, parameters, code, *shown):
        with Simulator(parameters) as simulator:
            exit_code, output = simulator.wait()
        self.assertEqual(exit_code, code, output)
        for text in shown:
            self.assertIn(text, output)

    def test_wrong_parameters_end_the_node_with_their_name(self):
        usage = 64
        self.assert_refused({"sampling_rate": "fast"}, usage, "~sampling_rate", "fast", "number")
        self.assert_refused({"sampling_rate": -1000.0}, usage, "~sampling_rate", "-1000")
        self.assert_refused({"backlash": -1e-6}, usage, "~backlash", "-1e-06")
        self.assert_refused({"backlash": 1e-4, "half_gap": 5e-5}, usage, "~backlash", "~half_gap")
        self.assert_refused({"seed": 1.5}, usage, "~seed", "whole")
        self.assert_refused({"joint": ""}, usage, "~joint")
        self.assert_refused({"real_time_factor": 1e-9}, usage, "~real_time_factor", "1e-09")
        self.assert_refused({"duration": 1e-5}, usage, "~duration", "1e-05")
        self.assert_refused({"publish_clock": 1}, usage, "~publish_clock", "true or false")
        self.assert_refused({"sample_rate": 1000}, usage, "~sample_rate", "known", "sampling_rate")

    def test_excitation_parameters_are_refused_where_the_excitation_has_no_such_thing(self):
        path = self.rig(excitation={"type": "topic"})
        with open(path) as file:
            text = file.read()
        with open(path, "w") as file:  # a topic has neither amplitude nor frequency
            file.write(re.sub(r"^  (amplitude|frequency): .*\n", "", text, flags=re.MULTILINE))
        self.assert_refused({"rig": path, "excitation_amplitude": 0.1}, 64, "~excitation_amplitude", "topic")

    def test_a_run_of_the_rig_file_replaces_its_excitation(self):
        runs = {"push": {"duration": 1.0, "excitation": {"type": "constant", "torque": 0.03}}}
        path = self.rig(test_runs=dict(runs, wait=dict(runs["push"], excitation={"type": "topic"})))
        self.assert_refused({"rig": path, "run": "pull"}, 64, "~run", "pull", "push, wait")
        self.assert_refused({"run": "push"}, 64, "~run", "test_runs")
        self.assert_refused({"rig": path, "run": "push", "excitation_amplitude": 1.0}, 64, "constant")
        with Simulator({"rig": path, "run": "push"}) as simulator:
            messages = Inbox(simulator.topic("joint_states"), JointState).wait_for_count(100)
            self.assertEqual({m.effort[MOTOR] for m in messages}, {0.03})
            description = latched(simulator.topic("rig_description"), String).data
            self.assertIn("run = push", description.splitlines()[0])

    def test_a_missing_or_wrong_rig_file_ends_the_node_with_its_name(self):
        self.assert_refused({"rig": self.folder + "/absent.yaml"}, 66, "~rig", "absent.yaml")
        self.assert_refused({"rig": 5}, 64, "~rig", "5", "text")
        path = self.rig(gear_train={"reduction_ratio": -1.0})
        self.assert_refused({"rig": path}, 65, "~rig", path, "reduction_ratio", "-1")
        with open(path, "w") as file:
            file.write("gear_train: [")
        self.assert_refused({"rig": path}, 65, "~rig", path)

    def test_an_argument_that_is_no_parameter_is_refused(self):
        with Simulator(arguments=["rig.yaml"]) as simulator:
            code, output = simulator.wait()
        self.assertEqual(code, 64)
        self.assertIn("rig.yaml", output)

    def test_help_names_every_parameter(self):
        with Simulator({"no_such_parameter": 0}) as simulator:
            known = re.search(r"known: (.*?)(\x1b|$)", simulator.wait()[1], re.MULTILINE).group(1).split(", ")
        self.assertIn("real_time_factor", known)
        with Simulator(arguments=["--help"]) as simulator:
            code, output = simulator.wait()
        self.assertEqual(code, 0)
        for name in known:
            self.assertRegex(output, r"(?m)^  %s " % name)

    def test_parameters_override_the_rig_file(self):
        with Simulator({"joint": "elbow", "half_gap": 3e-5, "sampling_rate": 400,
                        "excitation_amplitude": 0.02}) as s:
            message, following = Inbox(s.topic("joint_states"), JointState).wait_for_count(2)
            self.assertEqual(message.name, ["elbow_motor", "elbow_sensor", "elbow_load"])
            self.assertEqual(steps([message, following]), [2500000])  # ns, 1 / 400 Hz
            self.assertEqual(abs(message.effort[MOTOR]), 0.02)
            self.assertEqual(latched(s.topic("true_backlash"), Float64).data, 6e-5)
            first = latched(s.topic("rig_description"), String).data.splitlines()[0]
            for text in ("joint = elbow", "half_gap = 3e-05", "sampling_rate = 400",
                         "excitation_amplitude = 0.02"):
                self.assertIn(text, first)
            code, output = s.interrupt()
        self.assertEqual(code, 0, output)

    def run_of_500(self, seed):
        path = self.rig(sensors={"motor_position": {"noise": 1e-4}})
        with Simulator({"rig": path, "seed": seed, "duration": 0.5, "real_time_factor": 0,
                        "publish_clock": False, "wait_for_subscriber": True}) as simulator:
            inbox = Inbox(simulator.topic("joint_states"), JointState)
            code, output = simulator.wait()
            self.assertEqual(code, 0, output)
            samples = list(inbox.wait_for_count(500))
            self.assertEqual(len(inbox.messages), 500)
            self.assertEqual(set(steps(samples)), {1000000})
            return [(m.position, m.velocity, m.effort) for m in samples]

    def test_a_seed_gives_one_motion_and_one_noise(self):
        first = self.run_of_500(seed=7)
        self.assertEqual(first, self.run_of_500(seed=7))
        other = self.run_of_500(seed=8)
        self.assertNotEqual([s[0] for s in first], [s[0] for s in other])  # the noisy position
        self.assertEqual([s[1:] for s in first], [s[1:] for s in other])

    def test_torque_from_a_topic_moves_the_motor_and_is_held(self):
        rig = default_rig()
        rig["excitation"] = {"type": "topic"}
        path = write_rig(self.folder, rig)
        with Simulator({"rig": path}) as simulator:
            inbox = Inbox(simulator.topic("joint_states"), JointState)
            torque = rospy.Publisher(simulator.topic("torque_command"), Float64, queue_size=10, latch=True)
            self.assertEqual(inbox.wait_for_count(1)[0].effort[MOTOR], 0)

            def at(effort):
                return lambda m: m[-1].effort[MOTOR] == effort and m[-1].position[MOTOR] * effort > 0
            torque.publish(0.03)
            inbox.wait_for(at(0.03), "motor moved by 0.03 N m")
            torque.publish(math.nan)
            inbox.wait_for(lambda m: "refused" in simulator.output(), "warning about NaN")
            self.assertRegex(simulator.output(), r"%s.*nan" % simulator.topic("torque_command"))
            count = len(inbox.messages)
            held = inbox.wait_for_count(count + 100)[count:]
            self.assertEqual({m.effort[MOTOR] for m in held}, {0.03})
            torque.publish(-0.03)
            inbox.wait_for(at(-0.03), "motor moved by -0.03 N m")

    def test_a_simulation_that_falls_behind_says_so_and_leaves_nothing_out(self):
        # 5 s in 5 ms, with tolerances for which a computer needs a thousand times as long.
        path = self.rig(solver={"relative_tolerance": 1e-12})
        with Simulator({"rig": path, "duration": 5.0, "real_time_factor": 1000, "publish_clock": False,
                        "wait_for_subscriber": True}) as simulator:
            samples = Inbox(simulator.topic("joint_states"), JointState).wait_for_count(5000)
            code, output = simulator.wait()
        self.assertEqual(code, 0, output)
        self.assertRegex(output, r"[0-9.]+ s behind")
        self.assertEqual(set(steps(samples)), {1000000})  # ns

    def test_a_failing_integration_ends_the_node(self):
        path = self.rig(solver={"relative_tolerance": 1e-13, "position_tolerance": 1e-300,
                                "velocity_tolerance": 1e-300})
        self.assert_refused({"rig": path}, 65, "FATAL")


if __name__ == "__main__":
    rospy.init_node("simulator_start_test")
    rostest.rosrun("backlash_diagnosis", "simulator_start_test", SimulatorStartTest)
