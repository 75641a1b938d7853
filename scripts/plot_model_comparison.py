#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws what compare_models found: position difference, speed difference after an impact, errors of the models.

usage: plot_model_comparison.py MODELS.json --out PICTURE
"""
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

COLOURS = ("tab:red", "tab:orange", "tab:blue", "tab:green", "tab:purple", "tab:brown")
MEASURED = dict(color="black", lw=2.2, alpha=0.45, label="measured")
SPAN = 0.3  # s either side of the engagement in the panels of the position difference
CHANNELS = (("followed", "deflection", "position\ndifference"), ("followed", "speed_difference", "speed\ndifference"),
            ("followed", "torque", "torque"), ("free", "deflection", "free: position\ndifference"),
            ("free", "speed_difference", "free: speed\ndifference"), ("free", "motor_speed", "free: motor\nspeed"))


def finite(values, scale):
    return [math.nan if v is None else scale * v for v in values]


def window(data, time, before, after):
    n = len(data["measured"]["deflection"])
    at = (time - data["first_time"]) / data["interval"]
    return max(0, round(at - before / data["interval"])), min(n, round(at + after / data["interval"]))


def two_engagements(data):
    """Two places of the load: where the best model but one swings less than the record, and where more."""
    inside = [e for e in data["engagements"] if window(data, e["time"], SPAN, 0)[0] > 0] or data["engagements"]
    by_error = sorted(data["models"], key=lambda m: m["followed"]["deflection"]["error"])
    model = by_error[min(1, len(by_error) - 1)]

    def lacking(engagement):
        low, high = window(data, engagement["time"], SPAN, SPAN)
        measured, predicted = data["measured"]["deflection"][low:high], model["traces"]["deflection"][low:high]
        return sum(abs(v) for v in measured) - sum(abs(v) for v in predicted)
    return [max(inside, key=lacking), min(inside, key=lacking)]


def draw_deflection(axes, data, engagement):
    low, high = window(data, engagement["time"], SPAN, SPAN)
    time = [data["first_time"] + k * data["interval"] for k in range(low, high)]
    axes.plot(time, finite(data["measured"]["deflection"][low:high], 1e3), **MEASURED)
    for colour, model in zip(COLOURS, data["models"]):
        axes.plot(time, finite(model["traces"]["deflection"][low:high], 1e3), lw=1, color=colour, label=model["name"])
    axes.set_title("load at %.2f rad" % engagement["load_position"], fontsize=10)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("motor - load [mrad]")


def draw_free(axes, data, engagement, measured, predicted, unit):
    low, high = window(data, engagement["time"], 0.01, 0.1)
    time = [1e3 * (data["first_time"] + k * data["interval"] - engagement["time"]) for k in range(low, high)]
    scale = 1e3 if unit == "mrad" else 1
    axes.plot(time, finite(data["measured"][measured][low:high], scale), **MEASURED)
    for colour, model in zip(COLOURS, data["models"]):
        axes.plot(time, finite(model["traces"][predicted][low:high], scale), lw=1.1, color=colour, label=model["name"])
    axes.set_xlabel("time after the middle of the gap [ms]")
    axes.set_ylabel("motor - load [%s]" % unit)


def draw_errors(axes, data):
    models, width = data["models"], 0.8 / len(data["models"])
    shown = [c for c in CHANNELS if all(c[1] in m[c[0]] for m in models)]
    for i, (colour, model) in enumerate(zip(COLOURS, models)):
        at = [c + (i - 0.5 * (len(models) - 1)) * width for c in range(len(shown))]
        errors = [100 * model[way][channel]["error"] for way, channel, _ in shown]
        axes.bar(at, errors, width, color=colour, label=model["name"])
        for x, error in zip(at, errors):
            axes.text(x, error * 1.08, "%.2g" % error, ha="center", fontsize=7)
    for c, (way, channel, _) in enumerate(shown):
        floor = 100 * min(m[way][channel]["floor"] for m in models)
        axes.plot([c - 0.45, c + 0.45], [floor, floor], color="black", lw=1.2, ls="--",
                  label="noise alone" if c == 0 else None)
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.set_ylim(0.6 * low, 8 * high)  # room for the legend
    axes.set_xticks(range(len(shown)))
    axes.set_xticklabels([text for _, _, text in shown], fontsize=9)
    axes.set_ylabel("relative error [%]")
    axes.grid(True, axis="y", alpha=0.3)


def draw(data, plt):
    if not data["models"]:
        raise ValueError("no models")
    engagements = two_engagements(data) if data["engagements"] else []
    rows = 3 if engagements else 1
    figure = plt.figure(figsize=(13, 4.2 * rows), constrained_layout=True)
    grid = figure.add_gridspec(rows, 2)
    for column, engagement in enumerate(engagements):
        draw_deflection(figure.add_subplot(grid[0, column]), data, engagement)
    if engagements:
        draw_free(figure.add_subplot(grid[1, 0]), data, engagements[0], "speed_difference", "free_speed_difference",
                  "rad/s")
        draw_free(figure.add_subplot(grid[1, 1]), data, engagements[0], "raw_deflection", "free_deflection", "mrad")
    draw_errors(figure.add_subplot(grid[rows - 1, :]), data)
    for axes in figure.axes:
        axes.grid(True, alpha=0.3)
    figure.axes[-1].legend(fontsize=8, loc="upper center", ncol=4)
    figure.axes[0].legend(fontsize=8, loc="upper right")
    figure.suptitle("%s. Top: load driven by the recorded motor; middle: the engagement at the left, driven by the "
                    "recorded torque" % os.path.basename(data["record"]), fontsize=11)
    return figure


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("models", metavar="MODELS.json")
    parser.add_argument("--out", metavar="PICTURE", required=True, help="picture to write: .png, .svg or .pdf")
    arguments = parser.parse_args()
    data = plotting.load_json(arguments.models, "a comparison of models")
    plt = plotting.pyplot()
    try:
        figure = draw(data, plt)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        plotting.fail(65, "%s: not a comparison of models: %r" % (arguments.models, error))
    plotting.save(figure, arguments.out, 90)


if __name__ == "__main__":
    plotting.run(main)
