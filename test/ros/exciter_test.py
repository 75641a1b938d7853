#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The exciter beside a robot with every fault: the last command is zero, the result says why, the bag is readable."""
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

import actionlib
import roslib.packages
import rosbag
import rospy
import rostest
import yaml
from actionlib_msgs.msg import GoalStatus
from backlash_diagnosis.msg import ExciteAction, ExciteGoal
from sensor_msgs.msg import JointState
from simulator_support import PACKAGE, TIMEOUT, Inbox, Simulator, default_rig, until
from std_msgs.msg import Float64

LIMITS = {"torque_limit": 2.0, "speed_limit": 3.0, "position_lower": -1.0, "position_upper": 1.0,
          "duration_limit": 5.0, "rest": 0.2, "ramp": 0.3, "state_age": 0.3, "still": 0.5}


def end(process):
    if process.poll() is None:
        process.kill()
    process.wait()


class ExciterTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)
        self.bag = os.path.join(self.folder, "run.bag")
        self.commands_file = os.path.join(self.folder, "commands")

    def write_rig(self, changes=None):
        rig = default_rig()
        rig["test_runs"] = {"shake": {"duration": 2.0, "excitation": {"type": "sine", "amplitude": 1.0,
                                                                      "frequency": 1.0}}}
        rig["channels"] = {"motor_position": {"name": "elbow"}, "motor_torque": {"name": "elbow"}}
        rig.update(changes or {})
        path = os.path.join(self.folder, "rig.yaml")
        with open(path, "w") as file:
            yaml.safe_dump({k: v for k, v in rig.items() if v is not None}, file, default_flow_style=False)
        return path

    def start_robot(self, fault, *arguments, env=None):
        script = os.path.join(os.path.dirname(os.path.realpath(__file__)), "exciter_robot.py")
        robot = subprocess.Popen([sys.executable, script, fault, self.commands_file] + list(arguments), env=env)
        self.addCleanup(end, robot)

    def start_exciter(self, parameters=None, rig=None, env=None, remap=()):
        values = dict(LIMITS, rig=rig or self.write_rig(), folder=self.folder)
        values.update(parameters or {})
        program = roslib.packages.find_node(PACKAGE, "exciter")[0]
        self.log = open(os.path.join(self.folder, "log"), "w+")
        self.addCleanup(self.log.close)
        words = ["_%s:=%s" % (k, v) for k, v in values.items() if v is not None]
        if env is None and rospy.has_param("/exciter"):
            rospy.delete_param("/exciter")
        exciter = subprocess.Popen([program, "__name:=exciter"] + words + list(remap), env=env, stdout=self.log,
                                   stderr=subprocess.STDOUT)
        self.addCleanup(end, exciter)
        return exciter

    def output(self):
        with open(self.log.name) as file:
            return file.read()

    def client(self):
        client = actionlib.SimpleActionClient("/exciter/excite", ExciteAction)
        self.assertTrue(client.wait_for_server(rospy.Duration(TIMEOUT)), self.output())
        return client

    def commands(self):
        with open(self.commands_file) as file:
            return [float(line) for line in file.read().splitlines()]

    def driven(self):
        return os.path.exists(self.commands_file) and any(abs(c) > 0.3 for c in self.commands())

    def check_end(self):
        until(lambda: self.commands()[-5:] == [0.0] * 5, "five zeros at the end")
        with rosbag.Bag(self.bag) as bag:
            sent = [m.data for _, m, _ in bag.read_messages("/torque_command")]
            states = bag.get_message_count("/joint_states")
        self.assertEqual(sent[-5:], [0.0] * 5)
        self.assertLessEqual(max(abs(t) for t in sent), LIMITS["torque_limit"])
        self.assertGreater(states, 10)
        return sent, states

    def result_with(self, fault):
        self.start_robot(fault)
        self.start_exciter()
        client = self.client()
        until(lambda: os.path.exists(self.commands_file), "robot")
        return client, self.result_of_a_goal(client)

    def result_of_a_goal(self, client):
        """Asks again while nobody listens or no state comes: the robot may connect a little later. An answer that comes
        before this client is connected is lost, and asked for again."""
        results = []

        def taken():
            client.send_goal(ExciteGoal(bag=self.bag))
            if not client.wait_for_result(rospy.Duration(TIMEOUT / 4)):
                return False
            results.append(client.get_result())
            if "has no " in results[-1].message:
                time.sleep(0.1)  # between two askings
                return False
            return True
        until(taken, "robot that is connected")
        return results[-1]

    def test_a_run_is_driven_and_recorded(self):
        client, result = self.result_with("none")
        self.assertTrue(result.success, result.message)
        self.assertEqual(client.get_state(), GoalStatus.SUCCEEDED)
        sent, states = self.check_end()
        self.assertEqual(len(sent), result.commands)
        self.assertEqual(states, result.states)
        self.assertAlmostEqual(max(sent), 1.0, delta=0.02)  # the sine's amplitude, in its middle

    def check_fault(self, fault, reason):
        client, result = self.result_with(fault)
        self.assertFalse(result.success)
        self.assertIn(reason, result.message)
        self.assertEqual(client.get_state(), GoalStatus.ABORTED)
        self.check_end()

    def test_states_stop(self):
        self.check_fault("silent", "no state came")

    def test_position_runs_away(self):
        self.check_fault("runs_away", "limit")

    def test_position_jumps(self):
        self.check_fault("jump", "jumped")

    def test_position_is_no_number(self):
        self.check_fault("nan", "not a finite number")

    def test_sign_is_reversed(self):
        self.check_fault("reversed", "against the commanded torque")

    def test_controller_is_dead(self):
        self.check_fault("dead", "nothing moved")

    def start_run(self):
        self.start_robot("none")
        exciter = self.start_exciter()
        client = self.client()
        until(lambda: os.path.exists(self.commands_file), "robot")
        deadline = time.monotonic() + TIMEOUT
        while not self.driven() and time.monotonic() < deadline:
            if client.get_state() not in (GoalStatus.PENDING, GoalStatus.ACTIVE):
                client.send_goal(ExciteGoal(bag=self.bag))
            time.sleep(0.05)
        return exciter, client

    def test_second_publisher(self):
        exciter, client = self.start_run()
        other = rospy.Publisher("/torque_command", Float64, queue_size=1)
        self.assertTrue(client.wait_for_result(rospy.Duration(TIMEOUT)))
        self.assertIn("publishes on", client.get_result().message)
        self.check_end()
        client.send_goal(ExciteGoal(bag=self.bag))
        self.assertTrue(client.wait_for_result(rospy.Duration(TIMEOUT)))
        self.assertIn("another publisher", client.get_result().message)
        other.unregister()

    def test_cancel_at_any_moment(self):
        _, client = self.start_run()
        for wait in (None, 0.0, 0.1, 0.4):  # in the midst of the run; before, at and after the start
            if wait is not None:
                client.send_goal(ExciteGoal(bag=self.bag))
                time.sleep(wait)
            client.cancel_goal()
            self.assertTrue(client.wait_for_result(rospy.Duration(TIMEOUT)))
            self.assertIn(client.get_state(), (GoalStatus.PREEMPTED, GoalStatus.RECALLED))
            until(lambda: self.commands()[-5:] == [0.0] * 5, "five zeros at the end")
            if wait is None:
                self.assertIn("cancelled", client.get_result().message)
                self.check_end()

    def test_signals(self):
        for which in (signal.SIGINT, signal.SIGTERM):
            exciter, _ = self.start_run()
            exciter.send_signal(which)
            self.assertEqual(exciter.wait(TIMEOUT), 0, self.output())
            self.check_end()
            self.doCleanups()
            self.setUp()

    def test_master_is_killed(self):
        with socket.socket() as free:
            free.bind(("", 0))
            port = free.getsockname()[1]
        env = dict(os.environ, ROS_MASTER_URI="http://localhost:%d" % port)
        master = subprocess.Popen(["rosmaster", "--core", "-p", str(port)], env=env, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL)
        self.addCleanup(end, master)
        uri = socket.create_connection
        until(lambda: self.answers(uri, port), "master")
        exciter = self.start_exciter(env=env)
        self.start_robot("none", self.bag, env=env)
        until(self.driven, "torque")
        end(master)
        self.assertEqual(exciter.wait(TIMEOUT), 70, self.output())
        self.assertIn("the ROS master is gone", self.output())
        self.check_end()

    @staticmethod
    def answers(connect, port):
        try:
            connect(("localhost", port), 1).close()
            return True
        except OSError:
            return False

    def test_missing_limits_are_refused_by_name(self):
        for name in ("torque_limit", "speed_limit", "position_lower", "position_upper", "duration_limit", "rig"):
            exciter = self.start_exciter({name: None})
            self.assertEqual(exciter.wait(TIMEOUT), 64, self.output())
            self.assertIn("~" + name, self.output())

    def test_dry_run_commands_nothing(self):
        self.start_exciter({"dry_run": "true"})
        client = self.client()
        client.send_goal(ExciteGoal(bag=self.bag))
        self.assertTrue(client.wait_for_result(rospy.Duration(TIMEOUT)))
        self.assertTrue(client.get_result().success)
        self.assertIn("dry run", client.get_result().message)
        self.assertEqual(client.get_result().commands, 0)
        with rosbag.Bag(self.bag) as bag:
            plan = [m.data for _, m, _ in bag.read_messages("/torque_command")]
        self.assertEqual(len(plan), 2001)  # 2 s, each millisecond
        self.assertEqual((plan[0], plan[-1]), (0, 0))
        picture = os.path.join(self.folder, "plan.png")
        script = os.path.join(os.path.dirname(os.path.realpath(__file__)), "../../scripts/plot_excitation.py")
        subprocess.run([sys.executable, script, self.bag, "--out", picture], check=True)
        self.assertGreater(os.path.getsize(picture), 10000)

    def test_the_simulator_lets_go_of_an_old_torque(self):
        path = self.write_rig({"channels": None, "test_runs": None, "excitation": {"type": "topic"}})
        with Simulator({"rig": path, "torque_timeout": 0.2}) as simulator:
            states = Inbox(simulator.topic("joint_states"), JointState)
            command = rospy.Publisher(simulator.topic("torque_command"), Float64, queue_size=1, latch=True)
            command.publish(0.04)  # N m

            def efforts(messages):  # the motor's torque as its sensor shows it
                return [m.effort[0] for m in messages]
            states.wait_for(lambda m: m and max(efforts(m[-50:])) > 0.03, "torque")
            states.wait_for(lambda m: max(efforts(m[-50:])) < 0.02, "end of the torque")
            command.unregister()

    def test_the_simulator_is_the_robot(self):
        rig = default_rig()
        run = {"shake": {"duration": 2.0, "excitation": dict(rig["excitation"])}}
        path = self.write_rig({"channels": None, "test_runs": run, "excitation": {"type": "topic"}})
        with Simulator({"rig": path, "torque_timeout": 0.1}) as simulator:
            self.start_exciter({"torque_limit": 0.06, "speed_limit": 20.0}, path,
                               remap=["joint_states:=" + simulator.topic("joint_states"),
                                      "torque_command:=" + simulator.topic("torque_command")])
            client = self.client()
            self.result_of_a_goal(client)
        self.assertTrue(client.get_result().success, client.get_result().message)
        with rosbag.Bag(self.bag) as bag:
            self.assertEqual(bag.get_message_count(simulator.topic("joint_states")), client.get_result().states)


if __name__ == "__main__":
    rospy.init_node("exciter_test")
    rostest.rosrun("backlash_diagnosis", "exciter_test", ExciterTest)
