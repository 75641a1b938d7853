#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How motor minus load position follows the torque behind the gear while the load stands, at each reversal.

usage: lost_motion_by_torque.py RECORD.csv... [--reversed] [--band DEG]

Needs motor_position, load_position and output_torque. Prints, for each stop of the load at an end of its travel, the change
of the difference, the torque at either end of it, and the stiffness in bands of the difference.
"""
import argparse

import numpy as np

STANDS = np.radians(0.1)   # of the end of the travel; two steps of 8192 counts per turn
SHORTEST = np.radians(0.5)  # change of the difference that counts as a reversal
START = 1.0                # s, left out: the tool is taken up
PAUSE = 200                # samples between two stops


def stops(record, load):
    after = record["time"] > record["time"][0] + START
    for end, there in (("upper", load > load[after].max() - STANDS), ("lower", load < load[after].min() + STANDS)):
        at = np.where(there & after)[0]
        for stop in np.split(at, np.where(np.diff(at) > PAUSE)[0] + 1):
            if stop[-1] < len(load) - 1:
                yield end, stop


def stiffness(x, torque, low, high):
    inside = (x >= low) & (x < high)
    return np.polyfit(x[inside], torque[inside], 1)[0] if inside.sum() > 5 and np.ptp(x[inside]) > 0 else float("nan")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("records", nargs="+")
    parser.add_argument("--reversed", action="store_true", help="output_torque > 0 drives the load back")
    parser.add_argument("--band", type=float, default=0.3, help="width [deg]")
    arguments = parser.parse_args()
    for path in arguments.records:
        record = np.genfromtxt(path, delimiter=",", names=True)
        torque = record["output_torque"] * (-1 if arguments.reversed else 1)
        difference, load = record["motor_position"] - record["load_position"], record["load_position"]
        print(path)
        for end, stop in stops(record, load):
            x, t = difference[stop], torque[stop]
            if abs(x[-1] - x[0]) < SHORTEST:
                continue
            edges = np.arange(np.ceil(np.degrees(x.min()) / arguments.band) * arguments.band, np.degrees(x.max()),
                              arguments.band)
            bands = ["%.2f:%.1f" % (edge, stiffness(x, t, *np.radians([edge, edge + arguments.band])))
                     for edge in edges if edge + arguments.band <= np.degrees(x.max()) + 1e-9]
            print("  %6.2f s, %s end: %.2f deg, %5.1f to %5.1f mN m; from [deg]: stiffness [N m/rad]  %s" % (
                record["time"][stop[0]], end, np.degrees(abs(x[-1] - x[0])), 1e3 * t[0], 1e3 * t[-1],
                "  ".join(bands)))


if __name__ == "__main__":
    main()
