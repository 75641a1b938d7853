# SPDX-License-Identifier: BSD-3-Clause
"""A ROS master of the campaign's own on a free port, on loopback only."""
import os
import socket
import subprocess
import sys
import time
import xmlrpc.client

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "ros"))

STARTED_WITHIN = 60  # s; it takes 2 s on an idle machine


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Master:
    def __init__(self, port=None):
        self.port = port or free_port()
        self.uri = "http://localhost:%d" % self.port
        os.environ.update(ROS_MASTER_URI=self.uri, ROS_HOSTNAME="localhost")
        os.environ.pop("ROS_IP", None)
        self._process = None
        self.start()

    def start(self):
        """Without rosout and roslaunch: they run in groups of their own, and a crash takes the master alone."""
        self._process = subprocess.Popen(["rosmaster", "--core", "-p", str(self.port)], stdout=subprocess.DEVNULL,
                                         stderr=subprocess.DEVNULL)
        end = time.monotonic() + STARTED_WITHIN
        while not self.answers():
            if time.monotonic() > end or self._process.poll() is not None:
                raise RuntimeError("rosmaster does not start on port %d" % self.port)
            time.sleep(0.05)

    def answers(self):
        try:
            return xmlrpc.client.ServerProxy(self.uri).getPid("/campaign")[0] == 1
        except OSError:
            return False

    def kill(self):
        """As a crash: no node is informed."""
        self._process.kill()
        self._process.wait()

    def stop(self):
        if self._process.poll() is None:
            self._process.terminate()
            self._process.wait()

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.stop()
