#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Soak: three simulated joints at 1 kHz and one diagnoser, for long and as fast as the machine takes.

Counts what was published, taken and answered, and watches the memory. Exit codes: 0 all as it should be, 1 not.
"""
import argparse
import json
import os
import socket
import statistics
import sys
import time

import machine

RATE = 1000  # Hz
GROWTH = 2.0  # MiB over the run that count as none: an allocator's arenas settle
FACTORS = (16, 12, 8, 6, 4, 3, 2, 1)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def memory(process):
    """Resident set [MiB]."""
    with open("/proc/%d/status" % process.pid) as status:
        for line in status:
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) / 1024
    return None


def robust_slope(times, values):
    """Theil and Sen, of at most 200 medians."""
    size = max(1, len(times) // 200)
    cut = range(0, len(times) - size + 1, size)
    times = [statistics.median(times[i:i + size]) for i in cut]
    values = [statistics.median(values[i:i + size]) for i in cut]
    return statistics.median((values[i] - values[j]) / (times[i] - times[j])
                             for i in range(len(times)) for j in range(i))


class Listener:
    """What the nodes report on their topics."""

    def __init__(self):
        import rospy
        from diagnostic_msgs.msg import DiagnosticArray
        from backlash_diagnosis.msg import BacklashEstimate
        rospy.init_node("soak", anonymous=True, disable_signals=True)
        self.status, self.estimates = {}, {}
        self._subscribers = [rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics),
                             rospy.Subscriber("backlash_estimate", BacklashEstimate, self._on_estimate)]

    def _on_diagnostics(self, message):
        for status in message.status:
            self.status[status.name] = (status.level, status.message, {v.key: v.value for v in status.values})

    def _on_estimate(self, message):
        self.estimates.setdefault((message.joint, message.method), []).append(message.header.stamp.to_sec())

    def number(self, joint, key):
        """From whichever status of the joint has it; None before there is one."""
        for name, (_, _, values) in list(self.status.items()):
            if joint + ": " in name and key in values:
                return int(float(values[key]))
        return None

    def clear(self):
        self.status.clear()
        self.estimates.clear()


def configure(m, seconds, factor):
    m.run("here", "rosparam", "delete", "/simulator", check=False)
    m.run("here", "rosparam", "delete", "/diagnoser", check=False)
    joints = "[" + ", ".join(machine.JOINTS) + "]"
    settings = {"joints": joints, "rig": machine.RIG, "sampling_rate": "%g" % RATE, "duration": "%g" % seconds,
                "real_time_factor": "%g" % factor, "wait_for_subscriber": "true", "publish_clock": "false"}
    text = ", ".join("%s: %s" % item for item in settings.items())
    text += "".join(", %s: {half_gap: %.9f}" % item for item in machine.JOINTS.items())
    m.run("here", "rosparam", "set", "/simulator", "{%s}" % text)
    m.run("here", "rosparam", "set", "/diagnoser", "{joints: %s, rig: %s}" % (joints, machine.RIG))


def run(m, listener, curve, seconds, factor, history=None):
    """One run. The diagnoser lives on for the caller; also the memory of both over wall time."""
    configure(m, seconds, factor)
    listener.clear()
    extra = {"history": history} if history else {}
    diagnoser = m.node("here", "diagnoser", curve=curve, **extra)
    m.wait_for(lambda: listener.number("elbow", "Samples accepted") is not None, "the diagnoser", diagnoser)
    start = time.monotonic()
    simulator = m.node("here", "simulator")
    samples = {simulator: [], diagnoser: []}
    expected = seconds / factor
    while simulator.poll() is None:
        if diagnoser.poll() is not None:
            raise RuntimeError("the diagnoser ended with %d" % diagnoser.returncode)
        now = time.monotonic() - start
        if now > 3 * expected + machine.PATIENCE:
            raise TimeoutError("the simulator does not end")
        for process in samples:
            size = memory(process)
            if size is not None:
                samples[process].append((now, size))
        time.sleep(min(0.5, expected / 200))
    took = time.monotonic() - start
    if simulator.returncode != 0:
        raise RuntimeError("the simulator ended with %d: %s" % (simulator.returncode, m.said(simulator)))
    # The counters stand still once all is taken.
    total = round(seconds * RATE)
    end = time.monotonic() + 15
    while counted(listener) < 3 * total and time.monotonic() < end:
        time.sleep(0.2)
    return diagnoser, took, samples[simulator], samples[diagnoser]


def counted(listener):
    return sum(listener.number(joint, "Samples accepted") or 0 for joint in machine.JOINTS)


def highest_factor(m, listener, curve):
    """That a short run takes without loss and in time, with a fifth to spare."""
    seconds = 40
    for factor in FACTORS:
        diagnoser, took, _, _ = run(m, listener, curve, seconds, factor)
        lost = 3 * seconds * RATE - counted(listener)
        m.stop(diagnoser)
        print("%g times real time: %d samples lost, %.1f s" % (factor, lost, took), file=sys.stderr)
        if lost == 0 and took < 1.2 * seconds / factor + 2:
            return 0.8 * factor if factor > 1 else 1
    return 1


def grown(samples):
    """MiB after the first tenth, by the slope of a line that outliers cannot turn."""
    end = samples[-1][0]
    late = [s for s in samples if s[0] >= 0.1 * end]
    return robust_slope([t for t, _ in late], [v for _, v in late]) * (late[-1][0] - late[0][0]), late


def memory_row(name, samples):
    growth, late = grown(samples)
    text = "%.1f MiB after a tenth, %.1f at the end; robust slope %+.3f MiB over the run" % (
        late[0][1], late[-1][1], growth)
    return ("memory of the %s" % name, text, growth < GROWTH), growth


def estimate_rows(listener, seconds):
    """Running estimates come at equal distances of their stamps, so that a missing one is a hole."""
    rows, counts = [], {}
    distance = None
    for (joint, method), stamps in sorted(listener.estimates.items()):
        steps = [b - a for a, b in zip(stamps, stamps[1:])]
        distance = distance or statistics.median(steps)
        due = int(seconds / distance)
        holes = sum(abs(step - distance) > 0.01 for step in steps)
        counts[joint + " " + method] = {"delivered": len(stamps), "due": due, "holes": holes}
    delivered = sum(c["delivered"] for c in counts.values())
    due = sum(c["due"] for c in counts.values())
    # The first comes once the machine has settled and the window is full, the last may be under way: 2 s.
    enough = all(c["holes"] == 0 and c["delivered"] >= c["due"] - 2 / distance for c in counts.values())
    rows.append(("running estimates (%d joints, %d series, each %.3g s)" % (
        len(machine.JOINTS), len(counts), distance or 0), "%d delivered of %d from the first to the last second, %d "
        "missing between" % (delivered, due, sum(c["holes"] for c in counts.values())), bool(counts) and enough))
    return rows, counts


def answers(m):
    import rospy
    from backlash_diagnosis.srv import Diagnose
    ask = rospy.ServiceProxy("/diagnoser/diagnose", Diagnose)
    ask.wait_for_service(machine.PATIENCE)
    rows, found = [], {}
    for joint, half_gap in machine.JOINTS.items():
        answer = ask(joint, 0, 10.0)
        v = answer.verdict
        good = answer.success and abs(v.backlash - 2 * half_gap) <= machine.ACCURACY
        rows.append(("answer for %s, true %.0f um" % (joint, 2e6 * half_gap), "%.1f um (%.1f to %.1f)" % (
            1e6 * v.backlash, 1e6 * v.lower, 1e6 * v.upper), good))
        found[joint] = {"true": 2 * half_gap, "backlash": v.backlash, "interval": [v.lower, v.upper],
                        "message": answer.message}
    return rows, found


def sample_rows(listener, seconds):
    total = round(seconds * RATE)
    rows, counts = [], {}
    keys = ("Samples accepted", "Samples with NaN", "Repeated stamps", "Clock jumps", "Malformed messages")
    for joint in machine.JOINTS:
        found = {key: listener.number(joint, key) or 0 for key in keys}
        counts[joint] = found
        missing = total - found["Samples accepted"] - found["Samples with NaN"] - found["Repeated stamps"]
        rows.append(("samples of %s" % joint, "%d published, %d accepted, %d left out, %d unaccounted for" % (
            total, found["Samples accepted"], found["Samples with NaN"] + found["Repeated stamps"], missing),
            missing == 0 and found["Clock jumps"] == 0 and found["Malformed messages"] == 0))
    return rows, counts


def history_rows(m, folder):
    rows = []
    for joint in machine.JOINTS:
        path = os.path.join(folder, joint + ".csv")
        with open(path) as lines:
            text = lines.read().splitlines()
        whole = all(len(line.split(",")) == 13 for line in text)
        rows.append(("history of %s" % joint, "%d entries, %s" % (len(text) - 1, "all whole" if whole else "damaged"),
                     whole and len(text) > 1))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seconds", nargs="?", type=float, default=3600, help="simulated time; default 3600")
    parser.add_argument("--factor", type=float, help="times real time; default: the highest that loses nothing")
    parser.add_argument("--json", default="soak.json", help="report to write; default soak.json")
    arguments = parser.parse_args()
    if arguments.seconds < 60:
        parser.error("seconds = %g: must be at least 60" % arguments.seconds)
    port = free_port()
    environment = {"ROS_MASTER_URI": "http://127.0.0.1:%d" % port, "ROS_IP": "127.0.0.1"}
    os.environ.pop("ROS_HOSTNAME", None)
    os.environ.update(environment)
    with machine.Machine({"here": ([], environment)}) as m:
        m.roscore("here", port)
        curve = m.curve("here", RATE)
        listener = Listener()
        factor = arguments.factor or highest_factor(m, listener, curve)
        keeps = "history" in m.run("here", os.path.join(m.binaries(), "diagnoser"), "--help")
        history = m.path("history") if keeps else None
        if history:
            os.mkdir(history)
        diagnoser, took, simulated, diagnosed = run(m, listener, curve, arguments.seconds, factor, history)
        rows = [("simulated time", "%.0f s in %.0f s of wall time, %.1f times real time" % (
            arguments.seconds, took, arguments.seconds / took), True)]
        first, growth_s = memory_row("simulator", simulated)
        second, growth_d = memory_row("diagnoser", diagnosed)
        samples, counts = sample_rows(listener, arguments.seconds)
        estimates, series = estimate_rows(listener, arguments.seconds)
        last, found = answers(m)
        rows += [first, second] + samples + estimates + last + (history_rows(m, history) if history else [])
        report = {"schema_version": 1, "seconds": arguments.seconds, "wall_time": took, "factor": factor,
                  "memory": {"simulator": simulated, "diagnoser": diagnosed}, "samples": counts, "estimates": series,
                  "memory_growth": {"simulator": growth_s, "diagnoser": growth_d}, "answers": found,
                  "table": [list(row) for row in rows]}
    with open(arguments.json, "w") as out:
        json.dump(report, out, indent=1)
    print(machine.table(rows))
    sys.exit(0 if all(row[2] for row in rows) else 1)


if __name__ == "__main__":
    main()
