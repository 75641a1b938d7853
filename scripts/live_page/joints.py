# SPDX-License-Identifier: BSD-3-Clause
"""What is known of each joint from what the nodes publish. Knows neither ROS nor the web; all methods may be called from any
thread."""
import collections
import csv
import math
import re
import threading

KEPT = 1500          # points of a joint's curve: choice, a screen has fewer pixels
OLD = 30             # s of wall time after which an estimate is no news: what was asked for since counts; choice
SILENT = 5           # s of wall time, as long as the nodes report each second, after which they are taken for gone: choice
INTERVAL = re.compile(r"\(95 %: ([^ )]+)(?: to ([^ )]+)| or more)\)")  # as a verdict has it in words
REASON = re.compile(r"; (\w+): (\w+) \((.*?)\)(?=; \w+: \w+ \(|$|; [a-z ]+ )")  # of each method, where none has an answer
LEVELS = ("ok", "warn", "error", "stale")


def number(text):
    """A finite number or None."""
    try:
        value = float(text)
    except (TypeError, ValueError):
        return None
    return value if math.isfinite(value) else None


class Joint:
    def __init__(self, node, name):
        self.node, self.name = node, name
        self.grade = self.message = self.input = None
        self.value = self.interval = self.unit = self.known = self.updated = None
        self.reported = None                           # wall time of the last status
        self.limits = None
        self.estimates = {}                            # by method
        self.curve = collections.deque(maxlen=KEPT)    # time of its stamp, value, lower, upper
        self.history = None                            # path that was read
        self.answer = None                             # of a service

    def add_point(self, time, value, lower, upper):
        if value is None or (self.curve and time <= self.curve[-1][0]):
            return
        self.curve.append((time, value, lower, upper))


