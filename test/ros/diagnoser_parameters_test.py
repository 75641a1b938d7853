#!/usr/bin/python3
"""Wrong parameters are refused at the start, with a message that names them."""
import unittest

import rospy
import rostest
from diagnoser_support import Diagnoser, rig_path


class DiagnoserParametersTest(unittest.TestCase):
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


if __name__ == "__main__":
    rospy.init_node("diagnoser_parameters_test")
    rostest.rosrun("backlash_diagnosis", "diagnoser_parameters_test", DiagnoserParametersTest)
