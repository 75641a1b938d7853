# SPDX-License-Identifier: BSD-3-Clause
"""Processes of a ROS graph of its own: roscore, simulator, diagnoser, each perhaps in a network namespace."""
import os
import signal
import subprocess
import tempfile
import time

REPO = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
RIG = os.path.join(REPO, "config", "sarkar_1997.yaml")
JOINTS = {"base": 1.0e-5, "shoulder": 4.0e-5, "elbow": 7.0e-5}  # m, half gaps, as launch/three_joints.launch
ACCURACY = 3e-6  # m, of an answer
PATIENCE = 180  # s, for anything that should come


class Machine:
    """What it starts, it ends. `hosts` maps a name to the words before a command and to its environment."""

    def __init__(self, hosts):
        self.hosts = hosts
        self.folder = tempfile.TemporaryDirectory(prefix="backlash_soak_")
        self.processes = []

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        for process in reversed(self.processes):
            self.stop(process)
        self.folder.cleanup()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def _words(self, host, words):
        before, environment = self.hosts[host]
        return before + list(words), dict(os.environ, ROS_HOME=self.path("ros"), **environment)

    def start(self, host, *words):
        words, environment = self._words(host, words)
        log = open(self.path("log%d" % len(self.processes)), "wb")
        process = subprocess.Popen(words, env=environment, stdout=log, stderr=subprocess.STDOUT,
                                   start_new_session=True)
        process.log = log.name
        log.close()
        self.processes.append(process)
        return process

    def node(self, host, name, **parameters):
        words = ["_%s:=%s" % item for item in parameters.items()]
        return self.start(host, os.path.join(self.binaries(), name), *words)

    @staticmethod
    def binaries():
        for folder in os.environ["CMAKE_PREFIX_PATH"].split(":"):
            path = os.path.join(folder, "lib", "backlash_diagnosis")
            if os.path.exists(os.path.join(path, "diagnoser")):
                return path
        raise SystemExit("the workspace is not in CMAKE_PREFIX_PATH: source its setup.bash")

    def run(self, host, *words, check=True):
        words, environment = self._words(host, words)
        return subprocess.run(words, env=environment, check=check, text=True, timeout=PATIENCE,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT).stdout

    def roscore(self, host, port):
        process = self.start(host, "roscore", "-p", str(port))
        self.wait_for(lambda: "/rosdistro" in self.run(host, "rosparam", "list", check=False), "roscore", process)

    def curve(self, host, rate):
        self.run(host, os.path.join(self.binaries(), "build_curve"), RIG, "--out", self.path("curve.yaml"),
                 "--sample-rate", str(rate))
        return self.path("curve.yaml")

    def wait_for(self, condition, what, *processes, patience=PATIENCE):
        end = time.monotonic() + patience
        while not condition():
            for process in processes:
                if process.poll() is not None:
                    raise RuntimeError("%s ended with %d: %s" % (what, process.returncode, self.said(process)))
            if time.monotonic() > end:
                raise TimeoutError("%s did not come within %g s" % (what, patience))
            time.sleep(0.05)

    @staticmethod
    def said(process):
        with open(process.log, errors="replace") as log:
            return log.read()[-2000:]

    @staticmethod
    def stop(process):
        """All of its session, which holds nothing else: a roscore has children."""
        for number in (signal.SIGINT, signal.SIGKILL):
            try:
                os.killpg(process.pid, number)
                process.wait(20)
                return
            except ProcessLookupError:
                return
            except subprocess.TimeoutExpired:
                continue


def table(rows):
    """Rows of (what, measured, passed)."""
    lines = ["| what | measured | |", "|---|---|---|"]
    lines += ["| %s | %s | %s |" % (what, measured, "ok" if passed else "FAILED") for what, measured, passed in rows]
    return "\n".join(lines)
