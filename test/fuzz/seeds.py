#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes what the fuzzers begin with: rig files of the package, a small curve, a baseline, limits, small records and
recordings."""
import os
import random
import re
import shutil
import sqlite3
import struct
import sys

import numpy
import rosbag
import rospy
from sensor_msgs.msg import JointState

QUANTILES = 100  # kQuantiles

CONDITIONS = """conditions: {rig: r, rig_digest: d, version: v, signal: sensor_torque, excitation: square, amplitude: 0.05,
  excitation_level: 0.05, frequency: 10, sampling_rate: 1000, apd: {classes: 4, lower: -1, upper: 1}, periods: 1,
  settling_periods: 2, seeds: 1, noise: 0, motor_travel: 0.1, output_locked: true, angular: false}"""
CURVE = """schema_version: 1
%s
backlash_to_angle: 67
coverage_factor: 2
noise_levels: [0, 0.1]
points:
  - {backlash: 0, half_gap: 0, skewness: 1, scatter: 0, monotonic: true, signal_level: 0.1, mean: [1, 1], between: [0, 0], within: [0, 0]}
  - {backlash: 1e-4, half_gap: 0, skewness: 1, scatter: 0, monotonic: true, signal_level: 0.1, mean: [1, 1], between: [0, 0], within: [0, 0]}
""" % CONDITIONS
FAMILY = """family:
  segments: [{floor: 0, threshold: [1, 1], misfit: [0, 0]}]
  members: [{quantiles: [%s]}, {quantiles: [%s]}]
