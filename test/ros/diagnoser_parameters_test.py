#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Wrong parameters are refused at the start, with a message that names them; files that parameters name are used."""
import os
import shutil
import tempfile
import unittest

import rospy
import rostest
from diagnoser_support import Connected, Diagnoser, Diagnostics, build_curve, rig_path, send, simulated_messages
from sensor_msgs.msg import JointState
from simulator_support import TIMEOUT


LIMITS = "schema_version: 1\nbacklash: {watch: 1.0e-5, service: 2.0e-5, stop: 5.0e-4}\n"


class DiagnoserParametersTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def write(self, name, text):
        path = os.path.join(self.folder, name)
        with open(path, "w") as stream:
            stream.write(text)
        return path

    def fed(self, parameters, run):
        """A diagnoser that has heard a run of (times, messages)."""
        topic = "/states_%d" % len(os.listdir(self.folder))
        connected = Connected()
        publisher = rospy.Publisher(topic, JointState, connected, queue_size=10000)
        diagnoser = Diagnoser(parameters, topic).ready()
        self.addCleanup(diagnoser.__exit__)
        self.assertTrue(connected.wait(TIMEOUT), "the diagnoser does not subscribe")
        for time, message in zip(*run):
            send(publisher, message, time)
        diagnoser.publisher = publisher  # as long as it may ask
        return diagnoser

    def assert_refused(self, parameters, *shown):
        with Diagnoser(parameters) as diagnoser:
            code, output = diagnoser.wait()
        self.assertNotEqual(code, 0, output)
        for text in shown:
            self.assertIn(text, output)

    def test_wrong_parameters_end_the_node_with_their_name(self):
        self.assert_refused({"window": "five"}, "~window", "five", "whole number")
        self.assert_refused({"window": 0}, "~window", "0")
        self.assert_refused({"keep": -1.0}, "~keep", "-1")
        self.assert_refused({"joints": "elbow"}, "~joints", "list")
        self.assert_refused({"joints": ["elbow", "elbow"]}, "~joints", "elbow", "twice")
        self.assert_refused({"winow": 5}, "~winow", "window")
        self.assert_refused({"rig": "/nowhere/rig.yaml"}, "/nowhere/rig.yaml")
        self.assert_refused({"curve": "/nowhere/curve.yaml"}, "/nowhere/curve.yaml")
        self.assert_refused({"curve": rig_path()}, "sarkar_1997.yaml", "conditions")
        self.assert_refused({"limits": "/nowhere/limits.yaml"}, "/nowhere/limits.yaml")
        self.assert_refused({"limits": rig_path()}, "sarkar_1997.yaml", "backlash")
        self.assert_refused({"baseline": "/nowhere/healthy.yaml"}, "~baseline", "/nowhere/healthy.yaml", "folder")
        self.assert_refused({"baseline": rig_path()}, "sarkar_1997.yaml", "rig: is missing")
        self.assert_refused({"baseline": "/tmp/healthy.yaml", "joints": ["elbow", "wrist"]}, "~baseline", "JOINT/baseline")
        other = self.write("other.yaml", "schema_version: 1\nrig: elbow\nrig_digest: x\nmethods: [lost_motion]\n"
                           "backlash_angle: 1.0e-3\nangle_interval: [0.9e-3, 1.1e-3]\n")
        self.assert_refused({"baseline": other}, "other.yaml", "'elbow', not of 'sarkar_1997'")

    def test_a_robot_whose_joints_are_not_distinguished_is_refused(self):
        def folder(**rigs):
            path = tempfile.mkdtemp(dir=self.folder)
            for name, text in rigs.items():
                with open(os.path.join(path, name + ".yaml"), "w") as out:
                    out.write(text)
            return path

        with open(rig_path()) as stream:
            rig = stream.read()
        channels = "\nchannels: {motor_position: {name: elbow}, motor_torque: {name: elbow}}\n"
        self.assert_refused({"rig_folder": "/nowhere"}, "~rig_folder", "/nowhere")
        self.assert_refused({"rig_folder": folder()}, "~rig_folder", "no rig file")
        self.assert_refused({"rig_folder": folder(a=rig, b=rig)}, "b.yaml", "second rig file", "'joint'")
        self.assert_refused({"rig_folder": folder(a="schema_version: [")}, "a.yaml")
        self.assert_refused({"rig_folder": folder(a=rig), "rig": rig_path()}, "~rig_folder", "beside ~rig")
        self.assert_refused({"rig_folder": folder(a=rig), "joints": ["elbow"]}, "elbow", "no rig file in ~rig_folder")
        self.assert_refused({"rig": self.write("mapped.yaml", rig + channels), "joints": ["a", "b"]}, "~joints", "a",
                            "channels are of one joint")

    def test_wrong_channels_are_refused_by_name(self):
        good = {"motor_position": {"name": "elbow"}, "motor_torque": {"name": "elbow"}}
        for wrong, *shown in (({"motor_position": {"topic": "x"}}, "channels.motor_position.name", "empty"),
                              ({"motor_position": {"name": "x", "field": "angle"}}, "field", "angle"),
                              ({"motor_position": {"name": "x", "scale": 0.0}}, "channels.motor_position.scale"),
                              ({"motor_position": {"name": "x", "scale": "two"}}, "scale", "number"),
                              ({"motor_position": {"name": "x", "unit": "deg"}}, "unit", "not a parameter"),
                              ({"motor_angle": {"name": "x"}}, "motor_angle", "not a parameter")):
            self.assert_refused({"channels": {**good, **wrong}}, "~", *shown)
            self.assert_refused({"joints": ["a", "b"], "b/channels": {**good, **wrong}}, "~", *shown)

    def test_limits_and_baseline_are_kept_in_their_files(self):
        healthy = os.path.join(self.folder, "healthy.yaml")
        parameters = {"curve": build_curve(self.folder), "limits": self.write("limits.yaml", LIMITS),
                      "baseline": healthy, "waveform": False}
        run = simulated_messages(self.folder, 4e-5)
        first = self.fed(parameters, run)
        answer = first.diagnose(periods=10, timeout=TIMEOUT)
        self.assertEqual(answer.verdict.grade, "service", answer.message)  # good by the rig file's limits
        self.assertNotIn("warning", answer.message)
        self.assertIn("lost_motion", answer.verdict.members)
        self.assertLessEqual(answer.verdict.lower, 8e-5)
        self.assertGreaterEqual(answer.verdict.upper, 8e-5)
        kept = first.set_baseline()
        self.assertTrue(kept.success, kept.message)
        self.assertIn(healthy, kept.message)
        with open(healthy) as stream:
            text = stream.read()
        self.assertIn('rig: "sarkar_1997"', text)
        # Another node, another day: nothing has grown.
        second = self.fed(parameters, run)
        answer = second.diagnose(periods=10, timeout=TIMEOUT)
        self.assertAlmostEqual(answer.verdict.growth, 0, delta=1e-9)  # the same samples
        self.assertLess(answer.verdict.growth_lower, 0)
        self.assertGreater(answer.verdict.growth_upper, 0)
        self.assertTrue(second.set_baseline(clear=True).success)
        self.assertFalse(os.path.exists(healthy))

    def test_baseline_that_cannot_be_kept_is_not_set(self):
        folder = os.path.join(self.folder, "gone")
        os.mkdir(folder)
        diagnoser = self.fed({"curve": build_curve(self.folder), "baseline": os.path.join(folder, "healthy.yaml")},
                             simulated_messages(self.folder, 4e-5))
        self.assertTrue(diagnoser.diagnose(periods=10, timeout=TIMEOUT).success)
        os.rmdir(folder)
        answer = diagnoser.set_baseline()
        self.assertFalse(answer.success)
        self.assertIn("healthy.yaml", answer.message)
        self.assertNotIn("since the baseline", diagnoser.diagnose(periods=10, timeout=TIMEOUT).message)

    def test_files_of_another_version_of_the_rig_file_are_reported(self):
        with open(rig_path()) as stream:
            edited = self.write("edited.yaml", stream.read() + "# a remark\n")
        healthy = self.write("healthy.yaml", "schema_version: 1\nrig: sarkar_1997\nrig_digest: x\n"
                             "methods: [lost_motion]\nbacklash: 1.0e-5\ninterval: [0.9e-5, 1.1e-5]\n"
                             "backlash_angle: 6.7e-4\nangle_interval: [6.0e-4, 7.4e-4]\n")
        diagnostics = Diagnostics()
        diagnoser = self.fed({"rig": edited, "curve": build_curve(self.folder), "baseline": healthy},
                             simulated_messages(self.folder, 4e-5))
        answer = diagnoser.diagnose(periods=10, timeout=TIMEOUT)
        self.assertTrue(answer.success, answer.message)
        self.assertIn("the curve was made from another version of the rig file", answer.message)
        self.assertIn("healthy.yaml was taken with another version of the rig file", answer.message)
        self.assertIn("the curve was made from another version", diagnoser.curve().message)
        diagnostics.wait_for("joint: backlash", lambda l, m, v: "another version" in v.get("Warning", ""), "a warning")
        self.assertIn("[ WARN]", diagnoser.output())
        self.assertIn("the curve was made from another version of the rig file", diagnoser.output())


if __name__ == "__main__":
    rospy.init_node("diagnoser_parameters_test")
    rostest.rosrun("backlash_diagnosis", "diagnoser_parameters_test", DiagnoserParametersTest)
