#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws a study of integrators: hysteresis loops and motions of single teeth, and work against precision.

Exit codes: 0 done, 64 usage, 65 not a study, 66 study missing, 70 matplotlib missing, 73 cannot write.
"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

COLOURS = {"bogacki_shampine": "tab:gray", "cash_karp": "tab:olive", "dormand_prince": "tab:blue",
           "fehlberg": "tab:cyan", "tsitouras": "tab:brown", "verner": "tab:green", "bdf": "tab:red", "adams": "tab:purple"}


def columns_of(tooth):
    """bdf loose, bdf tight, verner as loose."""
    bdf = sorted((d for d in tooth["drawn"] if d["method"] == "bdf"), key=lambda d: -d["tolerance"])
    verner = sorted((d for d in tooth["drawn"] if d["method"] == "verner"), key=lambda d: -d["tolerance"])
    return [bdf[0], bdf[-1], verner[0]]


def draw_loop(axes, drawn):
    """Fig. 3 or 4 with the axes of the paper."""
    x = [1e6 * v for v in drawn["penetration"]]
    axes.plot(x, drawn["force"], color=COLOURS[drawn["method"]], linewidth=1.2)
    axes.set_xlim(0, 100)
    axes.set_ylim(-10, 80)
    axes.set_xlabel("interpenetration [um]")
    axes.set_ylabel("reaction force [N]")


def draw_motion(axes, tooth, drawn):
    gap, n = 1e6 * tooth["gap"], len(drawn["penetration"]) - 1
    time = [1e3 * tooth["duration"] * k / n for k in range(n + 1)]
    axes.axhspan(0, 10 * gap, color="0.85", linewidth=0)
    axes.axhspan(-10 * gap, -gap, color="0.85", linewidth=0)
    axes.plot(time, [1e6 * v for v in drawn["penetration"]], color=COLOURS[drawn["method"]], linewidth=1.2)
    axes.set_xlim(0, time[-1])
    axes.set_ylim(-1.5 * gap, 0.75 * gap)
    axes.set_xlabel("time [ms]")
    axes.set_ylabel("tooth '%s' [um]" % tooth["name"])


def draw_teeth(study, plt):
    teeth = study["teeth"]
    figure, grid = plt.subplots(len(teeth) + 1, 3, figsize=(11, 2.6 * (len(teeth) + 1)), squeeze=False,
                                constrained_layout=True)
    for column, drawn in enumerate(columns_of(teeth[0])):
        draw_loop(grid[0][column], drawn)
    for row, tooth in enumerate(teeth, start=1):
        for column, drawn in enumerate(columns_of(tooth)):
            draw_motion(grid[row][column], tooth, drawn)
    for row, tooth in enumerate([teeth[0]] + teeth):
        for column, drawn in enumerate(columns_of(tooth)):
            grid[row][column].set_title("%s at %.0e (relative, m and m/s)" % (drawn["method"], drawn["tolerance"]),
                                        fontsize=9)
            grid[row][column].grid(True, alpha=0.3)
    figure.suptitle("Top: hysteresis loop, axes of Figs. 3 and 4 of Sarkar et al. (1997). Below: motion between the two "
                    "flanks (grey: inside a flank)", fontsize=10)
    return figure


def draw_work(study, plt):
    figure, grid = plt.subplots(2, len(study["work"]), figsize=(11, 8), squeeze=False, constrained_layout=True)
    for column, work in enumerate(study["work"]):
        for row, (key, label, scale) in enumerate((("evaluations", "evaluations of the derivative", 1),
                                                   ("cpu_time", "CPU time [ms]", 1e3))):
            axes = grid[row][column]
            for method, colour in COLOURS.items():
                points = [p for p in work["points"] if p["method"] == method and p["error"]]
                axes.loglog([scale * p[key] for p in points], [p["error"] for p in points], ".-", color=colour,
                            linewidth=1.2, markersize=5, label=method)
            if work["problem"] == "rig":
                own = study["rig_declared"]
                axes.plot(scale * own[key], own["error"], "o", markersize=11, markerfacecolor="none",
                          markeredgecolor="black", label="the rig file's solver")
            axes.set_ylim(1e-12, 1)
            lost = [m for m in COLOURS if all(p["error"] is None or p["error"] > 1 for p in work["points"]
                                              if p["method"] == m)]
            if lost:
                axes.text(0.97, 0.96, "error > 1 at all tolerances: " + ", ".join(lost), transform=axes.transAxes,
                          ha="right", va="top", fontsize=8)
            axes.set_xlabel(label)
            axes.set_ylabel("relative error, %s" % work["problem"])
            axes.grid(True, which="major", alpha=0.3)
    grid[0][-1].legend(fontsize=8)
    figure.suptitle("Work and precision: one impact (left), rig %s with a half gap of %.3g um for %.3g s (right)" %
                    (study["rig"], 1e6 * study["half_gap"], study["rig_duration"]), fontsize=10)
    return figure


def main():
    parser = plotting.Parser("Draws a study of integrators.")
    parser.add_argument("study", metavar="STUDY.json")
    parser.add_argument("--out", metavar="PREFIX", required=True, help="writes PREFIX_loops.png and PREFIX_work.png")
    arguments = parser.parse_args()
    study = plotting.load_json(arguments.study, "a study of integrators")
    try:
        plt = plotting.pyplot()
        figures = {"loops": draw_teeth(study, plt), "work": draw_work(study, plt)}
    except (KeyError, TypeError, ValueError, IndexError) as error:
        plotting.fail(65, "%s: not a study of integrators: %r" % (arguments.study, error))
    for name, figure in figures.items():
        plotting.save(figure, "%s_%s.png" % (arguments.out, name), 90)


if __name__ == "__main__":
    plotting.run(main)
