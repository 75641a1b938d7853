#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Bags into the running diagnoser: any rate, pause and loop, and offline, give the same numbers."""
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import rosbag
import rospy
import rostest
from diagnoser_support import Diagnoser, build_curve, rig_path, run_tool
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from simulator_support import TIMEOUT, Inbox, Simulator, package_folder, until
from std_srvs.srv import SetBool

sys.path.append(os.path.join(package_folder(), "test", "support"))
from skip import skip  # noqa: E402

SMALL_BAG = os.path.join(package_folder(), "test", "data", "sarkar_half_gap_30um.bag")
SMALL_BAG_PERIODS = 6  # 0.8 s at 10 Hz, less two to settle
VERDICTS = (0, 1, 2, 3)  # exit codes of diagnose_record that are answers


class Player:
    """rosbag play, once the diagnoser listens; the whole bag fits its queue, so that a busy machine loses nothing.

    At its end rosbag play drops what it has not sent yet (on a busy machine 2 of 70 runs lost the last message). So it
    is kept alive until its clock, which it sends after the samples, is past the bag.
    """

    _clock = None

    def __init__(self, bag, *options, topics=("/joint_states",)):
        if Player._clock is None:
            Player._clock = Inbox("/clock", Clock)
        self._heard = len(Player._clock.messages)
        with rosbag.Bag(bag) as recorded:
            self._end = recorded.get_end_time()
        self._process = subprocess.Popen(
            ["rosbag", "play", "--clock", "--keep-alive", "--quiet", "--queue=10000", "--delay=0",
             "--wait-for-subscribers", *options, bag, "--topics", *topics], stdin=subprocess.DEVNULL)

    def to_end(self):
        try:
            Player._clock.wait_for(lambda ticks: any(t.clock.to_sec() > self._end for t in ticks[self._heard:]),
                                   "end of the bag")
        finally:
            self.stop()

    def stop(self):
        self._process.send_signal(2)
        self._process.wait(TIMEOUT)


def play(bag, *options, topics=("/joint_states",)):
    Player(bag, *options, topics=topics).to_end()


ROBOT_CHANNELS = {
    "motor_torque": {"topic": "/arm/joint_states", "name": "elbow", "scale": 16},  # the effort is a current
    "motor_position": {"topic": "/arm/joint_states", "name": "elbow", "scale": -1},
    "motor_velocity": {"topic": "/arm/joint_states", "name": "elbow", "scale": -1},
    "load_position": {"topic": "/arm/joint_states", "name": "elbow_link"},
    "sensor_torque": {"topic": "/arm/torques", "name": "elbow_flange"},
}


def rig_of(joint, folder, more=""):
    """The reference rig under a joint's name."""
    path = os.path.join(folder, joint + ".yaml")
    with open(rig_path()) as stream, open(path, "w") as out:
        out.write(re.sub(r"(?m)^joint: \w+", "joint: " + joint, stream.read(), count=1) + more)
    return path


def as_a_robot_publishes(bag, path):
    """The same run with the names, signs, units and topics of ROBOT_CHANNELS; powers of two keep every bit."""
    with rosbag.Bag(bag) as recorded, rosbag.Bag(path, "w") as out:
        for _, m, received in recorded.read_messages(topics=["/joint_states"]):
            at = {name: i for i, name in enumerate(m.name)}
            motor, sensor, load = at["joint_motor"], at["joint_sensor"], at["joint_load"]
            arm = JointState(header=m.header, name=["elbow_link", "elbow"],
                             position=[m.position[load], -m.position[motor]],
                             velocity=[0, -m.velocity[motor]], effort=[0, m.effort[motor] / 16])
            out.write("/arm/joint_states", arm, received)
            out.write("/arm/torques", JointState(header=m.header, name=["elbow_flange"], effort=[m.effort[sensor]]),
                      received)


def numbers(answer):
    """All numbers of an answer of the service, comparable."""
    found = [list(answer.distribution.percentage), answer.distribution.skewness, answer.distribution.periods]
    for e in answer.estimates:
        found.append([e.method, e.status_name, repr(e.backlash), repr(e.lower), repr(e.upper), repr(e.backlash_angle),
                      repr(e.skewness), repr(e.gap), repr(e.compliance), repr(e.coulomb)])
    return found


