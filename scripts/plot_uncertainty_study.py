#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws an uncertainty study: estimates against the truth, and coverage and error by sensor noise.

Exit codes: 0 done, 64 usage, 65 not a study, 66 study missing, 70 matplotlib missing, 73 cannot write.
"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

COLOURS = {"apd_skewness": "tab:orange", "apd_shape": "tab:blue", "lost_motion": "tab:green",
           "position_difference": "tab:purple", "momentum_transfer": "tab:brown", "waveform": "tab:cyan",
           "combined": "black"}


def answers(study, method, position):
    """Truth, estimate, lower and upper end [um] of the records with an answer."""
    rows = []
    for trial in study["trials"]:
        estimate = trial["estimates"][method]
        if trial["position"] == position and estimate["status"] == "ok":
            rows.append([1e6 * v for v in [trial["backlash"], estimate["backlash"]] + estimate["interval"]])
    return rows


def draw_errors(axes, study, position):
    methods = [m for m in study["trials"][0]["estimates"] if m != "combined" and answers(study, m, position)]
    missed = []
    for method in methods:
        rows = answers(study, method, position)
        axes.plot([r[0] for r in rows], [r[1] - r[0] for r in rows], ".", markersize=4, alpha=0.7,
                  color=COLOURS.get(method), label=method)
        missed += [(r[0], r[1] - r[0]) for r in rows if not r[2] <= r[0] <= r[3]]
    axes.plot([m[0] for m in missed], [m[1] for m in missed], "o", markersize=7, markerfacecolor="none",
              markeredgecolor="red", markeredgewidth=0.8, label="interval misses the truth")
    axes.axhline(0, color="black", linewidth=0.6)
    axes.set_yscale("symlog", linthresh=2)
    axes.set_ylim(-100, 100)
    ticks = [-50, -20, -10, -5, -2, 0, 2, 5, 10, 20, 50]
    axes.set_yticks(ticks, [str(t) for t in ticks])
    axes.minorticks_off()
    axes.set_xlabel("true backlash [um]")
    axes.set_ylabel("estimate - truth [um]")
    axes.set_title("all channels" if position else "torque sensor alone")
    axes.legend(loc="lower left", ncol=2, fontsize=8)


def draw_by_noise(axes, study, key, scale, position):
    levels = sorted({t["noise"] for t in study["tables"] if t["noise"] is not None})
    widest = max(t["half_gap"] for t in study["tables"])
    for method in study["trials"][0]["estimates"]:
        values = []
        for level in levels:
            table = next(t for t in study["tables"]
                         if t["position"] == position and t["noise"] == level and t["half_gap"] == widest)
            row = next(r for r in table["rows"] if r["method"] == method)
            values.append(row[key] * scale if row[key] is not None else float("nan"))
        if any(v == v for v in values):
            axes.plot([100 * level for level in levels], values, marker="o", markersize=4, color=COLOURS.get(method),
                      linestyle="-" if position else "--",
                      label=method + (", all channels" if position else ", torque alone"))
    axes.set_xscale("log")
    axes.set_xticks([100 * level for level in levels], ["%g" % (100 * level) for level in levels])
    axes.minorticks_off()
    axes.set_xlabel("sensor noise [% of the torque's rms]")


def draw(study):
    plt = plotting.pyplot()
    figure, axes = plt.subplots(2, 2, figsize=(13, 9), constrained_layout=True)
    draw_errors(axes[0][0], study, True)
    draw_errors(axes[0][1], study, False)
    for position in (True, False):
        draw_by_noise(axes[1][0], study, "coverage", 100, position)
        draw_by_noise(axes[1][1], study, "median_error", 1e6, position)
    axes[1][0].axhspan(93, 97, color="tab:gray", alpha=0.2, linewidth=0)
    axes[1][0].set_ylabel("coverage of the 95 % interval [%]")
    axes[1][0].set_ylim(80, 101)
    axes[1][0].legend(fontsize=7, ncol=2, loc="lower left")
    axes[1][1].set_yscale("log")
    axes[1][1].set_ylabel("median error [um], half gaps to %g um" % (5e5 * study["max_backlash"]))
    figure.suptitle("%s: %d records of random backlash, seed %d" % (os.path.basename(study["rig"]), study["records"],
                                                                  study["seed"]))
    return figure


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("study", metavar="STUDY.json", help="written by uncertainty_study")
    parser.add_argument("--out", required=True, metavar="OUT.png", help="picture to write (.png, .svg, .pdf)")
    arguments = parser.parse_args()
    study = plotting.load_json(arguments.study, "an uncertainty study")
    try:
        figure = draw(study)
    except (KeyError, TypeError, ValueError, StopIteration) as error:
        plotting.fail(65, "%s: not an uncertainty study: %r" % (arguments.study, error))
    plotting.save(figure, arguments.out, 110)


if __name__ == "__main__":
    plotting.run(main)
