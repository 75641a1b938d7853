#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The nodes as processes, beside a bare roscpp subscriber in the same run: message rate, CPU, losses, lateness.

Starts a roscore of its own. Prints JSON in the form of Google Benchmark. The nodes and tools of the package and `messages`
(see messages.cpp) are found in the two folders given.
"""
import argparse
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time

RIG = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "config", "sarkar_1997.yaml")
FLOOD = 300_000  # messages
FLOOD_RATE = 5_000  # Hz, of their stamps
PATIENCE = 180  # s


class Machine:
    """All processes that are started, so that all end."""

    def __init__(self, folders):
        self.folders = folders
        self.processes = []
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.env = dict(os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1")
        self.env.pop("ROS_HOSTNAME", None)
        os.environ.update(self.env)
        self.start("roscore", "-p", str(port))
        self.wait_for(lambda: self.run("rosparam", "list", check=False).returncode == 0, "roscore")

    def path(self, program):
        for folder in self.folders:
            if os.path.exists(os.path.join(folder, program)):
                return os.path.join(folder, program)
        return program

    def start(self, program, *words, core=None):
        """A node; only what `messages` prints is read, and by stop()."""
        output = subprocess.PIPE if program == "messages" else subprocess.DEVNULL
        command = [self.path(program), *words]
        if core is not None:
            command = ["taskset", "-c", str(core)] + command
        process = subprocess.Popen(command, env=self.env, stdout=output, stderr=subprocess.DEVNULL, text=True)
        self.processes.append(process)
        return process

    def run(self, program, *words, check=True):
        return subprocess.run([self.path(program), *words], env=self.env, check=check, text=True, timeout=PATIENCE,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def wait_for(self, condition, what):
        end = time.monotonic() + PATIENCE
        while not condition():
            for process in self.processes:
                if process.poll() is not None and process.returncode != 0:
                    raise RuntimeError(f"{process.args[0]} ended with {process.returncode}")
            if time.monotonic() > end:
                raise TimeoutError(f"{what} did not come within {PATIENCE} s")
            time.sleep(0.05)

    def stop(self, process):
        """Interrupts it; what it has printed."""
        process.send_signal(signal.SIGINT)
        printed = process.communicate(timeout=PATIENCE)[0]
        self.processes.remove(process)
        return printed

    def stop_all(self):
        for process in reversed(list(self.processes)):
            try:
                self.stop(process)
            except subprocess.TimeoutExpired:
                process.kill()

    def publish(self, rate, count, joints, process):
        done = self.run("messages", "publish", str(rate), str(count), str(joints), str(process.pid), check=False)
        return json.loads(done.stdout)

    def diagnostics(self, name):
        """The values of the second status from now: the first may be from before."""
        import rospy  # after ROS_MASTER_URI is known
        from diagnostic_msgs.msg import DiagnosticArray
        found = []
        if not rospy.core.is_initialized():
            rospy.init_node("benchmark", anonymous=True, disable_signals=True)
        subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, lambda message: found.extend(
            status for status in message.status if status.name.endswith(name)))
        try:
            self.wait_for(lambda: len(found) > 1, f"status {name}")
        finally:
            subscriber.unregister()
        return {value.key: value.value for value in found[1].values}


def name_joints(machine, node, number):
    """As a parameter: roscpp takes no lists from the command line."""
    machine.run("rosparam", "set", f"/{node}/joints", "[" + ", ".join(f"joint_{j}" for j in range(number)) + "]")


def diagnoser(machine, curve, joints=1):
    if joints > 1:
        name_joints(machine, "diagnoser", joints)
    process = machine.start("diagnoser", f"_curve:={curve}", "_queue:=10000000")
    machine.wait_for(lambda: "/joint_states" in machine.run("rosnode", "info", "/diagnoser", check=False).stdout,
                     "the diagnoser's subscription")
    return process


def end_diagnoser(machine, process):
    machine.stop(process)
    machine.run("rosparam", "delete", "/diagnoser", check=False)


def flood(machine, curves):
    """Messages per second that are handled when they come as fast as they go."""
    bare = machine.start("messages", "bare", str(FLOOD))
    yield {"name": "nodes/bare/flood", **rate(machine.publish(-FLOOD_RATE, FLOOD, 1, bare), FLOOD)}
    machine.stop(bare)
    node = diagnoser(machine, curves[FLOOD_RATE])
    yield {"name": "nodes/diagnoser/flood", **rate(machine.publish(-FLOOD_RATE, FLOOD, 1, node), FLOOD),
           **accepted(machine, FLOOD)}
    end_diagnoser(machine, node)


def rate(result, count):
    return {"handled": result["handled"], "messages_per_s": count / result["seconds"],
            "us_per_message": 1e6 * result["cpu_seconds"] / count}


def accepted(machine, count):
    return {"lost": count - int(machine.diagnostics("joint: input")["Samples accepted"])}


def at_rate(machine, curves, hertz, seconds):
    count = hertz * seconds
    bare = machine.start("messages", "bare", str(count))
    yield {"name": f"nodes/bare/{hertz}_Hz", **rate(machine.publish(hertz, count, 1, bare), count)}
    machine.stop(bare)
    node = diagnoser(machine, curves[hertz])
    yield {"name": f"nodes/diagnoser/{hertz}_Hz", **rate(machine.publish(hertz, count, 1, node), count),
           **accepted(machine, count)}
    end_diagnoser(machine, node)


def median_of(rounds):
    """Of several rounds of the same measurements the one with the median cost: single ones differ by 20 %."""
    for results in zip(*rounds):
        yield sorted(results, key=lambda result: result["us_per_message"])[len(results) // 2]


def joints(machine, curves, hertz, seconds):
    """CPU per sample of a joint, of one to 64 joints in the same messages."""
    for number in (1, 4, 16, 64):
        node = diagnoser(machine, curves[hertz], number)
        result = machine.publish(hertz, hertz * seconds, number, node)
        yield {"name": f"nodes/diagnoser/{number}_joints", "handled": result["handled"],
               "us_per_joint_sample": 1e6 * result["cpu_seconds"] / (hertz * seconds * number)}
        end_diagnoser(machine, node)


def simulator(machine, name, *words):
    """On one core; a subscriber beside it."""
    listener = machine.start("messages", "latency")
    node = machine.start("simulator", *words, core=0)
    machine.wait_for(lambda: "simulator" in machine.run("rosnode", "list", check=False).stdout, "the simulator")
    time.sleep(12)  # of running
    values = machine.diagnostics("simulation")
    before, start = cpu(node), time.monotonic()
    time.sleep(5)
    share = (cpu(node) - before) / (time.monotonic() - start)
    machine.stop(node)
    late = json.loads(machine.stop(listener))
    machine.run("rosparam", "delete", "/simulator", check=False)
    return {"name": f"nodes/simulator/{name}", "cpu_share": share,
            "real_time_factor": float(values["real time factor reached"]), **late}


def cpu(process):
    """Seconds of all threads."""
    folder = f"/proc/{process.pid}/task"
    return sum(int(open(f"{folder}/{task}/schedstat", encoding="ascii").read().split()[0])
               for task in os.listdir(folder)) * 1e-9


def measure(machine, folder):
    curves = {}
    for hertz in (1000, FLOOD_RATE, 20_000):
        curves[hertz] = os.path.join(folder, f"curve_{hertz}.yaml")
        machine.run("build_curve", RIG, "--points", "11", "--periods", "3", "--seeds", "4", "--sample-rate", str(hertz),
                    "--out", curves[hertz])
    yield from flood(machine, curves)
    yield from median_of([list(at_rate(machine, curves, 1000, 20)) for _ in range(5)])
    yield from at_rate(machine, curves, 20_000, 10)
    yield from joints(machine, curves, 1000, 10)
    name_joints(machine, "simulator", 32)
    yield simulator(machine, "32_joints_1000_Hz", "_sampling_rate:=1000")
    yield simulator(machine, "1_joint_10000_Hz", "_sampling_rate:=10000")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs=2, help="where the package's executables and where those of benchmark/ are")
    options = parser.parse_args()
    machine = Machine(options.folders)
    results = []
    try:
        with tempfile.TemporaryDirectory() as folder:
            for result in measure(machine, folder):
                print(result, file=sys.stderr)
                results.append({**result, "time_unit": "us"})
    finally:
        machine.stop_all()
    print(json.dumps({"benchmarks": results}))


if __name__ == "__main__":
    main()
