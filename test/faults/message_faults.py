# SPDX-License-Identifier: BSD-3-Clause
"""Bad messages between good ones, sent to a running diagnoser.

A run with faults, then a clean one of ten periods: the answer must be right or an honest "cannot tell", every message
that names the joint must be in a counter of /diagnostics, and the node must be alive.
"""
import copy
import math
import random
import shutil
import struct
import tempfile

from case import BAD, CANNOT_TELL, RIGHT
from clean import BACKLASH, TOLERANCE

NAN, INF = float("nan"), float("inf")
COUNTERS = ("Samples accepted", "Samples with NaN", "Repeated stamps", "Malformed messages")
JOINT_NAMES = {"joint_motor", "joint_sensor"}
TAILS = 2  # clean runs behind the faults: a channel that is gone is given up after a second


class Stream:
    """What is to be sent: pairs of time [s] and message; `start` is the time at which the clean tail begins."""

    def __init__(self, times, messages):
        self.times, self.messages = times, messages
        self.sent = [(t, m) for t, m in zip(times, messages)]
        self.start = times[-1] + 1e-3

    def places(self, rng, share=0.02):
        return rng.sample(range(len(self.sent)), max(1, int(share * len(self.sent))))

    def replace(self, rng, change, share=0.02):
        for place in self.places(rng, share):
            time, message = self.sent[place]
            message = copy.deepcopy(message)
            change(message)
            self.sent[place] = (time, message)


def not_a_number(rng, s):
    field, place = rng.choice(["position", "effort"]), rng.randrange(2)
    s.replace(rng, lambda m: getattr(m, field).__setitem__(place, NAN), rng.choice([0.001, 0.02, 0.5]))
    return "%s[%d]" % (field, place)


def infinite(rng, s):
    field, value = rng.choice(["position", "effort"]), rng.choice([INF, -INF])
    s.replace(rng, lambda m: getattr(m, field).__setitem__(rng.randrange(2), value))
    return "%s = %s" % (field, value)


def empty_arrays(rng, s):
    fields = rng.choice([["effort"], ["position"], ["position", "effort"], ["name"], ["name", "position", "effort"]])

    def change(m):
        for field in fields:
            setattr(m, field, [])
    s.replace(rng, change)
    return ", ".join(fields)


def oversized_arrays(rng, s):
    field, size = rng.choice(["effort", "position", "velocity", "name"]), rng.choice([3, 1000, 100_000])

    def change(m):
        more = ["stranger_%d" % i for i in range(size)] if field == "name" else [0.5] * size
        setattr(m, field, list(getattr(m, field)) + more)
    s.replace(rng, change, 0.005)
    return "%s with %d more" % (field, size)


def unknown_names(rng, s):
    names = rng.choice([["elbow_motor", "elbow_sensor"], ["", ""], ["joint", "joint_"], ["joint_motor ", "JOINT_SENSOR"],
                        ["\u00fc" * 500, "\x01\n"]])
    s.replace(rng, lambda m: setattr(m, "name", names), 0.1)
    return repr(names)[:40]


def name_twice(rng, s):
    s.replace(rng, lambda m: setattr(m, "name", ["joint_motor", "joint_motor"]))
    return "joint_motor twice"


def renamed_in_midstream(rng, s):
    begin, end = sorted(rng.sample(range(len(s.sent)), 2))
    for place in range(begin, end):
        time, message = s.sent[place]
        message = copy.deepcopy(message)
        message.name = rng.choice([["elbow_motor", "elbow_sensor"], ["joint_motor", "elbow_sensor"]])
        s.sent[place] = (time, message)
    return "messages %d to %d" % (begin, end)


def reordered_names(rng, s):
    def change(m):
        for field in ("name", "position", "effort"):
            setattr(m, field, list(reversed(getattr(m, field))))
    s.replace(rng, change, 0.5)
    return "half of the messages"


def joints_beside(rng, s):
    """Others on the same topic, in the same message."""
    def change(m):
        m.name = ["other_%d" % i for i in range(20)] + list(m.name)
        m.position = [NAN] * 20 + list(m.position)
        m.effort = [INF] * 20 + list(m.effort)
    s.replace(rng, change, 0.5)
    return "20 more in half of the messages"


def stamps_zero(rng, s):
    for place in s.places(rng, rng.choice([0.01, 1])):
        s.sent[place] = (None, s.sent[place][1])
    return "some or all"


def stamps_repeated(rng, s):
    for place in sorted(s.places(rng, rng.choice([0.02, 1])), reverse=True):
        s.sent.insert(place, s.sent[place])
    return "%d more" % (len(s.sent) - len(s.times))


