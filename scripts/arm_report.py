#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws the figures of a trace_residual report of an arm, as JSON with the pictures inside.

usage: arm_report.py REPORT.json --series SERIES.json --out FIGURES.json
"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

plt = plotting.page_pyplot()
try:
    import numpy as np
except ImportError as error:
    plotting.fail(70, error)

BEFORE, AFTER, MEASURED, EVENT = "#9aa7b5", "#1f6fb4", "#222222", "#f6d9b0"


def joint_figure(series, joint, found):
    """What the drive gave and what both models say; below it what they leave."""
    time = np.array(series["time"], float)
    measured, before, after = (np.array(joint[key], float) for key in ("measured", "before", "after"))
    if not np.isfinite(before).any():  # a joint at rest: nothing predicts it
        figure, above = plt.subplots(figsize=plotting.PAGE_FIGURE, layout="constrained")
        above.plot(time, measured, "-", color=MEASURED, linewidth=0.8)
        for event in series["events"]:
            if event["joint"] == joint["name"]:
                above.axvspan(event["begin"], event["end"], color=EVENT, zorder=0)
        above.set_ylabel("drive [%s]" % series["unit"])
        above.set_xlabel("time [s]")
        return plotting.picture(figure, joint["name"])
    figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(5.6, 4.2), layout="constrained",
                                          gridspec_kw={"height_ratios": (3, 2)})
    above.plot(time, measured, "-", color=MEASURED, linewidth=0.8, label="measured")
    for axes, sign, offset in ((above, 1, 0), (below, -1, measured)):
        lines = (("before", before, BEFORE), ("after", after, AFTER)) if found else (("model", before, AFTER),)
        for label, values, colour in lines:
            axes.plot(time, sign * values + offset, "-", color=colour, linewidth=0.8, label=label)
    above.set_ylabel("drive [%s]" % series["unit"])
    below.set_ylabel("left [%s]" % series["unit"])
    below.set_xlabel("time [s]")
    above.legend(loc="upper right", ncol=3)
    return plotting.picture(figure, joint["name"])


def main():
    parser = plotting.Parser("Draws the figures of a trace_residual report of an arm.")
    parser.add_argument("report", metavar="REPORT.json")
    parser.add_argument("--series", metavar="SERIES.json", required=True, help="of the same trace")
    parser.add_argument("--out", metavar="FIGURES.json", required=True, help="to write")
    arguments = parser.parse_args()
    report = plotting.load_json(arguments.report, "a trace")
    series = plotting.load_json(arguments.series, "the series of a trace")
    try:
        pictures = [joint_figure(series, joint, report["steps"]) for joint in series["joints"]]
    except (KeyError, TypeError, IndexError, ValueError) as error:
        plotting.fail(65, "%s: not a trace of an arm: %r" % (arguments.report, error))
    plotting.save_sections([plotting.section("What the drives give, joint by joint", pictures)], arguments.out)


if __name__ == "__main__":
    plotting.run(main)
