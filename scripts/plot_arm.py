#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws what two encoders of each joint of an arm differ by over the angle of the joint, and what diagnose_record says.

usage: plot_arm.py RECORD.csv REPORT.json [RECORD.csv REPORT.json]... --out PICTURE
"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

plt = plotting.page_pyplot()
POINTS = 6000  # per panel


def answer(joint):
    estimate = joint["estimates"][0]
    if estimate["backlash_angle"] is not None:
        return "play %.2f mrad [%.2f, %.2f]" % tuple(1e3 * x for x in [estimate["backlash_angle"]] + estimate["interval_angle"])
    if estimate["status"] == "below_range":
        return "at most %.3g mrad" % (1e3 * estimate["interval_angle"][1])
    return "cannot tell"


def draw(axes, record, name, joint, title):
    if name + "/load_position" not in record or name + "/motor_position" not in record:
        plotting.fail(65, "%s: no two encoders" % name)
    motor, load_position = record[name + "/motor_position"], record[name + "/load_position"]
    step = max(1, len(motor) // POINTS)
    axes.plot(load_position[::step], [1e3 * (m - q) for m, q in zip(motor[::step], load_position[::step])], ".", ms=1.5,
              color="tab:blue")
    axes.set_title("%s, %s: %s\nmesh torque %.2g to %.2g N m" % ((title, name, answer(joint)) + tuple(joint["mesh_torque"])))
    axes.set_xlabel("angle of the joint [rad]")
    axes.set_ylabel("motor - load [mrad]")


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", metavar="RECORD.csv REPORT.json")
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    if len(arguments.files) % 2:
        parser.error("every record needs its report")
    pairs = [(plotting.load_columns(arguments.files[i], "a record of an arm"),
              plotting.load_json(arguments.files[i + 1], "a report of diagnose_record"))
             for i in range(0, len(arguments.files), 2)]
    joints = max(len(report.get("joints", ())) for _, report in pairs)
    if joints == 0:
        plotting.fail(65, "%s: not the report of an arm" % arguments.files[1])
    figure, panels = plt.subplots(len(pairs), joints, squeeze=False, figsize=(4.6 * joints, 3.2 * len(pairs)),
                                  constrained_layout=True)
    for row, (record, report) in zip(panels, pairs):
        for axes, (name, joint) in zip(row, report["joints"].items()):
            draw(axes, record, name, joint, report["rig"])
    plotting.save(figure, arguments.out, 90)


if __name__ == "__main__":
    plotting.run(main)