class Joints:
    def __init__(self):
        self._lock = threading.Lock()
        self._joints = {}
        self._watches = {}                             # (node, joint): status of the model
        self._changes = {}                             # joint: change

    def _joint(self, node, name):
        return self._joints.setdefault((node, name), Joint(node, name))

    def take_status(self, name, level, message, values, now, stamp=0.0):
        """A status "node: JOINT: concern" of /diagnostics, which came at `now` (wall time) with this stamp."""
        parts = name.split(": ")
        if len(parts) < 3:
            return
        node, joint, concern = "/" + parts[0].lstrip("/"), ": ".join(parts[1:-1]), parts[-1]
        with self._lock:
            if concern == "model":
                self._watches[(node, joint)] = {"level": LEVELS[min(level, 3)], "message": message, "reported": now}
            elif concern == "backlash" and "Whole periods kept" in values:
                self._take_backlash(self._joint(node, joint), level, message, values, now, stamp)
            elif concern == "input" and (node, joint) in self._joints:
                self._joints[(node, joint)].input = {"level": LEVELS[min(level, 3)], "message": message,
                                                     "rate": number(values.get("Sampling rate (Hz)"))}

    def _take_backlash(self, joint, level, message, values, now, stamp):
        joint.reported, joint.message = now, message
        joint.grade = values.get("Grade", "cannot_tell") if level < 3 else "stale"
        path = values.get("History")
        if path and joint.history != path:
            joint.history = path
            read_history(path, joint)
        length = number(values.get("Backlash (m)")) is not None or number(values.get("Backlash upper (m)")) is not None
        joint.unit = "m" if length else "rad"
        kind = "Backlash" if length else "Backlash angle"
        joint.value = number(values.get("%s (%s)" % (kind, joint.unit)))
        joint.interval = [number(values.get("%s %s (%s)" % (kind, end, joint.unit))) for end in ("lower", "upper")]
        words = INTERVAL.search(message)
        if joint.interval == [None, None] and joint.value is not None and words:
            joint.interval = [number(words.group(1)), number(words.group(2))]
        if joint.value is not None and level < 3:  # what is said in figures of the page's own unit is not said again
            joint.message = message[message.find(" by ") + 1:]
        elif joint.grade == "cannot_tell":
            self._take_reasons(joint, message)
        known = [joint.value] + joint.interval
        stamp = max((e["stamp"] for e in joint.estimates.values()), default=0) or stamp
        if known != joint.known or (joint.curve and stamp > joint.curve[-1][0] and joint.estimates):
            joint.known, joint.updated = known, now
            if joint.grade not in ("cannot_tell", "stale"):
                joint.add_point(stamp, *known)

    @staticmethod
    def _take_reasons(joint, message):
        """Of a verdict that none could give: the reason of whom the record served best, and those of all."""
        reasons = REASON.findall(message)
        for method, status, reason in reasons:
            joint.estimates.setdefault(method, {"stamp": 0}).update(status=status, message=reason)
        best = min((r for r in reasons if not of_rig(r[2])), key=lambda r: r[1] == "insufficient_data", default=None)
        if reasons:
            joint.message = "%s: %s" % (best[0], best[2]) if best else "The rig file serves no method."

    def take_estimate(self, node, joint, method, status, stamp, message):
        with self._lock:
            self._joint(node, joint).estimates[method] = {"status": status, "stamp": stamp, "message": message}

    def take_limits(self, node, joint, watch, service, stop):
        with self._lock:
            known = watch > 0 and service > watch and stop > service
            self._joint(node, joint).limits = [watch, service, stop] if known else None

    def take_changes(self, changes):
        """Each a dict with joint, id, state, since, until, text; the newest of a joint stays."""
        with self._lock:
            for change in changes:
                if change["state"] == "withdrawn":
                    if self._changes.get(change["joint"], {}).get("id") == change["id"]:
                        del self._changes[change["joint"]]
                    continue
                old = self._changes.get(change["joint"])
                if old is None or change["since"] >= old["since"]:
                    self._changes[change["joint"]] = change

    def take_answer(self, node, joint, what, success, message, now, verdict=None, estimates=()):
        """Of a service. `verdict`: grade, value, interval and unit, where it is a diagnosis that has them."""
        with self._lock:
            known = self._joint(node, joint)
            known.answer = {"what": what, "success": success, "message": message, "time": now, "verdict": verdict}
            for method, status, stamp, text in estimates:
                known.estimates[method] = {"status": status, "stamp": stamp, "message": text}

    def nodes(self):
        with self._lock:
            return sorted(self._joints)

    def forget(self, alive, now):
        """Joints of nodes that are no longer there stay, as gone, until they are heard again."""
        with self._lock:
            for joint in self._joints.values():
                if joint.node not in alive and joint.reported is not None and now - joint.reported > SILENT:
                    joint.grade = "gone"

    def as_json(self, now):
        with self._lock:
            named = {}
            for joint in self._joints.values():
                if joint.reported is not None:
                    named.setdefault(joint.name, []).append(self._diagnosed(joint, now))
            for (node, name), watch in self._watches.items():
                for entry in named.setdefault(name, [{"joint": name, "node": None, "grade": None}]):
                    entry["watch"] = dict(watch, node=node, gone=now - watch["reported"] > SILENT)
            for name, change in self._changes.items():
                for entry in named.setdefault(name, [{"joint": name, "node": None, "grade": None}]):
                    entry["change"] = change
            return [entry for name in sorted(named) for entry in named[name]]

    @staticmethod
    def _diagnosed(joint, now):
        shown = {"grade": "gone" if now - joint.reported > SILENT else joint.grade, "message": joint.message,
                 "value": joint.value, "interval": joint.interval, "unit": joint.unit}
        asked = joint.answer is not None and joint.answer["verdict"] is not None
        if asked and (shown["grade"] == "cannot_tell" or joint.answer["time"] > (joint.updated or 0) + OLD):
            shown.update(joint.answer["verdict"], asked=joint.answer["time"],
                         message=joint.answer["message"][joint.answer["message"].find(" by ") + 1:])
        return {**shown, "joint": joint.name, "node": joint.node, "limits": joint.limits, "old": joint.value is not None and now - joint.updated > OLD, "age": None if joint.updated is None else now - joint.updated, "input": joint.input, "answer": joint.answer,
                "curve": list(joint.curve),
                "silent": [{"method": m, "message": e["message"] or e["status"], "of_rig": of_rig(e["message"])}
                           for m, e in sorted(joint.estimates.items())
                           if e["status"] not in ("ok", "below_range")]}


def of_rig(reason):
    """Whether a method has no answer for what the machine or its file is, whatever the motion."""
    return reason.startswith(("the rig", "the record has no", "the load is free and the record has no"))


def read_history(path, joint):
    """What a diagnoser has kept of a joint before this page was started; nothing where it cannot be read from here."""
    try:
        with open(path, newline="") as stream:
            rows = list(csv.DictReader(stream))[-KEPT:]
    except (OSError, UnicodeDecodeError, csv.Error):
        return
    for row in rows:
        if row.get("event") != "estimate" or row.get("grade") == "cannot_tell":
            continue
        kind = "backlash" if number(row.get("backlash")) is not None else "backlash_angle"
        lower, upper = ("lower", "upper") if kind == "backlash" else ("angle_lower", "angle_upper")
        time = number(row.get("time"))
        if time is not None:
            joint.add_point(time, number(row.get(kind)), number(row.get(lower)), number(row.get(upper)))