def stamps_backwards(rng, s):
    back = rng.choice([2e-3, 0.1, 100.0, 1e8])
    for place in s.places(rng, 0.005):
        s.sent[place] = (s.sent[place][0] - back, s.sent[place][1])
    return "by %g s" % back


def stamps_jump_by_hours(rng, s):
    hours, place = rng.choice([-20, -1, 1, 100, 20000]), rng.randrange(len(s.sent))
    s.sent[place:] = [(t + 3600 * hours, m) for t, m in s.sent[place:]]
    s.start += 3600 * hours
    return "by %d h at message %d" % (hours, place)


def stamps_disordered(rng, s):
    rng.shuffle(s.sent)
    return "all of them"


def messages_lost(rng, s):
    for place in sorted(s.places(rng, rng.choice([0.01, 0.3])), reverse=True):
        del s.sent[place]
    return "%d" % (len(s.times) - len(s.sent))


def channel_comes_and_goes(rng, s):
    def change(m):
        m.velocity = [0.1, 0.0]
    s.replace(rng, change, 0.02)
    return "velocities in some messages"


def absurd_values(rng, s):
    value = rng.choice([1e300, -1e300, 5e-324, 1e9])
    s.replace(rng, lambda m: getattr(m, rng.choice(["position", "effort"])).__setitem__(0, value), 0.01)
    return "%g" % value


def two_publishers(rng, s):
    """The same run half a sample later, between the messages of the first."""
    s.sent = [pair for t, m in s.sent for pair in ((t, m), (t + 5e-4, m))]
    return "interleaved"


GENERATORS = [not_a_number, infinite, empty_arrays, oversized_arrays, unknown_names, name_twice, renamed_in_midstream,
              reordered_names, joints_beside, stamps_zero, stamps_repeated, stamps_backwards, stamps_jump_by_hours,
              stamps_disordered, messages_lost, channel_comes_and_goes, absurd_values, two_publishers]


class Bench:
    """A diagnoser per case, under a name and on a topic of its own."""

    def __init__(self, folder):
        import diagnoser_support as support
        import rospy
        from sensor_msgs.msg import JointState
        rospy.init_node("fault_campaign", anonymous=True, disable_signals=True, log_level=rospy.FATAL)
        self.support, self.rospy, self.message_type = support, rospy, JointState
        self.curve = support.build_curve(folder)
        self.times, self.messages = support.simulated_messages(folder, BACKLASH / 2)
        self.diagnostics = support.Diagnostics
        self._topics = 0

    def open(self, message_type=None):
        self._topics += 1
        topic = "/states_%d" % self._topics
        connected = self.support.Connected()
        publisher = self.rospy.Publisher(topic, message_type or self.message_type, connected, queue_size=0)
        diagnoser = self.support.Diagnoser({"curve": self.curve}, topic)
        try:
            diagnoser.ready()
            if not connected.wait(self.support.TIMEOUT):
                raise AssertionError("the diagnoser does not subscribe")
        except BaseException:
            diagnoser.__exit__()
            raise
        return publisher, diagnoser

    def send(self, publisher, time, message):
        if time is None:
            message.header.stamp = self.rospy.Time(0)
            publisher.publish(message)
        else:
            self.support.send(publisher, message, time)


def judge_answer(answer):
    if not answer.success:
        return (CANNOT_TELL, answer.message) if answer.message else (BAD, "no answer and no reason")
    verdict = answer.verdict
    near = abs(verdict.backlash - BACKLASH) <= TOLERANCE * BACKLASH
    lower = -math.inf if math.isnan(verdict.lower) else verdict.lower
    upper = math.inf if math.isnan(verdict.upper) else verdict.upper
    text = "%.4g [%.4g, %.4g] m" % (verdict.backlash, lower, upper)
    return (RIGHT if near or lower <= BACKLASH <= upper else BAD), text


def unaccounted(bench, diagnostics, diagnoser, sent):
    """Waits until the counters hold every message that names the joint; what they say where they never do."""
    seen = {}

    def whole(level, message, values):
        seen.update(values)
        return sum(int(values.get(key, 0)) for key in COUNTERS) == sent
    try:
        diagnostics.wait_for(diagnoser.name[1:] + ": joint: input", whole, "all of %d messages" % sent)
    except AssertionError:
        return "%d messages sent, counted %s" % (sent, {key: seen.get(key) for key in COUNTERS})
    return ""


