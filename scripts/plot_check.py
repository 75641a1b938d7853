#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws what check_record saw: the channels as they were recorded, and each finding at its place.

Exit codes: 0 done, 64 usage, 65 not a check, 66 check missing, 70 matplotlib missing, 73 cannot write.
"""
import math
import os
import statistics
import sys
import textwrap

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

PANELS = (("torque", ("motor_torque", "sensor_torque", "output_torque")), ("current", ("motor_current",)),
          ("speed", ("motor_velocity", "load_velocity")), ("acceleration", ("acceleration",)),
          ("position", ("motor_position", "load_position", "reference_position")), ("difference", ("motor - load",)))
COLOURS = {"motor": "tab:blue", "load": "tab:orange", "sensor": "tab:green", "output": "tab:red", "reference": "0.5"}
MARKS = {"noted": "tab:gray", "mended": "tab:green", "cut": "darkorange", "refused": "tab:red"}
GAP = 10  # median distances of what is drawn, from which on no line joins two samples
WHOLE = 0.95  # share of the record, from which on a finding has no place in it


def broken(time, values):
    """A line that does not cross what was not recorded."""
    usual = statistics.median([b - a for a, b in zip(time, time[1:])] or [0])
    t, x = [], []
    for i, (now, value) in enumerate(zip(time, values)):
        if i and now - time[i - 1] > GAP * usual:
            t.append(now)
            x.append(math.nan)
        t.append(now)
        x.append(math.nan if value is None else value)
    return t, x


def belongs(finding, joint, names):
    """Whether a panel shows what the finding is about; those of the stamps are in all."""
    channel = finding["channel"]
    return channel == "time" or channel in [joint + "/" + name if joint else name for name in names] or \
        ("motor - load" in names and channel.split("/")[-1] in ("motor_position", "load_position") and
         channel.rpartition("/")[0] == joint)


def mark(axes, number, finding, extent):
    start, end = finding["from"], finding["to"]
    colour = MARKS[finding["consequence"]]
    if start is None or end is None or end - start >= WHOLE * (extent[1] - extent[0]):
        axes.text(0.005 + 0.03 * (number - 1), 0.97, str(number), transform=axes.transAxes, va="top", color="white", fontsize=9,
                  bbox={"boxstyle": "round,pad=0.2", "fc": colour, "ec": "none"}, zorder=5)
        return
    axes.axvspan(start, end, color=colour, alpha=0.25, lw=0)
    for edge in {start, end}:
        axes.axvline(edge, color=colour, lw=0.8, alpha=0.8)
    axes.annotate(str(number), (0.5 * (start + end), 1), xycoords=("data", "axes fraction"), ha="center", va="top",
                  xytext=(0, -3), textcoords="offset points", color="white", fontsize=9,
                  bbox={"boxstyle": "round,pad=0.2", "fc": colour, "ec": "none"}, zorder=5)


def draw_panel(axes, joint, quantity, channels, findings, extent):
    """`channels`: name and series of one unit; `findings` with their numbers."""
    for name, series in channels:
        axes.plot(*broken(series["time"], series["values"]), lw=0.8, label=name,
                  color="tab:purple" if quantity == "difference" else COLOURS.get(name.split("_")[0]))
    for number, finding in findings:
        if belongs(finding, joint, [name for name, _ in channels]):
            mark(axes, number, finding, extent)
    axes.set_xlim(*extent)
    axes.set_ylabel("%s [%s]" % (quantity, channels[0][1]["unit"]))
    axes.legend(fontsize=8, loc="lower right", bbox_to_anchor=(1, 0.98), ncol=len(channels), frameon=False)
    axes.grid(True, alpha=0.3)


def panels_of(joint):
    shown = []
    for quantity, names in PANELS:
        channels = [(name, joint["channels"][name]) for name in names if name in joint["channels"]]
        if channels:
            shown.append((quantity, channels))
    return shown


def list_of(findings):
    lines = []
    for number, finding in findings:
        lines += textwrap.wrap("%d  %s (%s): %s" % (number, finding["kind"], finding["consequence"], finding["message"]), 170,
                               subsequent_indent="    ")
    return lines or ["nothing is wrong with the recording"]


def draw(data):
    """One joint: its panels below each other; of several a row each."""
    plt = plotting.pyplot()
    plt.rcParams["agg.path.chunksize"] = 10000
    findings = list(enumerate(data["report"]["findings"], 1))
    shown = [(joint["name"], panels_of(joint)) for joint in data["joints"]]
    times = [t for _, panels in shown for _, channels in panels for _, s in channels for t in (s["time"][0], s["time"][-1])]
    extent = (min(times), max(times))
    single = len(shown) == 1
    rows = len(shown[0][1]) if single else len(shown)
    columns = 1 if single else max(len(panels) for _, panels in shown)
    lines = list_of(findings)
    below = 0.16 * len(lines) + 0.2
    height = 2.0 * rows + 0.7
    figure = plt.figure(figsize=(12, height + below), constrained_layout=True)
    upper, lower = figure.subfigures(2, 1, height_ratios=(height, below))
    grid = upper.subplots(rows, columns, squeeze=False, sharex=True)
    for j, (joint, panels) in enumerate(shown):
        for p, (quantity, channels) in enumerate(panels):
            axes = grid[p][0] if single else grid[j][p]
            draw_panel(axes, joint, quantity, channels, findings, extent)
            if joint:
                axes.set_title(joint, fontsize=9, loc="left")
    for axes in grid.flat:
        axes.set_visible(bool(axes.lines))
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    upper.align_ylabels()
    upper.suptitle(os.path.basename(data["report"]["record"]), fontsize=11)
    lower.text(0.01, 0.98, "\n".join(lines), va="top", fontsize=9)
    return figure


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("check", metavar="CHECK.json", help="series of check_record --plot")
    parser.add_argument("--out", required=True, metavar="OUT.png", help="picture to write (.png, .svg, .pdf)")
    arguments = parser.parse_args()
    data = plotting.load_json(arguments.check, "a check")
    try:
        figure = draw(data)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        plotting.fail(65, "%s: not a check: %r" % (arguments.check, error))
    plotting.save(figure, arguments.out, 100)


if __name__ == "__main__":
    plotting.run(main)
