#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws the JSON of separability_map: one column per disturbance, one row per way to estimate backlash.

Exit codes: 0 done, 64 usage, 65 not a map, 66 map missing, 70 matplotlib missing, 73 cannot write.
"""
import os
import sys
import textwrap

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

MARKS = {"below_range": "<", "above_range": ">", "out_of_domain": "x", "insufficient_data": "0", "ambiguous": "?"}
MEANINGS = "x out of domain, > above the curve, < below it, ? ambiguous"


def draw_panel(axes, numpy, error, limit):
    """Colours only; what is not known stays grey."""
    values = numpy.ma.masked_invalid(numpy.array(error, dtype=float))
    axes.set_facecolor("0.85")
    return axes.imshow(values, origin="lower", aspect="auto", cmap="RdBu_r", vmin=-limit, vmax=limit,
                       interpolation="nearest")


def mark(axes, column, row):
    axes.plot(column, row, "o", color="k", markersize=2.2)


def mark_equivalent(axes, one_map, resolution):
    """A dot where the disturbance moves skewness by more than its own scatter."""
    for i, row in enumerate(one_map["equivalent"]):
        for k, value in enumerate(row):
            if value is not None and resolution[k] is not None and abs(value) > resolution[k]:
                mark(axes, k, i)


def mark_answers(axes, plt, answers):
    """What most of the records of a cell got."""
    for i, row in enumerate(answers["status"]):
        for k, status in enumerate(row):
            right, wrong, refused = (answers[key][i][k] for key in ("right", "wrong", "refused"))
            if refused > right + wrong:
                axes.add_patch(plt.Rectangle((k - 0.5, i - 0.5), 1, 1, facecolor="0.85", edgecolor="0.6", hatch="////",
                                             linewidth=0))
                axes.text(k, i, MARKS.get(status, ""), ha="center", va="center", fontsize=7)
            elif wrong > right:
                mark(axes, k, i)


def label(axes, one_map, backlash, last_row, unit):
    ticks = list(range(0, len(backlash), max(1, (len(backlash) - 1) // 4)))
    axes.set_xticks(ticks)
    axes.set_xticklabels(["%.4g" % backlash[k] for k in ticks] if last_row else [])
    axes.set_yticks(range(len(one_map["levels"])))
    axes.set_yticklabels(["%g" % level for level in one_map["levels"]], fontsize=8)
    for tick, level in zip(axes.get_yticklabels(), one_map["levels"]):
        if level == one_map["none"]:
            tick.set_fontweight("bold")
    if last_row:
        axes.set_xlabel("true backlash [%s]" % unit)


def draw(data, plt, numpy):
    scale, unit = (1e3, "mrad") if data["angular"] else (1e6, "um")
    backlash = [scale * b for b in data["backlash"]]
    limit = 0.5 * (backlash[-1] - backlash[0])
    maps = data["maps"]
    rows = ["bare skewness"] + list(maps[0]["methods"])
    figure, grid = plt.subplots(len(rows), len(maps), figsize=(3.9 * len(maps) + 1.2, 3.2 * len(rows) + 1),
                                squeeze=False, constrained_layout=True)
    for column, one_map in enumerate(maps):
        grid[0][column].set_title(textwrap.fill(one_map["axis"], 36), fontsize=9.5)
        for row, name in enumerate(rows):
            axes = grid[row][column]
            error = one_map["equivalent"] if row == 0 else one_map["methods"][name]["error"]
            image = draw_panel(axes, numpy, [[None if e is None else scale * e for e in line] for line in error], limit)
            if row == 0:
                mark_equivalent(axes, one_map, data["resolution"])
            else:
                mark_answers(axes, plt, one_map["methods"][name])
            label(axes, one_map, backlash, row == len(rows) - 1, unit)
            if column == 0:
                axes.set_ylabel(name, fontsize=11)
    bar = figure.colorbar(image, ax=grid, shrink=0.6, extend="both", pad=0.01)
    bar.set_label("error of the backlash [%s]: too little (blue), too much (red)" % unit)
    figure.suptitle(
        "%s: what is taken for backlash. %d records of %d periods per cell, %g Hz, noise %g of the rms where it is not "
        "the level; bold level: no disturbance\n"
        "Bare skewness: its change over the slope of the curve, dot: more than 95 %% of its scatter.  Methods: white is "
        "right, dot: the interval misses the truth, hatched: refused (%s)" %
        (data["rig"], data["records"], data["periods"], data["sampling_rate"], data["noise"], MEANINGS),
        fontsize=9.5, linespacing=1.6)
    return figure


def main():
    parser = plotting.Parser("Draws the maps of separability_map.")
    parser.add_argument("map", metavar="MAP.json")
    parser.add_argument("--out", metavar="PICTURE", required=True, help="picture to write: .png, .svg or .pdf")
    arguments = parser.parse_args()
    data = plotting.load_json(arguments.map, "a separability map")
    try:
        plt = plotting.pyplot()
        import numpy
        figure = draw(data, plt, numpy)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        plotting.fail(65, "%s: not a separability map: %r" % (arguments.map, error))
    plotting.save(figure, arguments.out, 85)


if __name__ == "__main__":
    plotting.run(main)
