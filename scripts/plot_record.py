#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws a record: its channels over time, a part of it enlarged, and torque over position difference.

usage: plot_record.py RECORD.csv --out PICTURE [--from S] [--to S]
"""
import csv
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

plt = plotting.pyplot()
plt.rcParams["agg.path.chunksize"] = 10000  # long records

CHANNELS = ("motor_torque", "sensor_torque", "output_torque", "motor_current", "motor_velocity", "load_velocity", "acceleration",
            "motor_position", "load_position", "reference_position")
COLOURS = {"motor": "tab:blue", "load": "tab:orange", "sensor": "tab:green", "output": "tab:red"}


def load(path):
    """Columns by name; an empty cell is NaN."""
    try:
        with open(path, newline="") as stream:
            rows = csv.reader(stream)
            names = [name.strip() for name in next(rows)]
            columns = list(zip(*([float(cell) if cell.strip() else math.nan for cell in row] for row in rows)))
        if "time" not in names or len(columns) != len(names) or not set(names) & set(CHANNELS):
            raise ValueError("needs a column time and one of " + ", ".join(CHANNELS))
        return dict(zip(names, columns))
    except OSError as error:
        plotting.fail(66, error)
    except (StopIteration, ValueError) as error:
        plotting.fail(65, "%s: not a record: %s" % (path, error or "empty"))


def part(record, start, end):
    kept = [i for i, t in enumerate(record["time"]) if start <= t <= end]
    if len(kept) < 2:
        plotting.fail(65, "fewer than two samples from %g s to %g s" % (start, end))
    return {name: [column[i] for i in kept] for name, column in record.items()}


def panels(record):
    """Unit and lines of each panel: (label, values)."""
    def lines(*names):
        return [(name, record[name]) for name in names if name in record]
    result = [("torque [N m]", lines("motor_torque", "sensor_torque", "output_torque")), ("current [A]", lines("motor_current")),
              ("speed [rad/s]", lines("motor_velocity", "load_velocity")),
              ("acceleration [rad/s$^2$]", lines("acceleration")),
              ("position [rad]", lines("motor_position", "load_position", "reference_position"))]
    for unit, names in (("speed difference [rad/s]", ("motor_velocity", "load_velocity")),
                        ("position difference [rad]", ("motor_position", "load_position"))):
        if all(name in record for name in names):
            values = [a - b for a, b in zip(*(record[name] for name in names))]
            result.append((unit, [("motor - load", values)]))
    return [(unit, shown) for unit, shown in result if shown]


def draw(axes, time, lines):
    for label, values in lines:
        axes.plot(time, values, lw=0.7, label=label, color=COLOURS.get(label.split("_")[0]))
    if len(lines) > 1:
        axes.legend(fontsize=7, loc="upper right")
    axes.grid(True, alpha=0.3)


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("record", metavar="RECORD.csv")
    parser.add_argument("--out", required=True, help="picture to write: .png, .svg or .pdf")
    parser.add_argument("--from", dest="start", type=float, help="start of the enlarged part [s]; default: the middle")
    parser.add_argument("--to", dest="end", type=float, help="its end [s]; default: a twentieth of the record later")
    arguments = parser.parse_args()
    record = load(arguments.record)
    first, last = record["time"][0], record["time"][-1]
    start = arguments.start if arguments.start is not None else 0.5 * (first + last)
    end = arguments.end if arguments.end is not None else min(last, start + 0.05 * (last - first))
    zoom = part(record, start, end)
    whole, near = panels(record), panels(zoom)
    loop = whole[-1][0].startswith("position difference") and "motor_torque" in record
    figure = plt.figure(figsize=(13, 2.1 * len(whole) + (3.4 if loop else 0.6)), constrained_layout=True)
    grid = figure.add_gridspec(len(whole) + loop, 2, height_ratios=[1] * len(whole) + [1.5] * loop)
    shared = [None, None]
    for row in range(len(whole)):
        for column, (source, shown) in enumerate(((record, whole), (zoom, near))):
            axes = figure.add_subplot(grid[row, column], sharex=shared[column])
            shared[column] = axes
            draw(axes, source["time"], shown[row][1])
            if column == 0:
                axes.set_ylabel(shown[row][0])
            if row == len(whole) - 1:
                axes.set_xlabel("time [s]")
    if loop:
        for column, (source, shown) in enumerate(((record, whole), (zoom, near))):
            axes = figure.add_subplot(grid[len(whole), column])
            axes.plot(shown[-1][1][0][1], source["motor_torque"], lw=0.5, color="tab:purple")
            axes.set_xlabel("position difference, motor - load [rad]")
            axes.set_ylabel("motor torque [N m]" if column == 0 else "")
            axes.grid(True, alpha=0.3)
    figure.suptitle("%s; right: %g s to %g s" % (os.path.basename(arguments.record), start, end))
    plotting.save(figure, arguments.out, 80)


if __name__ == "__main__":
    plotting.run(main)
