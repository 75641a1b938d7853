#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A slow, lossy link between two network namespaces, in user space: not every kernel has netem.

Usage (as root): link.py NAMESPACE ADDRESS NAMESPACE ADDRESS DELAY JITTER LOSS SEED   (s, s, share)
A TUN device `link` in each namespace; each packet is lost or held back on its own. SIGUSR1 cuts the link, SIGUSR2
mends it. Prints "ready", and at its end how many packets went through and how many it lost.
"""
import fcntl
import heapq
import os
import random
import selectors
import signal
import struct
import subprocess
import sys
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454ca, 0x0001, 0x1000


def open_device(namespace, address, peer):
    """Made here and moved there: a device stays with the descriptor that made it."""
    name = "bl%d" % (os.getpid() % 10 ** 6) + address.rsplit(".", 1)[1]
    device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH14s", name.encode(), IFF_TUN | IFF_NO_PI, b""))
    inside = ["ip", "netns", "exec", namespace, "ip"]
    for words in (["ip", "link", "set", name, "netns", namespace],
                  inside + ["addr", "add", address, "peer", peer, "dev", name],
                  inside + ["link", "set", name, "up"], inside + ["link", "set", "lo", "up"]):
        subprocess.run(words, check=True)
    return device


class Link:
    def __init__(self, devices, delay, jitter, loss, seed):
        self.other = {devices[0]: devices[1], devices[1]: devices[0]}
        self.delay, self.jitter, self.loss = delay, jitter, loss
        self.random = random.Random(seed)
        self.cut = False
        self.waiting = []  # (when, number, device, packet)
        self.carried = self.lost = 0

    def take(self, device):
        while True:
            try:
                packet = os.read(device, 65536)
            except BlockingIOError:
                return
            if self.cut or self.random.random() < self.loss:
                self.lost += 1
                continue
            when = time.monotonic() + max(0, self.random.uniform(self.delay - self.jitter, self.delay + self.jitter))
            heapq.heappush(self.waiting, (when, self.carried, self.other[device], packet))
            self.carried += 1

    def give(self):
        """Sends what is due; how long until the next is."""
        while self.waiting:
            wait = self.waiting[0][0] - time.monotonic()
            if wait > 0:
                return wait
            _, _, device, packet = heapq.heappop(self.waiting)
            try:
                os.write(device, packet)
            except OSError:
                self.lost += 1
        return 1


def main():
    first, second = (sys.argv[1], sys.argv[2]), (sys.argv[3], sys.argv[4])
    devices = [open_device(*first, second[1]), open_device(*second, first[1])]
    link = Link(devices, *[float(word) for word in sys.argv[5:8]], int(sys.argv[8]))
    running = [True]
    signal.signal(signal.SIGUSR1, lambda *_: setattr(link, "cut", True))
    signal.signal(signal.SIGUSR2, lambda *_: setattr(link, "cut", False))
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: running.clear())
    ready = selectors.DefaultSelector()
    for device in devices:
        ready.register(device, selectors.EVENT_READ)
    print("ready", flush=True)
    while running:
        for key, _ in ready.select(min(1, link.give())):
            link.take(key.fd)
    print("%d packets carried, %d lost" % (link.carried, link.lost), flush=True)


if __name__ == "__main__":
    main()
