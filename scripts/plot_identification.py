#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws what the procedures of an identification saw: one panel each, as far as the records allowed them.

usage: plot_identification.py IDENTIFICATION.json --out PICTURE
"""
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

plt = plotting.pyplot()
MEASURED, FITTED = "tab:blue", "tab:red"
MOST_RECORDS = 4  # of which the fit is drawn


def friction(axes, lines):
    for colour, (subject, branches) in zip(("tab:blue", "tab:green"), sorted(lines.items())):
        for i, line in enumerate(branches):
            a, b = line["coulomb"]["value"], line["viscous"]["value"]
            axes.plot(line["speed"], line["torque"], "o", color=colour, label=subject if i == 0 else None)
            ends = [0, max(line["speed"], key=abs)]
            axes.plot(ends, [a + b * w for w in ends], "-", color=colour)
    axes.set(title="friction lines", xlabel="speed [rad/s]", ylabel="torque [N m]")
    axes.legend()


def inertia(axes, detail):
    labels = []
    for subject, found in sorted(detail.items()):
        for run in found["runs"]:
            value, error = run["inertia"]["value"], run["inertia"]["standard_error"]
            axes.errorbar(len(labels), value, yerr=2 * error if error else 0, fmt="o", color=MEASURED)
            axes.text(len(labels), value, "  %.4g" % value, va="center")
            labels.append("%s\n%.3g Hz" % (subject, run["frequency"]))
    axes.set(title="inertia at the line of the excitation", ylabel="inertia [kg m$^2$]", xlim=(-0.5, len(labels)),
             xticks=range(len(labels)), xticklabels=labels)
    axes.set_ylim(bottom=0)


def phase(axes, detail):
    frequency, _, measured, _, _, fitted = zip(*detail["points"])
    axes.semilogx(frequency, [math.degrees(p) for p in measured], ".", color=MEASURED, label="measured")
    axes.semilogx(frequency, [math.degrees(p) for p in fitted], "-", color=FITTED, label="two inertias")
    axes.set(title="frequency response, phase", xlabel="frequency [Hz]", ylabel="phase [deg]")
    axes.legend()


def response(axes, detail):
    frequency, magnitude, _, coherence, fitted, _ = zip(*detail["points"])
    axes.loglog(frequency, magnitude, ".", color=MEASURED, label="measured")
    axes.loglog(frequency, fitted, "-", color=FITTED, label="two inertias")
    for key, name in (("resonance", "$F_R$"), ("anti_resonance", "$F_{AR}$")):
        value = detail[key]["value"]
        axes.axvline(value, color="0.6", linewidth=0.8)
        axes.text(value, 1.3 * min(magnitude), " %s %.1f Hz" % (name, value), fontsize=8)
    axes.set(title="frequency response", xlabel="frequency [Hz]", ylabel="speed / torque [rad/s per N m]")
    axes.legend(loc="lower left")
    other = axes.twinx()
    other.plot(frequency, coherence, color="tab:green", linewidth=0.6)
    other.set(ylim=(0, 1.05))
    other.set_ylabel("coherence", color="tab:green")


def decay(axes, detail):
    for i, ringing in enumerate(detail["ringings"][:1]):
        time = [t - ringing["time"][0] for t in ringing["time"]]
        axes.plot(time, ringing["measured"], ".", color=MEASURED, label="measured")
        axes.plot(time, ringing["fitted"], "-", color=FITTED, label="damped sine")
    axes.set(title="ringing after an engagement (1 of %d)" % detail["engagements"], xlabel="time [s]",
             ylabel="motor - load")
    axes.legend()


def clearance(axes, detail):
    passage = detail["passages"][0]
    time = [t - passage["time"][0] for t in passage["time"]]
    axes.plot(time, passage["measured"], ".", color=MEASURED, label="measured")
    axes.plot(time, passage["fitted"], "-", color=FITTED, label="fitted")
    for wall in ("lower", "upper"):
        axes.axhline(passage[wall], color="0.5", linestyle="--", linewidth=0.8)
    axes.set(title="clearance, motor braked", xlabel="time [s]", ylabel="load - motor [rad]")
    axes.legend()


def gap_map(axes, detail):
    position, separation, error, _ = zip(*detail["bins"])
    shift = detail["wind_up"]["value"] or 0
    gap = [s - shift for s in separation]
    axes.errorbar(position, gap, yerr=[2 * e if e else 0 for e in error], fmt=".", color=MEASURED, markersize=3,
                  elinewidth=0.5, label="gap, $\\pm 2$ standard errors")
    mean = detail["mean_gap"]["value"]
    if mean is not None:
        turn = [2 * math.pi * i / 400 for i in range(401)]
        series = [mean + sum(h["amplitude"]["value"] * math.sin(h["order"] * q + h["phase"]["value"])
                             for h in detail.get("harmonics", [])) for q in turn]
        axes.plot(turn, series, color=FITTED, label="series")
    axes.set(title="backlash over load position", xlabel="load position [rad]", ylabel="backlash [rad]")
    axes.legend()


def trace(axes, detail, title, unit):
    zoom = detail["zoom"]
    time = [zoom["start"] + i * zoom["interval"] for i in range(len(zoom["measured"]))]
    for key, colour, label in (("measured", MEASURED, "measured"), ("predicted", FITTED, "fitted model")):
        axes.plot(time, [math.nan if y is None else y for y in zoom[key]], color=colour, linewidth=1, label=label)
    pairs = zip(zoom["measured"], zoom["predicted"])
    axes.plot(time, [math.nan if y is None or p is None else 10 * (y - p) for y, p in pairs], color="0.6",
              linewidth=0.6, label="difference x 10")
    axes.set(title="%s, %s" % (title, os.path.basename(detail["record"])), xlabel="time [s]", ylabel=unit)
    axes.legend(loc="upper right")


def panels(data):
    # What a procedure looked at and did not use would look as if it counted.
    unused = {p["name"] for p in data["procedures"] if not p["used"]}
    details, drawn = {key: value for key, value in data["details"].items() if key not in unused}, []
    for key, draw in (("friction_lines", friction), ("line_inertia", inertia), ("frequency_response", response),
                      ("frequency_response", phase), ("decay", decay), ("clearance", clearance),
                      ("gap_map", gap_map)):
        if details.get(key):
            drawn.append((draw, (details[key],)))
    linear = data["parameters"].get("coulomb", {}).get("unit") == "N"  # an axis of one inertia
    torque, unit = ("force", "force [N]") if linear else ("torque", "torque [N m]")
    for key, title, label in (("torque", torque, unit), ("deflection", "deflection", "motor - load [rad]")):
        for detail in details.get(key, [])[:MOST_RECORDS]:
            drawn.append((trace, (detail, title, label)))
    return drawn


def main():
    parser = plotting.Parser("Draws the JSON file of identify.")
    parser.add_argument("identification", metavar="IDENTIFICATION.json")
    parser.add_argument("--out", metavar="PICTURE", required=True, help="picture to write: .png, .svg or .pdf")
    arguments = parser.parse_args()
    data = plotting.load_json(arguments.identification, "an identification")
    try:
        drawn = panels(data)
        if not drawn:
            plotting.fail(65, "%s: holds nothing to draw" % arguments.identification)
        columns = min(2, len(drawn))
        rows = (len(drawn) + columns - 1) // columns
        figure, grid = plt.subplots(rows, columns, figsize=(7 * columns, 3.6 * rows), squeeze=False)
        for axes in grid.flat[len(drawn):]:
            axes.axis("off")
        for axes, (draw, values) in zip(grid.flat, drawn):
            draw(axes, *values)
        figure.tight_layout()
    except (KeyError, TypeError, IndexError, ValueError) as error:
        plotting.fail(65, "%s: not an identification: %r" % (arguments.identification, error))
    plotting.save(figure, arguments.out)


if __name__ == "__main__":
    plotting.run(main)
