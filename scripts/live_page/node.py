# SPDX-License-Identifier: BSD-3-Clause
"""Parameters and life of the node dashboard."""
import asyncio
import secrets
import signal
import socket
import sys

import rospy
from aiohttp import web

from .joints import Joints
from .robot import Robot
from .server import Server, is_local

HELP = """dashboard - one page with the joints of all diagnosers and change watches: verdict, interval against the limits,
history, changes, what could not be estimated; buttons for ~diagnose and ~set_baseline.

Parameters:
  ~address  where it listens; default 127.0.0.1: this machine alone. Another address needs the token that it then makes
            and prints, as part of the page's address; with it whoever reaches the port may look and press the buttons
  ~port     default 8088; 0: any that is free

It uses what the nodes publish, and can be started and killed at any time.
Exit codes: 0 ended, 64 wrong parameter, 73 the address cannot be used.
"""
USAGE, CANNOT_LISTEN = 64, 73
KNOWN = ("address", "port")


class Refused(Exception):
    pass


def parameters():
    given = rospy.get_param("~", {})
    unknown = sorted(set(given if isinstance(given, dict) else {}) - set(KNOWN))
    if unknown:
        raise Refused("~%s is not a parameter of dashboard; known are ~%s" % (unknown[0], ", ~".join(KNOWN)))
    address, port = rospy.get_param("~address", "127.0.0.1"), rospy.get_param("~port", 8088)
    if not isinstance(address, str) or not address:
        raise Refused("~address = %r: must be a name or address of this machine" % (address,))
    if isinstance(port, bool) or not isinstance(port, int) or not 0 <= port <= 65535:
        raise Refused("~port = %r: must be a whole number from 0 to 65535" % (port,))
    return address, port


def listening(address, port):
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.bind((address, port))
    return listener


async def serve(server, listener, url):
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    runner = web.AppRunner(server.application(), access_log=None)
    await runner.setup()
    await web.SockSite(runner, listener, shutdown_timeout=1).start()
    print("dashboard: " + url, flush=True)
    while not stop.is_set() and not rospy.is_shutdown():
        try:
            await asyncio.wait_for(stop.wait(), 0.5)
        except asyncio.TimeoutError:
            pass
    rospy.signal_shutdown("asked to end")
    await runner.cleanup()


def main():
    if any(a in ("-h", "--help") for a in sys.argv[1:]):
        sys.stdout.write(HELP)
        return 0
    rospy.init_node("dashboard", disable_signals=True)
    try:
        address, port = parameters()
    except Refused as error:
        rospy.logfatal("%s", error)
        return USAGE
    token = None if is_local(address) else secrets.token_urlsafe(24)
    try:
        listener = listening(address, port)
    except OSError as error:
        rospy.logfatal("~address %s, ~port %d cannot be used: %s; choose another ~port (0: any)", address, port, error.strerror or error)
        return CANNOT_LISTEN
    host = "[%s]" % address if ":" in address else address
    url = "http://%s:%d/%s" % (host, listener.getsockname()[1], "" if token is None else "?token=" + token)
    if token is not None:
        rospy.logwarn("the dashboard is open to whoever has its address with the token; it is not encrypted")
    joints = Joints()
    asyncio.run(serve(Server(joints, Robot(joints), address, token), listener, url))
    return 0
