# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the diagnoser node share: the node as a process, a coarse curve, records to publish."""
import copy
import csv
import functools
import os
import subprocess
import tempfile
import threading
import time

import actionlib
import roslib.packages
import rospy
from backlash_diagnosis.msg import AmplitudeDistribution, BacklashEstimate
from backlash_diagnosis.srv import Diagnose, GetCurve, SetBaseline
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState
from simulator_support import PACKAGE, TIMEOUT, Inbox, package_folder


START = 1_000_000_000  # s, stamp of the first sample


def rig_path(name="sarkar_1997"):
    return os.path.join(package_folder(), "config", name + ".yaml")


def run_tool(name, *arguments, codes=(0,)):
    """Runs an offline command; fails with its words where it ends with another exit code."""
    program = roslib.packages.find_node(PACKAGE, name)[0]
    done = subprocess.run([program] + [str(a) for a in arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          universal_newlines=True, timeout=300)
    if done.returncode not in codes:
        raise AssertionError("%s ended with %d: %s" % (name, done.returncode, done.stderr))
    return done


@functools.lru_cache(None)
def coarse_curve(rate):
    """Text of a coarse curve: quick to build, and good enough where the test is not about its sharpness."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "curve.yaml")
        run_tool("build_curve", rig_path(), "--out", path, "--points", 11, "--periods", 3, "--seeds", 4,
                 "--sample-rate", rate)
        with open(path) as stream:
            return stream.read()


def build_curve(folder, rate=1000):
    """A file with it in the folder, for a test that may change it."""
    path = os.path.join(folder, "curve.yaml")
    with open(path, "w") as stream:
        stream.write(coarse_curve(rate))
    return path


def result_of(client):
    """SimpleActionClient overlooks an end that comes before its send_goal() has returned; the goal itself does not."""
    end = time.monotonic() + TIMEOUT
    while not client.wait_for_result(rospy.Duration(0.2)):
        if client.gh.get_comm_state() == actionlib.CommState.DONE:
            break
        if time.monotonic() > end:
            raise AssertionError("no result within %d s" % TIMEOUT)
    return client.get_result()


class Diagnoser:
    """The diagnoser as a process of its own, under a name of its own, with its answers."""

    _count = 0

    def __init__(self, parameters=None, joint_states="/joint_states"):
        Diagnoser._count += 1
        self.name = "/diagnoser_%d" % Diagnoser._count
        self._folder = tempfile.TemporaryDirectory()
        defaults = {"folder": self._folder.name}
        if "TSAN_OPTIONS" in os.environ:
            defaults["job_memory"] = 1e6  # GB: ThreadSanitizer maps 34 TB when a job starts
        for key, value in {**defaults, **(parameters or {})}.items():
            rospy.set_param("%s/%s" % (self.name, key), value)
        program = roslib.packages.find_node(PACKAGE, "diagnoser")[0]
        self._log = tempfile.TemporaryFile(mode="w+")
        self._process = subprocess.Popen(
            [program, "__name:=" + self.name[1:], "joint_states:=" + joint_states,
             "amplitude_distribution:=" + self.topic("amplitude_distribution"),
             "backlash_estimate:=" + self.topic("backlash_estimate")],
            stdout=self._log, stderr=subprocess.STDOUT)

    def topic(self, name):
        return "%s/%s" % (self.name, name)

    def file(self, name):
        """In the folder for files that goals name."""
        return os.path.join(self._folder.name, name)

    def distributions(self):
        return Inbox(self.topic("amplitude_distribution"), AmplitudeDistribution)

    def estimates(self):
        return Inbox(self.topic("backlash_estimate"), BacklashEstimate)

    def _service(self, name, service_type):
        rospy.wait_for_service(self.topic(name), TIMEOUT)
        return rospy.ServiceProxy(self.topic(name), service_type)

    def ready(self):
        self._service("diagnose", Diagnose)
        return self

    def diagnose(self, joint="", periods=0, timeout=0.0):
        return self._service("diagnose", Diagnose)(joint=joint, periods=periods, timeout=timeout)

    def set_baseline(self, joint="", clear=False):
        return self._service("set_baseline", SetBaseline)(joint=joint, clear=clear)

    def curve(self, joint=""):
        return self._service("get_curve", GetCurve)(joint=joint)

    def jobs(self):
        """Ids of the processes that work for it."""
        found = []
        for task in os.listdir("/proc/%d/task" % self._process.pid):
            with open("/proc/%d/task/%s/children" % (self._process.pid, task)) as stream:
                found += [int(child) for child in stream.read().split()]
        return found

    def alive(self):
        return self._process.poll() is None

    def kill(self):
        """As a power cut would end it."""
        self._process.kill()
        self._process.wait(TIMEOUT)

    def output(self):
        """What it has printed so far; its descriptor is shared, so its place is left alone."""
        return os.pread(self._log.fileno(), 1 << 20, 0).decode()

    def wait(self):
        code = self._process.wait(TIMEOUT)
        self._log.seek(0)
        return code, self._log.read()

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        if self.alive():
            self._process.send_signal(2)
            try:
                self._process.wait(TIMEOUT)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._log.close()
        self._folder.cleanup()


class Connected(rospy.SubscribeListener, threading.Event):
    """Set as soon as a publisher has a subscriber."""

    def __init__(self):
        rospy.SubscribeListener.__init__(self)
        threading.Event.__init__(self)

    def peer_subscribe(self, *unused):
        self.set()


def send(publisher, message, time, start=START):
    """Publishes a copy of the message, stamped `start` [s] + time [s]."""
    message = copy.deepcopy(message)
    seconds = int(time)
    message.header.stamp = rospy.Time(start + seconds, int(round((time - seconds) * 1e9)))
    publisher.publish(message)


class Diagnostics:
    """What /diagnostics says of a joint."""

    def __init__(self):
        self._inbox = Inbox("/diagnostics", DiagnosticArray)

    def wait_for(self, name, condition, what):
        """The first status whose name ends with `name` and that meets the condition(level, message, values)."""
        seen = [0]

        def found(messages):
            for message in messages[seen[0]:]:
                for status in message.status:
                    values = {v.key: v.value for v in status.values}
                    if status.name.endswith(name) and condition(status.level, status.message, values):
                        return status, values
            seen[0] = len(messages)
            return None
        return self._inbox.wait_for(found, "%s: %s" % (name, what))


def level(status_level):
    """Levels are bytes in Python 3."""
    return status_level[0] if isinstance(status_level, bytes) else status_level


def simulated_messages(folder, half_gap, duration=1.2, rate=1000):
    """Messages of a simulated run, without stamps, and their times [s]."""
    path = os.path.join(folder, "record.csv")
    run_tool("simulate", rig_path(), "--half-gap", half_gap, "--duration", duration, "--sample-rate", rate, "--out", path)
    with open(path, newline="") as stream:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(stream)]
    return [row["time"] for row in rows], [joint_state(row) for row in rows]


def joint_state(row):
    m = JointState()
    m.name = ["joint_motor", "joint_sensor"]
    m.position = [row["motor_position"], 0.0]
    m.effort = [row["motor_torque"], row["sensor_torque"]]
    return m
