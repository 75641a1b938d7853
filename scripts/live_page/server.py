# SPDX-License-Identifier: BSD-3-Clause
"""The page and its events by HTTP. Everybody on this machine may look and press the buttons; from elsewhere whoever has the
token, since ROS 1 itself asks nobody. A page of another site can neither read this one (Host is checked) nor press its buttons (a
header that only its own script sends)."""
import asyncio
import hmac
import ipaddress
import json
import os
import time

from aiohttp import web

FOLDER = os.path.dirname(os.path.realpath(__file__))
BEAT = 1          # s between events, also where nothing is new: a page that hears none has lost its server
COOKIE = "dashboard"
KINDS = {"page.js": "text/javascript", "page.css": "text/css"}
POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:"


def is_local(address):
    """Whether only this machine reaches it."""
    if address == "localhost":
        return True
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False


class Server:
    def __init__(self, joints, robot, address, token):
        self._joints, self._robot, self._address, self._token = joints, robot, address, token
        self._tasks = set()

    def application(self):
        app = web.Application(middlewares=[self._guard])
        app.add_routes([web.get("/", self._page), web.get("/page.js", self._file), web.get("/page.css", self._file),
                        web.get("/events", self._events), web.post("/diagnose", self._press),
                        web.post("/set_baseline", self._press)])
        return app

    @web.middleware
    async def _guard(self, request, handler):
        if self._token is None:
            if not is_local(request.host.rsplit(":", 1)[0].strip("[]")):
                raise web.HTTPForbidden(text="This page answers to localhost and 127.0.0.1 alone.\n")
        elif not self._knows_token(request):
            raise web.HTTPForbidden(text="The token is missing or wrong: open the address that the node printed.\n")
        response = await handler(request)
        if not response.prepared:
            response.headers.update({"Content-Security-Policy": POLICY, "X-Content-Type-Options": "nosniff",
                                     "Referrer-Policy": "no-referrer", "Cache-Control": "no-store"})
        return response

    def _knows_token(self, request):
        given = request.query.get("token") or request.cookies.get(COOKIE, "")
        return hmac.compare_digest(given.encode(), self._token.encode())

    async def _page(self, request):
        if self._token is not None and "token" in request.query:  # out of the address bar, into a cookie
            response = web.HTTPSeeOther("/")
            response.set_cookie(COOKIE, self._token, httponly=True, samesite="Strict")
            raise response
        return web.FileResponse(os.path.join(FOLDER, "page.html"))

    async def _file(self, request):
        name = request.path.strip("/")
        return web.FileResponse(os.path.join(FOLDER, name), headers={"Content-Type": KINDS[name]})

    async def _events(self, request):
        response = web.StreamResponse(headers={"Content-Type": "text/event-stream", "Cache-Control": "no-store"})
        await response.prepare(request)
        try:
            while True:
                state = {"time": time.time(), "master": self._robot.master, "joints": self._joints.as_json(time.time())}
                await response.write(("data: %s\n\n" % json.dumps(state)).encode())
                await asyncio.sleep(BEAT)
        except (ConnectionResetError, asyncio.CancelledError):
            pass
        return response

    async def _press(self, request):
        if request.headers.get("X-Button") != "1":
            raise web.HTTPForbidden(text="Only the page's own buttons are answered.\n")
        try:
            asked = await request.json()
            node, joint = asked["node"], asked["joint"]
        except (ValueError, KeyError, TypeError):
            raise web.HTTPBadRequest(text="expected {\"node\": ..., \"joint\": ...}\n")
        if (node, joint) not in self._joints.nodes() or node not in self._robot.diagnosers():
            raise web.HTTPNotFound(text="no diagnoser %s with joint %s is running\n" % (node, joint))
        call = self._robot.diagnose if request.path == "/diagnose" else self._robot.set_baseline
        await asyncio.get_running_loop().run_in_executor(None, call, node, joint)
        return web.json_response({})
