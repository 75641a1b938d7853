#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""A simulated arm: published as a robot is, the same as offline, and diagnosed from a recorded bag."""
import json
import math
import os
import shutil
import tempfile
import unittest

import rosbag
import rospy
import rostest
import yaml
from backlash_diagnosis.msg import ChangeReport
from backlash_diagnosis.srv import SetBacklash, SetRig
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from diagnoser_support import run_tool
from sensor_msgs.msg import JointState
from simulator_support import Inbox, Simulator, TIMEOUT, latched, nanoseconds, package_folder, steps
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

FOLDER = os.path.join(package_folder(), "config", "two_link_arm")
RIG = os.path.join(FOLDER, "two_link_arm.yaml")
JOINTS = ["shoulder", "elbow"]
PLAY = {"shoulder": 2e-3, "elbow": 3e-3}  # rad, of the rig file
NAMES = JOINTS + [joint + end for joint in JOINTS for end in ("_motor", "_load")]


def urdf():
    with open(os.path.join(FOLDER, "two_link_arm.urdf")) as file:
        return file.read()


def rows(messages):
    """What a bag keeps of the two ends of each joint."""
    out = []
    for m in messages:
        at = {name: i for i, name in enumerate(m.name)}
        out.append([(m.position[at[j + "_motor"]], m.effort[at[j + "_motor"]], m.position[at[j + "_load"]])
                    for j in JOINTS])
    return out


def column(messages, name, field="position"):
    return [getattr(m, field)[m.name.index(name)] for m in messages]


class ArmTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def rig(self, change):
        with open(RIG) as file:
            rig = yaml.safe_load(file)
        rig["urdf"] = os.path.join(FOLDER, rig["urdf"])
        change(rig)
        path = os.path.join(self.folder, "rig.yaml")
        with open(path, "w") as file:
            yaml.safe_dump(rig, file)
        return path

    def test_it_is_published_as_a_robot_is(self):
        samples = Inbox("/cell/joint_states", JointState).wait_for_count(500)[:500]
        self.assertEqual(samples[0].name, NAMES)
        self.assertEqual(set(steps(samples)), {1000000})  # ns
        for joint in JOINTS:
            self.assertEqual(column(samples, joint), column(samples, joint + "_load"))
            self.assertEqual(column(samples, joint, "effort"), column(samples, joint + "_motor", "effort"))
        self.assertEqual(rospy.get_param("/cell/robot_description"), urdf())
        self.assertIn("name: two_link_arm", latched("/cell/rig_description", String).data)
        for joint in JOINTS:
            self.assertEqual(latched("/cell/%s/true_backlash" % joint, Float64).data, PLAY[joint])

    def test_robot_state_publisher_shows_the_links_where_the_joints_are(self):
        states, transforms = Inbox("/cell/joint_states", JointState), Inbox("/tf", TFMessage)

        def both(messages):
            """Angles and transforms of the same stamp, once the shoulder has left where the motion begins."""
            at = {nanoseconds(m): m for m in states.messages}
            for m in messages:
                links, state = {t.child_frame_id: t for t in m.transforms}, at.get(nanoseconds(m.transforms[0]))
                if set(links) == {"upper_arm", "forearm"} and state and abs(column([state], "shoulder")[0]) > 0.1:
                    return links, state
            return None
        links, state = transforms.wait_for(both, "transforms of a sample")
        for joint, link, parent, x in (("shoulder", "upper_arm", "base_link", 0), ("elbow", "forearm", "upper_arm", 0.3)):
            self.assertEqual(links[link].header.frame_id, parent)
            turned, moved = links[link].transform.rotation, links[link].transform.translation
            half = column([state], joint)[0] / 2  # about -y
            sign = math.copysign(1, turned.w * math.cos(half))  # q and -q are the same rotation
            for have, want in ((turned.x, 0), (turned.y, -math.sin(half)), (turned.z, 0), (turned.w, math.cos(half))):
                self.assertAlmostEqual(sign * have, want, delta=1e-12)
            for have, want in ((moved.x, x), (moved.y, 0), (moved.z, 0)):
                self.assertAlmostEqual(have, want, delta=1e-12)

    def test_a_healthy_arm_is_watched_as_one_machine(self):
        folder = rospy.get_param("/watched/change_watch/folder")
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        reports = Inbox("/watched/changes", ChangeReport)

        def looked(messages):
            """The status once three looks have an answer."""
            for status in (s for m in reversed(messages) for s in m.status if s.name.endswith("two_link_arm: model")):
                values = {v.key: v.value for v in status.values}
                return (status, values) if int(values["Looks with an answer"]) >= 3 else None
            return None
        status, values = Inbox("/diagnostics", DiagnosticArray).wait_for(looked, "looks", 120)
        self.assertEqual((status.level, reports.messages), (DiagnosticStatus.OK, []), status.message)
        self.assertGreater(int(values["Windows of motion judged"]), 5)
        with open(os.path.join(folder, "two_link_arm_healthy.csv")) as file:
            self.assertEqual(file.readline().strip().split(",")[:2], ["time", "shoulder/motor_torque"])
        self.body_is_put_on(reports)

    def body_is_put_on(self, reports):
        """The watched arm carries 0.8 kg from one sample on: named, and since when."""
        def loaded(rig):
            rig["payloads"] = [{"link": "forearm", "mass": 0.8, "centre": [0.25, 0.0, 0.0],
                                "inertia": [1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4]}]
        states = Inbox("/watched/joint_states", JointState)
        with open(self.rig(loaded)) as file:
            text = file.read()
        set_rig = rospy.ServiceProxy("/watched/simulator/set_rig", SetRig)
        answer = set_rig(text.replace("name: elbow", "name: wrist"))
        self.assertFalse(answer.success)
        self.assertIn("wrist", answer.message)
        before = states.wait_for_count(1)[-1].header.stamp
        answer = set_rig(text)
        self.assertTrue(answer.success, answer.message)
        after = states.wait_for_count(len(states.messages) + 1)[-1].header.stamp
        change = reports.wait_for(lambda all_of: all_of and all_of[0], "report").news[0]
        rospy.loginfo(change.text)
        self.assertEqual((change.joint, change.effect), ("elbow", "payload"))  # the joint that turns its link
        for name, value in (("mass", 0.8), ("centre_x", 0.25)):
            size = next(s for s in change.size if s.name == name)
            self.assertLess(abs(size.value - value), 3 * (size.upper - size.lower) / 3.92, change.text)
        # 95 % interval, which may miss once in twenty seeds: this does not.
        self.assertLessEqual(change.since_from, after)
        self.assertGreaterEqual(change.since_to, before)
        self.assertLess(change.error_after, change.error_before)

    def test_live_is_as_offline_and_a_recorded_bag_gives_both_plays(self):
        bag, offline = (os.path.join(self.folder, name) for name in ("live.bag", "offline.bag"))
        parameters = {"rig": RIG, "seed": 5, "duration": 20.0, "real_time_factor": 4.0, "publish_clock": False,
                      "wait_for_subscriber": True, "set_robot_description": False}
        with Simulator(parameters) as simulator:
            topic = simulator.topic("joint_states")
            live = Inbox(topic, JointState).wait_for_count(20000)
        with rosbag.Bag(bag, "w") as out:  # here, as `rosbag record` may lose samples where the machine is busy
            for message in live:
                out.write(topic, message, message.header.stamp)

        run_tool("simulate", RIG, "--duration", "20", "--seed", "5", "--out", offline)
        with rosbag.Bag(offline) as messages:
            self.assertEqual(rows(live), rows(m for _, m, _ in messages.read_messages(topics=["/joint_states"])))

        report = os.path.join(self.folder, "out.json")
        run_tool("diagnose_record", bag, "--rig", RIG, "--json", report)
        with open(report) as file:
            joints = json.load(file)["joints"]
        for joint in JOINTS:
            verdict = joints[joint]["verdict"]
            lower, upper = verdict["angle_interval"]
            self.assertTrue(lower <= PLAY[joint] <= upper, verdict)
            self.assertLess(upper - lower, 0.1 * PLAY[joint])  # twice the width that doc/arm.md shows
            self.assertLessEqual(abs(verdict["backlash_angle"] - PLAY[joint]), 0.05 * PLAY[joint])

    def test_a_joint_takes_its_torque_from_its_topic_and_its_backlash_from_its_service(self):
        def without_noise(rig):
            rig["joints"][1]["excitation"] = {"type": "topic"}
            rig["simulation"]["gravity_compensation"] = False
            for channel in ("motor_torque", "motor_position", "load_position"):
                rig["simulation"]["sensors"][channel] = {"noise": 0.0}
        parameters = {"rig": self.rig(without_noise), "torque_timeout": 0.2, "set_robot_description": False}
        with Simulator(parameters) as simulator:
            states = Inbox(simulator.topic("joint_states"), JointState)
            states.wait_for_count(1)
            torque = rospy.Publisher("/elbow/torque_command", Float64, queue_size=1, latch=True)
            self.assertEqual(column(states.messages[:1], "elbow_motor", "effort"), [0])
            torque.publish(1.25)
            states.wait_for(lambda m: column(m[-1:], "elbow_motor", "effort") == [1.25], "torque")
            states.wait_for(lambda m: column(m[-1:], "elbow_motor", "effort") == [0], "end of the torque")
            held = column(states.messages, "elbow_motor", "effort").count(1.25)
            self.assertEqual(held, 200)

            widen = rospy.ServiceProxy(simulator.name + "/elbow/set_backlash", SetBacklash)
            answer = widen(9e-3)
            self.assertTrue(answer.success, answer.message)
            self.assertEqual(latched("/elbow/true_backlash", Float64).data, 9e-3)
            self.assertFalse(widen(-1.0).success)
            answer = rospy.ServiceProxy(simulator.name + "/reset", Trigger)()
            self.assertEqual(answer.message, "at rest; backlash is 0.002 rad, 0.003 rad")
            self.assertEqual(latched("/elbow/true_backlash", Float64).data, PLAY["elbow"])

    def test_a_joint_without_a_gap_has_no_backlash(self):
        def no_gaps(rig):
            rig["joints"][0]["held"] = 0.3
            del rig["joints"][1]["gear"]
        with Simulator({"rig": self.rig(no_gaps), "set_robot_description": False}) as simulator:
            for joint in JOINTS:
                service = "%s/%s/set_backlash" % (simulator.name, joint)
                rospy.wait_for_service(service, TIMEOUT)
                answer = rospy.ServiceProxy(service, SetBacklash)(1e-3)
                self.assertFalse(answer.success)
                self.assertIn("'%s' has no gap" % joint, answer.message)

    def test_joints_that_are_held_are_published_where_they_stand(self):
        robot = os.path.join(self.folder, "gripper.urdf")
        with open(robot, "w") as file:
            file.write(urdf().replace("</robot>", """<link name="finger"/><joint name="grip" type="prismatic">
              <parent link="forearm"/><child link="finger"/><axis xyz="0 1 0"/>
              <limit lower="0" upper="0.1" effort="1" velocity="1"/></joint></robot>"""))

        def with_gripper(rig):
            rig.update(urdf=robot, held_joints={"grip": 0.02})
        with Simulator({"rig": self.rig(with_gripper), "set_robot_description": False}) as simulator:
            state = Inbox(simulator.topic("joint_states"), JointState).wait_for_count(1)[0]
        self.assertEqual(state.name, JOINTS + ["grip"] + NAMES[2:])
        self.assertEqual((column([state], "grip"), column([state], "grip", "velocity")), ([0.02], [0]))

    def test_what_cannot_be_is_refused(self):
        def assert_refused(parameters, code, *shown):
            with Simulator(dict({"rig": RIG}, **parameters)) as simulator:
                found, output = simulator.wait()
            self.assertEqual(found, code, output)
            for text in shown:
                self.assertIn(text, output)
        for name, value in (("run", "push"), ("joint", "elbow"), ("joints", ["elbow"]), ("backlash", 1e-3),
                            ("half_gap", 1e-3), ("excitation_amplitude", 1.0), ("rig_folder", FOLDER)):
            assert_refused({name: value}, 64, "~" + name, "the file of an arm")
        assert_refused({"elbow": {"backlash": 1e-3}}, 64, "~elbow/backlash", "not a parameter")
        assert_refused({"sampling_rate": -1.0}, 64, "~sampling_rate")
        assert_refused({"rig": self.rig(lambda rig: rig.pop("simulation"))}, 65, "~rig", "has no `simulation`")
        assert_refused({"rig": self.rig(lambda rig: rig.update(urdf="gone.urdf"))}, 66, "~rig", "gone.urdf")


if __name__ == "__main__":
    rospy.init_node("arm_test")
    rostest.rosrun("backlash_diagnosis", "arm_test", ArmTest)