"""
BASELINE = """schema_version: 1
rig: r
rig_digest: d
methods: [lost_motion]
backlash: 8e-5
interval: [7e-5, 9e-5]
backlash_angle: 5e-3
angle_interval: [4e-3, 6e-3]
skewness: 1.5
"""
LIMITS = "schema_version: 1\nbacklash: {watch: 1e-4, service: 1.5e-4, stop: 2e-4}\n"
RECORDS = ["time,motor_torque\n0,1\n0.001,2\n", "time,motor_position,load_position\r\n0,1,2\r\n1,2,3\r\n",
           "\ufefftime, sensor_torque\n0, -1e-3\n0.5, nan\n", "time,motor_torque\n0,1\n0,1\n1,2\n\n\n", "time;motor_torque\n0;1\n",
           "time [ms],motor_position (deg)\n0,1\n2,3\n", "# bench\nt [ms];phi [deg];Iq\n0;1,5;2\n1;2,5;3\n",
           "t\tphi\tIq\n[s]\tarcmin\t\n1700000000.25\t1\t2\n1700000000.5\t1\t2\n",
           "\"t [hh:mm:ss]\",phi [rad],Iq,\"a \"\"b\"\", c\"\n9:00:00.5,1,2,\n9:00:01,1,2,\"x\"\n"]
TABLES = ["\"(1, 0.5)\" 65535 7\n(1,2) 3 4 \ninf 5 6\n", "# bench\n\"(1, 0.5)\",65535,7\n\"[1 2]\",3,4,\n",
          "Axis\nt,A,B,C\nms,q,duty,supply\n0,[1 2],3,4\n0.5,(3;4),65000,nan\n",
          '{"mass": 1, "entries": [{"t": 0, "q": [1, 2], "duty": 65535, "supply": 7.5}, {"t": 1, "q": NaN, "duty": 1, "supply": 1}]}',
          '{"t": [0, 1], "q": [[1, 2], [3, 4]], "duty": [1, 2], "supply": [true, null]}', "[{\"t\": 1e9}]"]


def write(folder, name, text):
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, name), "wb") as out:
        out.write(text if isinstance(text, bytes) else text.encode())


def joint_states():
    for i in range(30):
        message = JointState(name=["joint_motor", "joint_load"], position=[0.1 * i, 0.1 * i - 0.01], effort=[0.5, -0.5])
        message.header.stamp = rospy.Time(1_700_000_000, 1_000_000 * i)
        yield message


def cdr(message):
    """Little-endian CDR, strings and doubles aligned from behind the four bytes that say so."""
    body = b""

    def put(form, *values):
        nonlocal body
        size = 8 if "d" in form else 4
        body += b"\0" * (-len(body) % size) + struct.pack("<" + form, *values)

    def text(words):
        nonlocal body
        put("I", len(words) + 1)
        body += words.encode() + b"\0"

    put("iI", message.header.stamp.secs, message.header.stamp.nsecs)
    text("")
    put("I", len(message.name))
    for name in message.name:
        text(name)
    for values in (message.position, message.velocity, message.effort):
        put("I", len(values))
        if values:
            put("%dd" % len(values), *values)
    return b"\0\1\0\0" + body


def write_recordings(data, out):
    os.makedirs(out, exist_ok=True)
    for compression in (rosbag.Compression.NONE, rosbag.Compression.LZ4, rosbag.Compression.BZ2):
        with rosbag.Bag(os.path.join(out, compression + ".bag"), "w", compression, 1500) as bag:
            for message in joint_states():
                bag.write("/joint_states", message, message.header.stamp)
    for name in sorted(os.listdir(data)):
        if name.endswith(".mcap"):
            shutil.copy(os.path.join(data, name), out)
    path = os.path.join(out, "run.db3")
    if os.path.exists(path):
        os.remove(path)
    with sqlite3.connect(path) as db:
        db.execute("PRAGMA page_size=512")
        db.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
        db.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        db.execute("INSERT INTO topics VALUES(1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr')")
        db.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(1, ?, ?)",
                       [(m.header.stamp.to_nsec(), cdr(m)) for m in joint_states()])
    for name in sorted(os.listdir(out)):  # what a full disk and a killed recorder leave
        with open(os.path.join(out, name), "rb") as stream:
            body = stream.read()
        noise = bytes(random.Random(name).randrange(256) for _ in range(500))
        cut = body[:len(body) * 7 // 10]
        for kind, damaged in (("cut", cut), ("noise", cut + noise)):
            write(out, kind + "_" + name, damaged)


def main(config, out):
    for name in sorted(os.listdir(config)):
        if os.path.isdir(os.path.join(config, name)):
            continue
        with open(os.path.join(config, name), encoding="utf-8") as stream:
            text = re.sub(r"(?m)^test_runs: .*$", "", stream.read())  # names another file
        bare = re.sub(r"(?m) *(#.*)?$\n?", lambda m: "\n" if m.group().endswith("\n") else "", text)
        write(os.path.join(out, "rig"), name, re.sub(r"\n+", "\n", bare))
    numbers = ", ".join(str(i) for i in range(QUANTILES))
    for name, text in (("curve", CURVE), ("family", CURVE + FAMILY % (numbers, numbers)), ("baseline", BASELINE),
                       ("limits", LIMITS)):
        write(os.path.join(out, "curve"), name, text)
    for number, text in enumerate(RECORDS):
        write(os.path.join(out, "csv"), "record_%d" % number, text)
    for number, text in enumerate(TABLES):
        write(os.path.join(out, "table"), "table_%d" % number, text)
    q = numpy.arange(8.).reshape(4, 2)
    for save in (numpy.savez, numpy.savez_compressed):
        save(os.path.join(out, "table", save.__name__ + ".npz"), t=q[:, 0], q=numpy.asfortranarray(q), duty=q[:, 1].astype(">u2"),
             supply=q[:, 1].astype("f4"))
    write_recordings(os.path.join(config, "..", "test", "data", "recording"), os.path.join(out, "recording"))
    rng = random.Random(1)
    for number in range(8):
        write(os.path.join(out, "joint_state"), "messages_%d" % number, bytes(rng.randrange(256) for _ in range(2000)))


if __name__ == "__main__":
    main(*sys.argv[1:])