def offline(bag, folder, *options):
    path = os.path.join(folder, "offline.json")
    run_tool("diagnose_record", bag, "--json", path, *options, codes=VERDICTS)
    with open(path) as stream:
        return json.load(stream)


class ReplayTest(unittest.TestCase):
    answer = None

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.curve = build_curve(cls.folder)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def replayed(self, bag, periods, *options):
        with Diagnoser({"curve": self.curve, "waveform": False}).ready() as diagnoser:
            play(bag, *options)
            return diagnoser.diagnose(periods=periods, timeout=TIMEOUT)

    def as_recorded(self):
        """The answer for the small bag at the rate of its stamps; played once."""
        if self.answer is None:
            type(self).answer = self.replayed(SMALL_BAG, SMALL_BAG_PERIODS)
        return self.answer

    def assert_like_offline(self, answer, report):
        self.assertEqual(len(answer.estimates), len(report["estimates"]))
        for live, stored in zip(answer.estimates, report["estimates"]):
            if live.method == "waveform":  # when it is there depends on the machine: live_waveform_test.py
                continue
            self.assertEqual((live.method, live.status_name), (stored["method"], stored["status"]))
            for key, value in (("backlash", live.backlash), ("backlash_angle", live.backlash_angle),
                               ("skewness", live.skewness)):
                if math.isnan(value):
                    self.assertIsNone(stored[key], live.method)
                else:
                    self.assertEqual(value, stored[key], live.method)
        self.assertEqual(answer.verdict.grade, report["verdict"]["grade"])

    def test_small_bag_gives_the_same_at_any_rate_and_offline(self):
        answers = [self.as_recorded()]
        answers += [self.replayed(SMALL_BAG, SMALL_BAG_PERIODS, "--rate=%g" % rate) for rate in (0.5, 5)]
        self.assertTrue(answers[0].success, answers[0].message)
        self.assertAlmostEqual(answers[0].estimates[1].backlash, 6e-5, delta=3e-6)  # goal for motor position
        self.assertEqual(answers[0].distribution.periods, SMALL_BAG_PERIODS)
        for answer in answers[1:]:
            self.assertEqual(numbers(answer), numbers(answers[0]))
        self.assert_like_offline(answers[0], offline(SMALL_BAG, self.folder, "--rig", rig_path(), "--curve", self.curve))

    def test_a_robot_with_names_topics_and_units_of_its_own_needs_no_relay(self):
        rigs, bag = os.path.join(self.folder, "robot"), os.path.join(self.folder, "robot.bag")
        os.mkdir(rigs)
        # The channels of one joint are in its rig file, those of the other are parameters.
        rig = rig_of("elbow", rigs, "\nchannels: " + json.dumps(ROBOT_CHANNELS) + "\n")
        rig_of("wrist", rigs)
        as_a_robot_publishes(SMALL_BAG, bag)
        parameters = {"rig_folder": rigs, "curve": self.curve, "waveform": False, "wrist/channels": ROBOT_CHANNELS}
        with Diagnoser(parameters).ready() as diagnoser:
            # A second of delay: a connection may still be under way when the topic has a subscriber.
            play(bag, "--delay=1", topics=("/arm/joint_states", "/arm/torques"))
            for joint in ("elbow", "wrist"):
                answer = diagnoser.diagnose(joint=joint, periods=SMALL_BAG_PERIODS, timeout=TIMEOUT)
                self.assertEqual(numbers(answer), numbers(self.as_recorded()), joint)
        self.assert_like_offline(answer, offline(bag, self.folder, "--rig", rig, "--curve", self.curve))

    def test_pause_changes_nothing(self):
        with Diagnoser({"curve": self.curve, "waveform": False}).ready() as diagnoser:
            player = Player(SMALL_BAG, "--rate=0.25", "__name:=player")
            self.addCleanup(player.stop)
            rospy.wait_for_service("/player/pause_playback", TIMEOUT)
            pause = rospy.ServiceProxy("/player/pause_playback", SetBool)
            diagnoser.diagnose(periods=1, timeout=TIMEOUT)  # in the middle of the run
            pause(True)
            early = diagnoser.diagnose(periods=SMALL_BAG_PERIODS, timeout=0.5)
            pause(False)
            player.to_end()
            answer = diagnoser.diagnose(periods=SMALL_BAG_PERIODS, timeout=TIMEOUT)
        self.assertFalse(early.success)
        self.assertEqual(numbers(answer), numbers(self.as_recorded()))

    def test_second_pass_of_a_loop_gives_the_same_as_the_first(self):
        with Diagnoser({"curve": self.curve, "waveform": False}).ready() as diagnoser:
            play(SMALL_BAG)
            first = diagnoser.diagnose(periods=SMALL_BAG_PERIODS, timeout=TIMEOUT)
            play(SMALL_BAG, "--rate=3")  # its stamps begin again, as those of --loop do
            second = diagnoser.diagnose(periods=SMALL_BAG_PERIODS, timeout=TIMEOUT)
        self.assertTrue(first.success, first.message)
        self.assertEqual(numbers(second), numbers(first))

    def test_bag_recorded_from_the_simulator_gives_the_same_live_replayed_and_offline(self):
        bag = os.path.join(self.folder, "recorded.bag")
        with Simulator({"half_gap": 4e-5, "duration": 1.0, "real_time_factor": 0.5, "publish_clock": True,
                        "wait_for_subscriber": True}) as simulator:
            topic = simulator.topic("joint_states")
            recorder = subprocess.Popen(["rosbag", "record", "--quiet", "-O", bag, topic], stdin=subprocess.DEVNULL,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            code, output = simulator.wait()
            self.assertEqual(code, 0, output)
            recorder.send_signal(2)
            recorder.wait(TIMEOUT)
            until(lambda: os.path.exists(bag), "bag")  # `rosbag` does not wait for its child, which renames the bag last
        report = offline(bag, self.folder, "--rig", rig_path(), "--curve", self.curve)
        self.assertEqual(report["estimates"][1]["status"], "ok", report)
        self.assertAlmostEqual(report["estimates"][1]["backlash"], 8e-5, delta=3e-6)
        periods = report["apd"]["periods"] + report["apd"]["incomplete"]
        self.assertGreaterEqual(periods, 6)  # the recorder may miss what came before its connection was up
        for rate in (1, 3):
            with Diagnoser({"curve": self.curve, "waveform": False}, topic).ready() as diagnoser:
                play(bag, "--rate=%g" % rate, topics=[topic])
                answer = diagnoser.diagnose(periods=periods, timeout=TIMEOUT)
                self.assertTrue(answer.success, answer.message)
                self.assert_like_offline(answer, report)

    def test_measured_gearbox_play_is_found_live_as_offline(self):
        repository = os.path.dirname(os.path.realpath(os.path.join(package_folder(), "package.xml")))
        root = os.environ.get("BACKLASH_DIAGNOSIS_DATA", os.path.join(repository, "..", "shared", "data"))
        # Play from wall to wall at +-3.5 N m read from the records by hand: 1.74, 1.10, 0.28 deg; the order counts.
        expected = (("split_reassembled", 1.74), ("split_preload1", 1.10), ("split_preload3", 0.28))
        for name, degrees in expected:
            record = os.path.join(root, "measured", "cycloidal_%s_play.csv" % name)
            if not os.path.exists(record):
                skip(self, "measured record %s is not here" % record)
            bag = os.path.join(self.folder, name + ".bag")
            run_tool("convert_record", record, bag, "--rig", rig_path("cycloidal"))
            with Diagnoser({"rig": rig_path("cycloidal"), "waveform": False}).ready() as diagnoser:
                play(bag, "--rate=20")
                answer = diagnoser.diagnose(timeout=TIMEOUT)
            self.assertTrue(answer.success, answer.message)
            best = answer.estimates[answer.verdict.estimate]
            self.assertEqual(best.method, "lost_motion")
            self.assertAlmostEqual(math.degrees(best.backlash_angle), degrees, delta=0.05)  # reading of the loops
            self.assert_like_offline(answer, offline(bag, self.folder, "--rig", rig_path("cycloidal")))


if __name__ == "__main__":
    rospy.init_node("replay_test")
    rostest.rosrun("backlash_diagnosis", "replay_test", ReplayTest)
