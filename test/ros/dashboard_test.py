#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The node dashboard, seen in a browser beside the simulated robot: what is set on the robot stands on the page, the buttons call
the services, a page whose server was killed says so, and nobody without the token gets anything from outside this machine."""
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.request

import roslib.packages
import rospy
import rostest
from backlash_diagnosis.srv import SetBacklash
from simulator_support import PACKAGE, TIMEOUT, package_folder, until

sys.path.insert(0, os.path.join(package_folder(), "test", "tools"))
import look_at_pages  # noqa: E402

NEW, WORN = 0.54, 1.3  # mrad: that of the rig files; one between their limits of service and stop


class Dashboard:
    """The node as a process of its own."""

    _count = 0

    def __init__(self, **parameters):
        Dashboard._count += 1
        self.name = "dashboard_%d" % Dashboard._count
        for key, value in {"port": 0, **parameters}.items():
            rospy.set_param("/%s/%s" % (self.name, key), value)
        program = roslib.packages.find_node(PACKAGE, "dashboard")[0]
        self._process = subprocess.Popen([program, "__name:=" + self.name], stdout=subprocess.PIPE, universal_newlines=True)
        words = self._process.stdout.readline().split()
        self.url = words[1] if len(words) == 2 else ""

    def port(self):
        return int(self.url.split(":")[2].split("/")[0])

    def kill(self):
        self._process.kill()
        self._process.wait(TIMEOUT)

    def end(self):
        """Its exit code after SIGINT."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        code = self._process.wait(TIMEOUT)
        self._process.stdout.close()
        return code


def status_of(url, data=None, **headers):
    try:
        with urllib.request.urlopen(urllib.request.Request(url, data=data, headers=headers), timeout=TIMEOUT) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


class DashboardTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.browser_profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        cls.dashboard = Dashboard()
        try:
            cls.browser = look_at_pages.browser(cls.browser_profile.name, reached=["127.0.0.1"])
        except SystemExit:
            raise unittest.SkipTest("no Chromium, driver or selenium here")
        look_at_pages.set_width(cls.browser, 1400)
        cls.browser.get(cls.dashboard.url)

    @classmethod
    def tearDownClass(cls):
        cls.browser.quit()
        cls.dashboard.end()
        cls.browser_profile.cleanup()

    def text(self, joint, part):
        """Of a part of a joint's card; empty where there is none."""
        return self.browser.execute_script(
            "const e = document.querySelector(`[data-joint=${arguments[0]}] ${arguments[1]}`); return e ? e.innerText : ''",
            joint, part)

    def press(self, joint, button):
        self.browser.execute_script("document.querySelector(`[data-joint=${arguments[0]}] .${arguments[1]}`).click()", joint, button)

    def play(self, joint):
        """Value and both ends, in mrad; None where the page has none."""
        words = self.text(joint, ".headline").replace("(95 %:", "").replace(")", "").split()
        return [float(words[i]) for i in (0, 2, 4)] if len(words) == 5 and words[1] == "mrad" else None

    def test_1_all_joints_stand_on_the_page_with_words_colour_and_limits(self):
        until(lambda: self.play("shoulder"), "play of the shoulder on the page")
        value, low, high = self.play("shoulder")
        self.assertTrue(low <= NEW <= high and low <= value <= high, (value, low, high))
        until(lambda: self.text("shoulder", ".grade") == "good", "grade good")
        self.assertTrue(self.text("wrist", ".grade"), "the wrist is on the page")
        until(lambda: "watch 0.8" in self.text("shoulder", ".bar"), "limits of the rig file in the bar")
        until(lambda: self.browser.execute_script(
            "return document.querySelectorAll('[data-joint=shoulder] .curve svg').length"), "curve of the shoulder")

    def test_2_a_page_of_a_telephone_is_not_wider_than_its_screen(self):
        look_at_pages.set_width(self.browser, 400)
        wider = self.browser.execute_script("return document.documentElement.scrollWidth - document.documentElement.clientWidth")
        look_at_pages.set_width(self.browser, 1400)
        self.assertLessEqual(wider, 0)
        self.assertEqual([e["message"] for e in self.browser.get_log("browser") if "favicon" not in e["message"]], [])

    def test_3_the_button_asks_the_diagnoser(self):
        self.press("shoulder", "diagnose")
        until(lambda: "Diagnosis at" in self.text("shoulder", ".answer"), "answer of the service")
        self.assertIn("good: backlash", self.text("shoulder", ".answer"))

    def test_4_the_button_keeps_the_baseline(self):
        self.press("shoulder", "baseline")
        until(lambda: "Baseline at" in self.text("shoulder", ".answer"), "answer of the service")
        self.assertNotIn("no result", self.text("shoulder", ".answer"))

    def test_5_a_change_on_the_robot_stands_on_the_page(self):
        rospy.wait_for_service("/simulator/shoulder/set_backlash", TIMEOUT)
        rospy.ServiceProxy("/simulator/shoulder/set_backlash", SetBacklash)(1e-3 * WORN)

        def worn():  # at the latest when the motion before the change is forgotten, and somebody asks
            self.press("shoulder", "diagnose")
            answer = self.text("shoulder", ".answer")
            return self.text("shoulder", ".grade") in ("service", "stop") or "1.3 mrad" in answer
        until(worn, "worn shoulder on the page")

    def test_6_a_page_that_lost_its_server_says_so_and_finds_it_again(self):
        port = self.dashboard.port()
        self.dashboard.kill()
        until(lambda: "is lost" in self.browser.execute_script("return document.getElementById('link').innerText"), "words of the loss")
        self.assertTrue(self.browser.execute_script("return document.body.classList.contains('lost-page')"))
        DashboardTest.dashboard = Dashboard(port=port)
        until(lambda: "live" in self.browser.execute_script("return document.getElementById('link').innerText"), "page that lives again")

    def test_7_only_the_page_itself_may_press_buttons(self):
        url, body = self.dashboard.url, b'{"node": "/diagnoser", "joint": "shoulder"}'
        self.assertEqual(status_of(url), 200)
        self.assertEqual(status_of(url, Host="evil.example:8088"), 403)  # a name that leads here
        self.assertEqual(status_of(url + "diagnose", data=body), 403)    # a form of another site
        self.assertEqual(status_of(url + "diagnose", data=b"{}", **{"X-Button": "1"}), 400)
        self.assertEqual(status_of(url + "diagnose", data=b'{"node": "/x", "joint": "y"}', **{"X-Button": "1"}), 404)

    def test_8_from_elsewhere_nothing_without_the_token(self):
        open_one = Dashboard(address="0.0.0.0")
        try:
            self.assertIn("?token=", open_one.url)
            base = "http://127.0.0.1:%d/" % open_one.port()
            for path in ("", "events", "page.js", "?token=wrong"):
                self.assertEqual(status_of(base + path), 403, path)
            self.assertEqual(status_of(base + "page.js?token=" + open_one.url.split("=")[1]), 200)
        finally:
            self.assertEqual(open_one.end(), 0)

    def test_9_wrong_parameters_are_refused(self):
        for wrong in ({"port": 70000}, {"port": "x"}, {"prot": 1}, {"address": ""}):
            self.assertEqual(Dashboard(**wrong).end(), 64, wrong)
        self.assertEqual(Dashboard(port=self.dashboard.port()).end(), 73)


if __name__ == "__main__":
    rospy.init_node("dashboard_test")
    rostest.rosrun("backlash_diagnosis", "dashboard_test", DashboardTest)
