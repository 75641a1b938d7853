# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the simulator node share: waiting for messages, starting the node, rig files."""
import bisect
import os
import subprocess
import tempfile
import threading
import time

import roslib.packages
import rospy
import yaml

PACKAGE = "backlash_diagnosis"
TIMEOUT = 60  # s of wall time; reached only when something is broken


def until(condition, what):
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError("no %s within %d s" % (what, TIMEOUT))
        time.sleep(0.02)


class Inbox:
    """All messages of one topic, in the order of arrival."""

    def __init__(self, topic, message_type):
        self.messages = []
        self._changed = threading.Condition()
        self._subscriber = rospy.Subscriber(topic, message_type, self._receive)

    def _receive(self, message):
        with self._changed:
            self.messages.append(message)
            self._changed.notify_all()

    def wait_for(self, condition, what, timeout=TIMEOUT):
        """Returns condition(messages) as soon as it is true; fails after `timeout` [s], whatever ROS time does."""
        deadline = time.monotonic() + timeout
        with self._changed:
            while True:
                result = condition(self.messages)
                if result:
                    return result
                left = deadline - time.monotonic()
                if left <= 0:
                    raise AssertionError("%s: no %s within %d s, %d messages came" % (
                        self._subscriber.name, what, timeout, len(self.messages)))
                self._changed.wait(left)

    def wait_for_count(self, count):
        return self.wait_for(lambda m: m[:count] if len(m) >= count else None, "%d messages" % count)

    def since(self, stamp, count=1, later_than=None):
        """All messages with stamps [ns] beyond `stamp`, once `count` of them are beyond `later_than`, too."""
        limit = stamp if later_than is None else later_than

        def found(messages):  # asked for every message: look at one only until there are enough
            if len(messages) < count or nanoseconds(messages[-count]) <= limit:
                return None
            return messages[bisect.bisect_right([nanoseconds(m) for m in messages], stamp):]
        return self.wait_for(found, "%d messages after %d ns" % (count, limit))

    def close(self):
        self._subscriber.unregister()


def nanoseconds(message):
    return message.header.stamp.to_nsec()


def steps(messages):
    """Differences of consecutive stamps [ns]."""
    stamps = [nanoseconds(m) for m in messages]
    return [b - a for a, b in zip(stamps, stamps[1:])]


def latched(topic, message_type):
    """The latched message of a topic, as a late subscriber gets it."""
    inbox = Inbox(topic, message_type)
    try:
        return inbox.wait_for_count(1)[0]
    finally:
        inbox.close()


def package_folder():
    return roslib.packages.get_pkg_dir(PACKAGE)


def default_rig():
    with open(os.path.join(package_folder(), "config", "sarkar_1997.yaml")) as file:
        return yaml.safe_load(file)


def write_rig(folder, rig):
    path = os.path.join(folder, "rig.yaml")
    with open(path, "w") as file:
        yaml.safe_dump(rig, file, default_flow_style=False)
    return path


class Simulator:
    """The simulator as a process of its own, with private parameters under a name of its own."""

    _count = 0

    def __init__(self, parameters=None, arguments=()):
        Simulator._count += 1
        self.name = "/simulator_%d" % Simulator._count
        for key, value in (parameters or {}).items():
            rospy.set_param("%s/%s" % (self.name, key), value)
        program = roslib.packages.find_node(PACKAGE, "simulator")[0]
        self._log = tempfile.TemporaryFile(mode="w+")
        command = [program, "__name:=" + self.name[1:], "joint_states:=" + self.topic("joint_states"),
                   "true_backlash:=" + self.topic("true_backlash"),
                   "rig_description:=" + self.topic("rig_description"),
                   "torque_command:=" + self.topic("torque_command")]
        self._process = subprocess.Popen(command + list(arguments), stdout=self._log,
                                         stderr=subprocess.STDOUT)

    def topic(self, name):
        return "%s/%s" % (self.name, name)

    def wait(self):
        """Waits for the end; returns exit code and everything it printed."""
        code = self._process.wait(TIMEOUT)
        return code, self.output()

    def output(self):
        self._log.seek(0)
        return self._log.read()

    def interrupt(self):
        self._process.send_signal(2)
        return self.wait()

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        self._log.close()
