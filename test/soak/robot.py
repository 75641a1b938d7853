#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Soak of the simulated robot: simulated_robot.launch with its diagnoser and change_watch, and two changes that come late.

Counts how old the running estimates ever were, what was cried of healthy joints, when the changes were reported, and the
memory of the nodes. Exit codes: 0 all as it should be, 1 not.
"""
import argparse
import json
import os
import shutil
import statistics
import sys
import threading
import time

import machine
import soak

PACE = 5  # times real time
OLDEST = 30  # s of wall time, of a running estimate
SEEN = 120  # s of wall time, until a change is reported: two looks, one each 60 s of motion, and the time they take
LEARN = 300  # s of motion
PLAY = {"shoulder": 5.4e-4, "elbow": 5.4e-4}  # rad, of the rig files
WORN = 1.3e-3  # rad: between the limits `service` and `stop`
ADDED = 0.8  # N m of dry friction, of 4
GROWTH = 2.0  # MiB, from one half of the run to the other, that count as none
NODES = ("simulator", "diagnoser", "change_watch")


class Watch:
    """What the nodes say, and when [s of wall time]."""

    def __init__(self):
        import rospy
        from backlash_diagnosis.msg import BacklashEstimate, ChangeReport
        from diagnostic_msgs.msg import DiagnosticArray
        rospy.init_node("soak", anonymous=True, disable_signals=True)
        self.lock = threading.Lock()
        self.last, self.oldest, self.estimates = {}, {}, {}  # by joint
        self.news, self.warned, self.status = [], [], {}
        self._subscribers = [rospy.Subscriber("/backlash_estimate", BacklashEstimate, self._on_estimate),
                             rospy.Subscriber("/changes", ChangeReport, self._on_changes),
                             rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics)]

    def _on_estimate(self, message):
        if message.status != message.OK:
            return
        now = time.monotonic()
        with self.lock:
            joint = message.joint
            self.oldest[joint] = max(self.oldest.get(joint, 0), now - self.last.get(joint, now))
            self.last[joint] = now
            self.estimates[joint] = self.estimates.get(joint, 0) + 1

    def _on_changes(self, message):
        with self.lock:
            self.news += [(time.monotonic(), change) for change in message.news]

    def _on_diagnostics(self, message):
        with self.lock:
            for status in message.status:
                before = self.status.get(status.name)
                self.status[status.name] = (status.level, status.message)
                of_machine = status.name.endswith((": model", ": backlash"))  # of the others this computer is the cause
                if of_machine and status.level in (1, 2) and (before is None or before[0] != status.level):
                    self.warned.append((time.monotonic(), status.name, status.message))

    def begin(self):
        """What was said while the robot was learned does not count."""
        with self.lock:
            self.last, self.oldest, self.estimates = {}, {}, {}
            self.news, self.warned, self.status = [], [], {}

    def age(self, joint):
        """The oldest that its newest running estimate ever was."""
        with self.lock:
            return max(self.oldest.get(joint, 0), time.monotonic() - self.last.get(joint, float("-inf")))

    def learned(self):
        with self.lock:
            models = [s for name, s in self.status.items() if name.endswith(": model")]
        return len(models) == 3 and all(level == 0 for level, _ in models)

    def reported(self, joint, effect, since):
        """When the change stood in a report, after `since`; None: not yet."""
        with self.lock:
            return next((at - since for at, c in self.news if at > since and (c.joint, c.effect) == (joint, effect)), None)

    def graded(self, joint, grade):
        with self.lock:
            return any(joint in name and message.startswith(grade) for name, (_, message) in self.status.items())


def services():
    import rospy
    from backlash_diagnosis.srv import SetBacklash, SetRig
    return (rospy.ServiceProxy("/simulator/shoulder/set_backlash", SetBacklash),
            rospy.ServiceProxy("/simulator/wrist/set_rig", SetRig))


def stiffer_wrist():
    with open(os.path.join(machine.REPO, "config", "simulated_robot", "wrist.yaml")) as text:
        return text.read().replace("coulomb_friction: 4 ", "coulomb_friction: %g " % (4 + ADDED))


def change_row(what, took):
    return ("%s reported" % what, "never" if took is None else "after %.0f s" % took, took is not None and took <= SEEN)


class Run:
    """The launched robot, its watch, and the memory of its nodes."""

    def __init__(self, m, seconds):
        self.m, self.watch = m, None
        self.seconds, self.memory = seconds, {node: [] for node in NODES}
        self.history = m.path("history")
        os.mkdir(self.history)
        self.launch = m.start("here", "roslaunch", "backlash_diagnosis", "simulated_robot.launch",
                              "real_time_factor:=%g" % PACE, "changes:=true", "learn:=%g" % LEARN,
                              "history:=" + self.history)

    def begin(self):
        self.m.wait_for(lambda: "/simulator/wrist/set_rig" in self.m.run("here", "rosservice", "list", check=False),
                        "the robot", self.launch)
        self.watch = Watch()
        self.processes = {node: pid_of(node) for node in NODES}
        self.m.wait_for(self.watch.learned, "the healthy robot", self.launch, patience=600)
        self.watch.begin()
        self.start = time.monotonic()

    def until(self, share):
        while time.monotonic() - self.start < share * self.seconds:
            if self.launch.poll() is not None:
                raise RuntimeError("the launch ended: " + self.m.said(self.launch))
            for node, pid in self.processes.items():
                self.memory[node].append((time.monotonic() - self.start, resident(pid)))
            time.sleep(1)


def pid_of(node):
    """Of the running node, by its command line."""
    mine = os.environ["ROS_MASTER_URI"].encode()
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open("/proc/%s/cmdline" % pid, "rb") as line, open("/proc/%s/environ" % pid, "rb") as environment:
                if line.read().startswith(os.path.join(machine.Machine.binaries(), node).encode()) and \
                        mine in environment.read():
                    return int(pid)
        except OSError:
            continue
    raise RuntimeError("%s does not run" % node)


def resident(pid):
    with open("/proc/%d/status" % pid) as status:
        return int(next(line for line in status if line.startswith("VmRSS:")).split()[1]) / 1024


def robot_rows(run, folder):
    watch = run.watch
    set_backlash, set_rig = services()
    run.until(0.6)
    cried = [c.text for _, c in watch.news] + ["%s: %s" % w[1:] for w in watch.warned]
    if cried:  # what it saw, for whoever asks why
        shutil.copytree(run.m.path("ros/backlash_diagnosis"), folder, dirs_exist_ok=True)
    rows = [("cried of the healthy robot", "; ".join(cried) or "nothing", not cried)]
    worn = time.monotonic()
    set_backlash(WORN)
    run.until(0.8)
    rows.append(("grade of the worn shoulder on /diagnostics", "service" if watch.graded("shoulder", "service") else
                 "another", watch.graded("shoulder", "service")))
    rows.append(change_row("backlash of the shoulder", watch.reported("shoulder", "backlash", worn)))
    stiff = time.monotonic()
    answer = set_rig(stiffer_wrist())
    assert answer.success, answer.message
    run.until(1.0)
    rows.append(change_row("friction of the wrist", watch.reported("wrist", "motor_coulomb", stiff)))
    other = [c.text for _, c in watch.news if (c.joint, c.effect) not in
             {("shoulder", "backlash"), ("wrist", "motor_coulomb")}]
    rows.append(("other changes reported", "; ".join(other) or "none", not other))
    for joint in PLAY:
        rows.append(("running estimates of the %s" % joint, "%d, the oldest %.0f s old" % (
            watch.estimates.get(joint, 0), watch.age(joint)), watch.age(joint) <= OLDEST))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("minutes", nargs="?", type=float, default=30, help="of wall time, after it has learned; default 30")
    parser.add_argument("--json", default="soak_robot.json", help="report to write; default soak_robot.json; records of what it cried beside it")
    arguments = parser.parse_args()
    if arguments.minutes < 10:
        parser.error("minutes = %g: must be at least 10, as each change has a fifth of them" % arguments.minutes)
    port = soak.free_port()
    environment = {"ROS_MASTER_URI": "http://127.0.0.1:%d" % port, "ROS_IP": "127.0.0.1"}
    os.environ.pop("ROS_HOSTNAME", None)
    os.environ.update(environment)
    with machine.Machine({"here": ([], environment)}) as m:
        m.roscore("here", port)
        run = Run(m, 60 * arguments.minutes)
        run.begin()
        rows = robot_rows(run, os.path.splitext(arguments.json)[0] + "_cried")
        for node in NODES:
            late = [size for at, size in run.memory[node] if at >= 0.2 * run.seconds]
            middle, end = (statistics.median(late[k:k + len(late) // 2]) for k in (0, len(late) // 2))
            rows.append(("memory of the %s" % node, "%.1f MiB, later %.1f (medians)" % (middle, end),
                         end - middle < GROWTH))
        page = m.path("day.html")
        said = m.run("here", os.path.join(m.binaries(), "day_report"), run.history, "--out", page, check=False)
        rows.append(("page of the day", said.strip().splitlines()[-1] if said.strip() else "", os.path.exists(page)))
    with open(arguments.json, "w") as out:
        json.dump({"schema_version": 1, "minutes": arguments.minutes, "table": [list(row) for row in rows],
                   "memory": run.memory}, out, indent=1)
    print(machine.table(rows))
    sys.exit(0 if all(row[2] for row in rows) else 1)


if __name__ == "__main__":
    main()
