# SPDX-License-Identifier: BSD-3-Clause
"""Damaged bags. They are made by Debian's rosbag, not by the code under test."""
import os
import shutil
import subprocess
import tempfile

import genpy
import rosbag
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from case import BAD, Case, RIGHT
from clean import judge_diagnosis, table_of
from csv_faults import flipped, judge_answered

START = 1_000_000_000  # s, stamp of time 0
NAN, INF = float("nan"), float("inf")


def messages_of(clean, joint="joint"):
    for row in clean.rows:
        value = dict(zip(clean.header, map(float, row)))
        nanoseconds = round(value["time"] * 1e9)
        message = JointState()
        message.header.stamp = genpy.Time(START + nanoseconds // 10**9, nanoseconds % 10**9)
        message.name = [joint + "_motor", joint + "_sensor"]
        message.position = [value["motor_position"], 0.0]
        message.effort = [value["motor_torque"], value["sensor_torque"]]
        yield message


def bag_bytes(messages, topic="/joint_states", compression="none", chunk=100_000, close=True):
    """`messages`: of joint states, or pairs (topic, message)."""
    folder = tempfile.mkdtemp()
    path = os.path.join(folder, "made.bag")
    try:
        bag = rosbag.Bag(path, "w", compression=compression, chunk_threshold=chunk)
        for message in messages:
            place, body = message if isinstance(message, tuple) else (topic, message)
            bag.write(place, body, getattr(body, "header", None) and body.header.stamp or genpy.Time(START))
        if not close:  # what a recorder leaves that was killed: whole chunks, no index
            bag.flush()
            return read(path)
        bag.close()
        return read(path)
    finally:
        shutil.rmtree(folder)


def read(path):
    with open(path, "rb") as stream:
        return stream.read()


def reindexed(body):
    folder = tempfile.mkdtemp()
    path = os.path.join(folder, "record.bag")
    try:
        with open(path, "wb") as out:
            out.write(body)
        subprocess.run(["rosbag", "reindex", "-q", "-f", path], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                       timeout=60)
        return read(path)
    finally:
        shutil.rmtree(folder)


def any_bag(rng, clean):
    compression = rng.choice(["none", "none", "bz2", "lz4"])
    chunk = rng.choice([5_000, 100_000])
    return "%s, chunks of %d" % (compression, chunk), bag_bytes(messages_of(clean), compression=compression, chunk=chunk)


def undamaged(rng, clean):
    what, body = any_bag(rng, clean)
    if rng.random() < 0.3:
        what, body = "%s, reindexed" % what, reindexed(body)
    return what, body, False, []


def truncated(rng, clean):
    what, body = any_bag(rng, clean)
    size = rng.randrange(len(body))
    return "%s, cut after %d of %d bytes" % (what, size, len(body)), body[:size], False, []


def truncated_with_noise(rng, clean):
    what, body = any_bag(rng, clean)
    size = rng.randrange(len(body))
    noise = bytes(rng.randrange(256) for _ in range(rng.randrange(1, 20000)))
    return "%s, noise behind %d of %d bytes" % (what, size, len(body)), body[:size] + noise, False, []


def truncated_and_reindexed(rng, clean):
    what, body = any_bag(rng, clean)
    size = rng.randrange(5000, len(body))
    return "%s, cut after %d of %d bytes, reindexed" % (what, size, len(body)), reindexed(body[:size]), False, []


def not_indexed(rng, clean):
    body = bag_bytes(messages_of(clean), close=False, chunk=5000)
    return "as a killed recorder leaves it", body, False, []


def not_indexed_then_reindexed(rng, clean):
    return "as a killed recorder leaves it, reindexed", reindexed(
        bag_bytes(messages_of(clean), close=False, chunk=5000)), False, []


def bits_flipped(rng, clean):
    what, body = any_bag(rng, clean)
    count = rng.choice([1, 1, 4, 32])
    return "%s, %d bits flipped" % (what, count), flipped(body, rng, count), False, []


def bits_flipped_and_reindexed(rng, clean):
    what, body = any_bag(rng, clean)
    count = rng.choice([1, 4])
    return "%s, %d bits flipped, reindexed" % (what, count), reindexed(flipped(body, rng, count)), False, []


def bytes_replaced(rng, clean):
    what, body = any_bag(rng, clean)
    start, size = rng.randrange(len(body)), rng.choice([4, 512, 4096])
    filler = rng.choice([b"\x00", b"\xff", b"#"])
    changed = body[:start] + (filler * size)[:len(body) - start] + body[start + size:]
    return "%s, %d bytes of %r from %d" % (what, size, filler, start), changed, False, []


def lengths_replaced(rng, clean):
    """A length field of the container says what would fill the memory."""
    what, body = any_bag(rng, clean)
    place = 13 if rng.random() < 0.3 else rng.randrange(13, len(body) - 4)
    length = rng.choice([0x7fffffff, 0xffffffff, 0x40000000, 0])
    changed = body[:place] + length.to_bytes(4, "little") + body[place + 4:]
    return "%s, %#x at byte %d" % (what, length, place), changed, False, []


def not_a_bag(rng, clean):
    kind = rng.choice(["empty", "text", "CSV", "version 1.2", "random", "YAML"])
    body = {"empty": b"", "text": b"hello\n", "CSV": clean.record, "YAML": clean.rig,
            "version 1.2": b"#ROSBAG V1.2\n" + bytes(100),
            "random": bytes(rng.randrange(256) for _ in range(5000))}[kind]
    return kind, body, True, []


def no_messages(rng, clean):
    kind = rng.choice(["no message", "other topic", "other type", "other names", "no names"])
    text = String(data="hello")
    nameless = JointState()
    nameless.header.stamp = genpy.Time(START)
    if kind == "no message":
        body = bag_bytes([])
    elif kind == "other topic":
        body = bag_bytes([("/chatter", text)])
    elif kind == "other type":
        body = bag_bytes([("/joint_states", text)])
    elif kind == "other names":
        body = bag_bytes(renamed(messages_of(clean), ["shoulder", "wrist"]))
    else:
        body = bag_bytes([nameless])
    return kind, body, True, []


def renamed(messages, names):
    for message in messages:
        message.name = names
        yield message


def bad_messages(rng, clean):
    """One message of the run is not as it should be. What a robot records must not be answered wrongly."""
    kind = rng.choice(["NaN", "infinite", "short array", "long array", "no arrays", "name twice", "zero stamp",
                       "stamp back", "renamed", "reordered"])
    all_messages = list(messages_of(clean))
    index = rng.randrange(len(all_messages))
    message = all_messages[index]
    if kind in ("NaN", "infinite"):
        message.effort = [message.effort[0], NAN if kind == "NaN" else INF]
    elif kind == "short array":
        message.effort = message.effort[:1]
    elif kind == "long array":
        message.effort = message.effort + [0.0] * rng.choice([1, 100_000])
    elif kind == "no arrays":
        message.position, message.effort = [], []
    elif kind == "name twice":
        message.name = ["joint_motor", "joint_motor"]
    elif kind == "zero stamp":
        message.header.stamp = genpy.Time(0)
    elif kind == "stamp back":
        message.header.stamp = genpy.Time(START - 10)
    elif kind == "renamed":
        for each in all_messages[index:]:
            each.name = ["elbow_motor", "elbow_sensor"]
    else:
        for name in ("name", "position", "effort"):
            setattr(message, name, getattr(message, name)[::-1])
    times = [START + i * 1e-3 for i in range(len(all_messages))]  # when the recorder received them
    body = timed_bag(all_messages, times)
    return "%s in message %d" % (kind, index), body, False, []


def timed_bag(messages, times):
    folder = tempfile.mkdtemp()
    path = os.path.join(folder, "made.bag")
    try:
        with rosbag.Bag(path, "w") as bag:
            for message, time in zip(messages, times):
                bag.write("/joint_states", message, genpy.Time.from_sec(time))
        return read(path)
    finally:
        shutil.rmtree(folder)


def two_recordings_in_one(rng, clean):
    messages = list(messages_of(clean))
    return "the run twice", bag_bytes(messages + messages), False, []


GENERATORS = [undamaged, truncated, truncated_with_noise, truncated_and_reindexed, not_indexed, not_indexed_then_reindexed, bits_flipped,
              bits_flipped_and_reindexed, bytes_replaced, lengths_replaced, not_a_bag, no_messages, bad_messages,
              two_recordings_in_one]


def values_of(header, rows):
    """What a bag has of a record, without its times."""
    places = [header.index(name) for name in ("motor_torque", "motor_position", "sensor_torque")]
    return {tuple(float(row[place]) for place in places) for row in rows}


def judge_conversion(clean, exact):
    """Every row that comes out went in; of a bag with flipped bits (it has no check sums) all but some rows."""
    def judge(folder, code, err):
        header, rows = table_of(read(folder + "/out.csv"))
        times = [float(row[0]) for row in rows]
        strange = values_of(header, rows) - values_of(clean.header, clean.rows)
        if not rows or times != sorted(set(times)) or (strange if exact else len(strange) > 64):
            return BAD, "%d of %d rows are not in the input" % (len(strange), len(rows))
        return RIGHT, "%d rows" % len(rows)
    return judge


def case(rng, clean, generate):
    what, body, refuse, says = generate(rng, clean)
    files = {"record.bag": body, "rig.yaml": clean.rig, "curve.yaml": clean.curve}
    if rng.random() < 0.7:
        judge = judge_answered if generate is undamaged else judge_diagnosis
        command = ["diagnose_record", "record.bag", "--rig", "rig.yaml", "--curve", "curve.yaml", "--json", "out.json"]
        outputs = ["out.json"]
    else:
        exact = "flipped" not in what and "bytes" not in what and " at byte" not in what
        command, judge, outputs = ["convert_record", "record.bag", "out.csv"], judge_conversion(clean, exact), [
            "out.csv"]
    return Case(name_of(generate), what, files, "record.bag", command, outputs, judge, refuse, says)


def name_of(generate):
    return "bag: " + generate.__name__.replace("_", " ")


def classes(clean):
    return {name_of(g): (lambda rng, g=g: case(rng, clean, g)) for g in GENERATORS}
