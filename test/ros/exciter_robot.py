#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""A joint that takes torque and publishes its state, with a fault: an inertia of 0.5 kg m^2 with 1 N m s/rad.
Writes each command that comes to a file. Usage: exciter_robot.py FAULT COMMANDS [GOAL_BAG]"""
import sys
import threading
import time

import rospy
from backlash_diagnosis.msg import ExciteActionGoal
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

RATE = 200  # Hz
FAULT_AFTER = 0.8  # s after the first torque: the run is beyond its ramp


class Robot:
    def __init__(self, fault, commands):
        self.fault, self.log = fault, open(commands, "w", buffering=1)
        self.torque, self.driven_since = 0.0, None
        rospy.Subscriber("torque_command", Float64, self.take, tcp_nodelay=True)
        self.states = rospy.Publisher("joint_states", JointState, queue_size=10)

    def take(self, message):
        self.log.write("%r\n" % message.data)
        self.torque = message.data
        if message.data != 0 and self.driven_since is None:
            self.driven_since = time.monotonic()

    def effective(self, broken):
        if self.fault == "dead":
            return 0.0
        if self.fault == "reversed":
            return -self.torque
        return 5.0 if self.fault == "runs_away" and broken else self.torque

    def run(self):
        position = velocity = 0.0
        while not rospy.is_shutdown():
            broken = self.driven_since is not None and time.monotonic() - self.driven_since > FAULT_AFTER
            velocity += (self.effective(broken) - velocity) / 0.5 / RATE
            position += velocity / RATE
            message = JointState(name=["elbow"], effort=[self.torque], position=[position])
            message.header.stamp = rospy.Time.now()
            if broken and self.fault == "jump":
                message.position = [position + 1]
            if broken and self.fault == "nan":
                message.position = [float("nan")]
            if not (broken and self.fault == "silent"):
                self.states.publish(message)
            time.sleep(1 / RATE)


def send_goal(bag):
    """Where the test itself has no part in the master that will be killed."""
    goals = rospy.Publisher("/exciter/excite/goal", ExciteActionGoal, queue_size=1)
    while goals.get_num_connections() == 0 and not rospy.is_shutdown():
        time.sleep(0.05)
    time.sleep(0.5)  # the exciter must have found this robot, too
    goal = ExciteActionGoal()
    goal.goal_id.id = "one"
    goal.goal.bag = bag
    goals.publish(goal)


if __name__ == "__main__":
    rospy.init_node("robot")
    robot = Robot(sys.argv[1], sys.argv[2])
    if len(sys.argv) > 3:
        threading.Thread(target=send_goal, args=(sys.argv[3],), daemon=True).start()
    robot.run()
