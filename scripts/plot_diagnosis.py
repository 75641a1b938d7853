#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws one diagnosis: torque over two periods, its APD, and the monitoring curve with the estimate marked.

usage: plot_diagnosis.py --record RECORD.csv --diagnosis OUT.json --curve CURVE.yaml --out PICTURE [--true METRES]
"""
import csv
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

plt = plotting.pyplot()


COLOURS = ("tab:orange", "tab:blue", "tab:green", "tab:purple", "tab:brown", "tab:red")  # of the methods, in their order


def read_columns(path, names):
    with open(path, newline="") as stream:
        rows = list(csv.DictReader(stream))
    return [[float(row[name]) for row in rows] if name in rows[0] else [] for name in names]


def unit(signal):
    for ending, name in (("torque", "N m"), ("position", "rad"), ("velocity", "rad/s"), ("current", "A")):
        if signal.endswith(ending):
            return name
    return "rad/s²"


def draw_torque(axes, record, apd):
    signal = apd["signal"]
    time, torque, motor = read_columns(record, ["time", signal, "motor_torque"])
    end = time[-1]
    start = end - 2 * apd["period"]
    shown = [i for i, t in enumerate(time) if t >= start]
    ms = [1e3 * (time[i] - start) for i in shown]
    if motor and unit(signal) == "N m":
        axes.plot(ms, [motor[i] for i in shown], color="0.6", lw=1, label="motor_torque (excitation)")
    axes.plot(ms, [torque[i] for i in shown], color="tab:blue", lw=0.8, label=signal)
    axes.set_xlabel("time [ms]")
    axes.set_ylabel("%s [%s]" % (signal.split("_")[-1], unit(signal)))
    axes.set_title("Signal over two periods")
    axes.legend(loc="upper right", fontsize=8)


def draw_apd(axes, apd):
    width = (apd["upper"] - apd["lower"]) / apd["classes"]
    centres = [apd["lower"] + (k + 0.5) * width for k in range(apd["classes"])]
    axes.bar(centres, apd["percentages"], width=width, color="tab:blue", edgecolor="white", lw=0.3)
    used = [c for c, p in zip(centres, apd["percentages"]) if p > 0]
    margin = 4 * width
    axes.set_xlim(min(used) - margin, max(used) + margin)
    axes.set_xlabel("amplitude [%s]" % unit(apd["signal"]))
    axes.set_ylabel("share of time [%]")
    axes.set_title("APD of %d periods, skewness %.3f" % (apd["periods"], apd["skewness"]))


def draw_curve(axes, curve, estimates, true):
    points = curve["points"]
    x = [1e6 * float(p["backlash"]) for p in points]
    y = [float(p["skewness"]) for p in points]
    scatter = [float(p["scatter"]) for p in points]
    axes.fill_between(x, [a - 2 * s for a, s in zip(y, scatter)], [a + 2 * s for a, s in zip(y, scatter)],
                      color="tab:blue", alpha=0.15, lw=0, label="curve, 2 standard deviations")
    axes.plot(x, y, color="tab:blue", lw=1)
    if true is not None:
        axes.axvline(1e6 * true, color="k", ls=":", label="true %.1f um" % (1e6 * true))
    # Every estimate is drawn at the height of the measured skewness; only apd_skewness itself comes from the curve.
    height = next((e["skewness"] for e in estimates if e["skewness"] is not None), y[len(y) // 2])
    for shift, (e, colour) in enumerate(zip(estimates, COLOURS)):
        if e["status"] != "ok" or not e["interval"]:
            axes.plot([], [], color=colour, label="%s: %s" % (e["method"], e["status"]))
            continue
        low, high = (1e6 * v for v in e["interval"])
        value, level = 1e6 * e["backlash"], height + 0.06 * shift
        axes.errorbar([value], [level], xerr=[[value - low], [high - value]], fmt="o", color=colour, capsize=4, ms=5,
                      label="%s: %.1f um [%.1f, %.1f]" % (e["method"], value, low, high))
    axes.set_xlabel("backlash, total free play along the line of action [um]")
    axes.set_ylabel("skewness of the class values [-]")
    axes.set_title("Monitoring curve (%s, %s Hz)" % (curve["conditions"]["rig"], curve["conditions"]["sampling_rate"]))
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.3 * (high - low))  # room for the legend
    axes.legend(fontsize=8, loc="upper right")


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("--record", required=True, help="CSV record")
    parser.add_argument("--diagnosis", required=True, help="JSON of diagnose_record")
    parser.add_argument("--curve", required=True, help="YAML of build_curve")
    parser.add_argument("--out", required=True, help="picture to write: .png, .svg or .pdf")
    parser.add_argument("--true", type=float, help="true backlash [m], where it is known")
    arguments = parser.parse_args()
    diagnosis = plotting.load_json(arguments.diagnosis, "a diagnosis")
    curve = plotting.load_yaml(arguments.curve, "a monitoring curve")
    if not diagnosis.get("apd"):
        plotting.fail(65, "%s: holds no APD" % arguments.diagnosis)
    figure, axes = plt.subplots(1, 3, figsize=(16, 4.8), constrained_layout=True)
    draw_torque(axes[0], arguments.record, diagnosis["apd"])
    draw_apd(axes[1], diagnosis["apd"])
    draw_curve(axes[2], curve, diagnosis["estimates"], arguments.true)
    for a in axes:
        a.grid(True, alpha=0.3)
    figure.suptitle(diagnosis["verdict"]["message"], fontsize=10)
    plotting.save(figure, arguments.out, 110)


if __name__ == "__main__":
    plotting.run(main)
