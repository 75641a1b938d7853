# SPDX-License-Identifier: BSD-3-Clause
"""The robot as the page sees it: finds the nodes by what they publish and serve, and hears them."""
import threading
import time

import rosgraph
import rosservice
import rospy
from backlash_diagnosis.msg import BacklashEstimate, ChangeReport
from backlash_diagnosis.srv import Diagnose, SetBaseline
from diagnostic_msgs.msg import DiagnosticArray
from dynamic_reconfigure.msg import Config

from .joints import number

LOOK = 2          # s between two looks for nodes: choice
PATIENCE = 90     # s of wall time that a service may take: longer than a diagnosis of 60 s of samples


def level_of(level):
    """Levels are bytes in Python 3."""
    return level[0] if isinstance(level, bytes) else level


def verdict_of(answer):
    """Of a diagnosis that has a value; None of any other."""
    v = answer.verdict
    for value, low, high, unit in ((v.backlash, v.lower, v.upper, "m"), (v.backlash_angle, v.angle_lower, v.angle_upper, "rad")):
        if answer.success and (number(value) is not None or number(high) is not None):
            return {"grade": v.grade, "value": number(value), "interval": [number(low), number(high)], "unit": unit}
    return None


class Robot:
    def __init__(self, joints):
        self._joints = joints
        self._subscribers = {}
        self._diagnosers = set()
        self._lock = threading.Lock()
        self.master = False
        threading.Thread(target=self._look_for_ever, daemon=True).start()

    def diagnosers(self):
        with self._lock:
            return set(self._diagnosers)

    def _look_for_ever(self):
        while not rospy.is_shutdown():
            try:
                self._look()
                self.master = True
            except Exception as error:  # the master comes and goes; the page says that it is gone
                self.master = False
                rospy.logdebug("dashboard: %s", error)
            time.sleep(LOOK)

    def _look(self):
        master = rosgraph.Master(rospy.get_name())
        self._subscribe("/diagnostics", DiagnosticArray, self._on_diagnostics)
        for topic, kind in master.getTopicTypes():
            if kind == BacklashEstimate._type:
                self._subscribe(topic, BacklashEstimate, self._on_estimate)
            elif kind == ChangeReport._type:
                self._subscribe(topic, ChangeReport, self._on_changes)
        services = [name for name, _ in master.getSystemState()[2]]
        found = {name[:-len("/diagnose")] for name in services
                 if name.endswith("/diagnose") and rosservice.get_service_type(name) == Diagnose._type}
        with self._lock:
            self._diagnosers = found
        for node, joint in self._joints.nodes():
            topic = "%s/%s/live/parameter_updates" % (node, joint)
            if node in found:
                self._subscribe(topic, Config, lambda m, n=node, j=joint: self._on_limits(n, j, m))
        self._joints.forget(found, time.time())

    def _subscribe(self, topic, kind, take):
        if topic not in self._subscribers:
            self._subscribers[topic] = rospy.Subscriber(topic, kind, take)

    def _on_diagnostics(self, message):
        now = time.time()
        for status in message.status:
            self._joints.take_status(status.name, level_of(status.level), status.message,
                                     {v.key: v.value for v in status.values}, now, message.header.stamp.to_sec())

    def _on_estimate(self, message):
        node = message._connection_header.get("callerid", "")
        self._joints.take_estimate(node, message.joint, message.method, message.status_name,
                                   message.header.stamp.to_sec(), message.message)

    def _on_limits(self, node, joint, message):
        values = {d.name: d.value for d in message.doubles}
        self._joints.take_limits(node, joint, *(values.get(k, 0) for k in ("watch", "service", "stop")))

    def _on_changes(self, message):
        self._joints.take_changes([
            {"joint": c.joint, "id": c.id, "state": c.state_name, "since": c.since.to_sec(),
             "until": c.until.to_sec() or None, "text": c.text} for c in message.changes])

    def diagnose(self, node, joint):
        answer = self._call(node, "diagnose", Diagnose, joint=joint, periods=0, timeout=0.0)
        if isinstance(answer, str):
            self._joints.take_answer(node, joint, "diagnose", False, answer, time.time())
            return
        self._joints.take_answer(node, joint, "diagnose", answer.success, answer.message, time.time(), verdict_of(answer),
                                 [(e.method, e.status_name, e.header.stamp.to_sec(), e.message) for e in answer.estimates])

    def set_baseline(self, node, joint):
        answer = self._call(node, "set_baseline", SetBaseline, joint=joint, clear=False)
        failed = isinstance(answer, str)
        self._joints.take_answer(node, joint, "set_baseline", not failed and answer.success,
                                 answer if failed else answer.message, time.time())

    @staticmethod
    def _call(node, name, kind, **request):
        """The answer, or why there is none."""
        try:
            rospy.wait_for_service("%s/%s" % (node, name), 5)
            return rospy.ServiceProxy("%s/%s" % (node, name), kind)(**request)
        except (rospy.ROSException, rospy.ServiceException) as error:
            return "%s does not answer: %s" % (node, error)