def one(bench, generate, rng):
    stream = Stream(bench.times, bench.messages)
    what = generate(rng, stream)
    publisher, diagnoser = bench.open()
    with diagnoser:
        diagnostics = bench.diagnostics()
        for time, message in stream.sent:
            bench.send(publisher, time, copy.copy(message))
        for tail in range(TAILS):
            for time, message in zip(bench.times, bench.messages):
                bench.send(publisher, stream.start + tail * len(bench.times) * 1e-3 + time, message)
        sent = sum(bool(JOINT_NAMES & set(m.name)) for _, m in stream.sent) + TAILS * len(bench.messages)
        missing = unaccounted(bench, diagnostics, diagnoser, sent)
        answer = diagnoser.diagnose(periods=8, timeout=bench.support.TIMEOUT)
        verdict, why = judge_answer(answer)
        if missing:
            verdict, why = BAD, missing
        if not diagnoser.alive():
            verdict, why = BAD, "the node has ended: " + diagnoser.output()[-300:]
    publisher.unregister()
    return what, verdict, why


def burst(bench, rng):
    """As fast as rospy can, several runs one after another; the rate that was reached is reported."""
    rounds = rng.choice([3, 10])
    publisher, diagnoser = bench.open()
    with diagnoser:
        diagnostics = bench.diagnostics()
        begin = bench.rospy.get_rostime().to_sec()
        for turn in range(rounds):
            for time, message in zip(bench.times, bench.messages):
                bench.send(publisher, 1.2 * turn + time, message)
        rate = rounds * len(bench.messages) / (bench.rospy.get_rostime().to_sec() - begin)
        missing = unaccounted(bench, diagnostics, diagnoser, rounds * len(bench.messages))
        verdict, why = judge_answer(diagnoser.diagnose(periods=8, timeout=bench.support.TIMEOUT))
        if missing:
            verdict, why = BAD, missing
    publisher.unregister()
    return "%d messages at %.0f per second" % (rounds * len(bench.messages), rate), verdict, why


def garbage_class():
    """A message that says it is a JointState and is not."""
    from sensor_msgs.msg import JointState

    class Garbage(JointState):
        def serialize(self, buff):
            if getattr(self, "bytes", None) is None:
                super().serialize(buff)
            else:
                buff.write(self.bytes)
    return Garbage


def garbage_bytes(bench, rng):
    garbage = garbage_class()
    publisher, diagnoser = bench.open(garbage)

    def wrapped(message):
        out = garbage(header=message.header, name=message.name, position=message.position, effort=message.effort)
        out.bytes = None
        return out
    kind = rng.choice(["random", "truncated", "impossible lengths", "nothing"])
    with diagnoser:
        diagnostics = bench.diagnostics()
        for turn in range(20):
            bad = garbage()
            bad.header.stamp = bench.rospy.Time(1)
            whole = struct.pack("<III", 0, 1, 0) + struct.pack("<I", 0)
            bad.bytes = {"random": bytes(rng.randrange(256) for _ in range(200)), "truncated": whole[:rng.randrange(16)],
                         "impossible lengths": whole + struct.pack("<I", rng.choice([0x7fffffff, 0xffffffff])),
                         "nothing": b""}[kind]
            publisher.publish(bad)
        for time, message in zip(bench.times, bench.messages):
            bench.send(publisher, time, wrapped(message))
        missing = unaccounted(bench, diagnostics, diagnoser, len(bench.messages))
        verdict, why = judge_answer(diagnoser.diagnose(periods=8, timeout=bench.support.TIMEOUT))
        if missing:
            verdict, why = BAD, missing
        if not diagnoser.alive():
            verdict, why = BAD, "the node has ended: " + diagnoser.output()[-300:]
    publisher.unregister()
    return kind, verdict, why


def cases():
    named = {"messages: " + g.__name__.replace("_", " "): (lambda bench, rng, g=g: one(bench, g, rng))
             for g in GENERATORS}
    named["messages: bursts"] = burst
    named["messages: garbage bytes"] = garbage_bytes
    return named


def run(arguments, table, master):
    folder = tempfile.mkdtemp()
    try:
        bench = Bench(folder)
        for kind, try_it in cases().items():
            for number in range(arguments.count if arguments.only in kind else 0):
                if arguments.number in (None, number):
                    run_case(arguments, table, bench, kind, number, try_it)
    finally:
        shutil.rmtree(folder)


def run_case(arguments, table, bench, kind, number, try_it):
    rng = random.Random("%d/%s/%d" % (arguments.seed, kind, number))
    try:
        what, verdict, why = try_it(bench, rng)
    except Exception as error:  # the campaign goes on; whatever it is, it is bad
        what, verdict, why = "number %d" % number, BAD, "%s: %s" % (type(error).__name__, error)
    table.add(kind, verdict, "%s (--seed %d --only '%s' --number %d)" % (what, arguments.seed, kind, number), why)
