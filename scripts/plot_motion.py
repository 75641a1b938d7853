#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws a planned motion: the angle of each joint with the angles at which gravity hides its gap, and the load on its mesh.

usage: plot_motion.py PLAN.json TRAJECTORY.csv --out PICTURE   (of plan_motion --json and --csv)
"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

plt = plotting.page_pyplot()
FLANKS = {-1: "tab:orange", 1: "tab:blue"}
STATUS = {"shown": "shown", "unconfirmed": "not confirmed", "not_found": "no motion found", "impossible": "cannot be shown"}


def draw_angle(axes, time, angle, name, joint):
    axes.plot(time, angle, color="black", lw=1)
    low, high = min(angle), max(angle)
    margin = 0.1 * (high - low) + 1e-3
    axes.set_ylim(low - margin, high + margin)
    gap = joint["gap"]
    for part in gap["hidden"] if gap else []:
        axes.axhspan(part["from"], part["to"], color=FLANKS[part["flank"]], alpha=0.15, lw=0)
    axes.set_title("%s%s" % (name, ": " + STATUS[gap["status"]] if gap else ""))
    axes.set_ylabel("angle [rad]")


def draw_load(axes, time, load_, gap):
    axes.plot(time, load_, color="black", lw=1)
    if not gap:
        return
    for flank, colour in FLANKS.items():
        certain = [flank * each > gap["certain"] for each in load_]
        axes.fill_between(time, 0, load_, where=certain, color=colour, alpha=0.5, lw=0)
        axes.axhline(flank * gap["certain"], color="grey", lw=0.6, ls=":")
    axes.set_ylabel("mesh torque [N m]")


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("plan", metavar="PLAN.json")
    parser.add_argument("trajectory", metavar="TRAJECTORY.csv")
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    plan = plotting.load_json(arguments.plan, "a plan of plan_motion")
    trajectory = plotting.load_columns(arguments.trajectory, "a trajectory")
    joints = plan.get("joints", {})
    if not joints or any(name + "/mesh_torque" not in trajectory for name in joints):
        plotting.fail(65, "%s: not the trajectory of %s" % (arguments.trajectory, arguments.plan))
    figure, panels = plt.subplots(len(joints), 2, squeeze=False, sharex=True, figsize=(11, 1.9 * len(joints) + 0.6),
                                  constrained_layout=True)
    for (left, right), (name, joint) in zip(panels, joints.items()):
        draw_angle(left, trajectory["time"], trajectory[name + "/reference_position"], name, joint)
        draw_load(right, trajectory["time"], trajectory[name + "/mesh_torque"], joint["gap"])
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    figure.suptitle("positive flank blue, negative flank orange: angles at which gravity holds the teeth there, loads that are certain",
                    fontsize=9)
    plotting.save(figure, arguments.out, 90)


if __name__ == "__main__":
    plotting.run(main)
