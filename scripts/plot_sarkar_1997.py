#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Simulates and draws Figs. 5, 6 and 10 of Sarkar, Ellis and Moore (1997) and compares with their published skewness.

Runs the package's commands simulate, build_curve and diagnose_record, which lie beside this script, and reads only what
they write. Axes are those of the paper; that of its Fig. 5 says N mm, but only N m fits an excitation of 0.05 N m.

Exit codes: 0 done, 64 usage, 65 not a rig like theirs, 70 a command or matplotlib is missing or failed,
73 cannot write; those of a command that refuses the rig file are passed on.
"""
import csv
import json
import math
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

PUBLISHED = {0: 4.6346, 25: 3.7013, 50: 2.9010, 75: 2.2009, 100: 1.5762}  # skewness by half gap [um], Fig. 10
RATE = 10000  # Hz; that of their simulation is not printed
PERIODS = 10  # per APD, after settling
SHOWN = 0.12  # s, length of Fig. 5
GAP = 50      # um, half gap of Figs. 5 and 6
DIAGNOSED = (0, 1, 2, 3)  # exit codes of diagnose_record: the grades


def default_rig():
    """In the repository beside the folder of this script, installed in share."""
    beside = os.path.dirname(os.path.abspath(__file__))
    folders = ["../config", "../../share/backlash_diagnosis/config"]
    paths = [os.path.normpath(os.path.join(beside, folder, "sarkar_1997.yaml")) for folder in folders]
    return next((path for path in paths if os.path.exists(path)), paths[0])


def run(words, codes=(0,)):
    """A command of the package, found beside this script (in a devel space: beside its relay)."""
    places = [os.path.dirname(os.path.abspath(path)) for path in (sys.argv[0], __file__)]
    command = next((c for c in (os.path.join(place, words[0]) for place in places) if os.access(c, os.X_OK)), None)
    if command is None:
        plotting.fail(70, "cannot find the command %s in %s; start this script with rosrun" % (words[0], places[0]))
    code = subprocess.run([command] + words[1:], stdout=subprocess.DEVNULL).returncode
    if code not in codes:
        plotting.fail(code if code > 0 else 70, "%s failed" % " ".join(words))


def metres(half_gap):
    return "%de-6" % half_gap


def torque(rig, half_gap, folder):
    """Time [s] and sensor torque [N m] from rest, as in Fig. 5."""
    path = os.path.join(folder, "torque_%d.csv" % half_gap)
    run(["simulate", rig, "--duration", str(SHOWN), "--half-gap", metres(half_gap), "--sample-rate", str(RATE),
         "--out", path])
    with open(path, newline="") as stream:
        rows = list(csv.DictReader(stream))
    return [float(row["time"]) for row in rows], [float(row["sensor_torque"]) for row in rows]


def distribution(rig, half_gap, duration, curve, folder):
    """APD as diagnose_record reports it."""
    record, report = (os.path.join(folder, "apd_%d.%s" % (half_gap, ending)) for ending in ("csv", "json"))
    run(["simulate", rig, "--duration", repr(duration), "--half-gap", metres(half_gap), "--sample-rate", str(RATE),
         "--out", record])
    run(["diagnose_record", record, "--rig", rig, "--curve", curve, "--method", "apd_skewness", "--json", report],
        DIAGNOSED)
    with open(report) as stream:
        return json.load(stream)["apd"]


def read_curve(path):
    import yaml
    with open(path) as stream:
        curve = yaml.load(stream, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    return curve["conditions"], [{key: float(p[key]) for key in ("half_gap", "skewness", "scatter")}
                                 for p in curve["points"]]


def here(points, half_gap):
    return min(points, key=lambda point: abs(1e6 * point["half_gap"] - half_gap))


def print_table(rig, points):
    print("Skewness of the APD, %s at %g kHz (mean and standard deviation of one period)" % (rig, RATE / 1e3))
    print("%14s%12s%10s%12s%10s" % ("half gap [um]", "published", "here", "difference", "scatter"))
    differences = []
    for half_gap, published in PUBLISHED.items():
        point = here(points, half_gap)
        differences.append(point["skewness"] - published)
        print("%14d%12.4f%10.4f%+12.4f%10.4f" %
              (half_gap, published, point["skewness"], differences[-1], point["scatter"]))
    rms = math.sqrt(sum(d * d for d in differences) / len(differences))
    rises = sum(b["skewness"] > a["skewness"] for a, b in zip(points, points[1:]))
    print("rms difference %.4f; the curve rises in %d of %d steps of %.3g um" %
          (rms, rises, len(points) - 1, 1e6 * points[1]["half_gap"]))
    return rms


def draw_apd(axes, apd, amplitude, percent, title, colour="tab:blue", style="bar", name=None):
    width = (apd["upper"] - apd["lower"]) / apd["classes"]
    if style == "bar":
        centres = [apd["lower"] + (k + 0.5) * width for k in range(apd["classes"])]
        axes.bar(centres, apd["percentages"], width=width, color=colour, edgecolor="white", linewidth=0.3)
    else:
        edges = [apd["lower"] + k * width for k in range(apd["classes"] + 1)]
        axes.stairs(apd["percentages"], edges, color=colour, linestyle=style, linewidth=1.3, label=name)
    highest = max(apd["percentages"])
    if highest > percent:
        axes.text(0.5, 0.97, "highest class %.0f %%" % highest, transform=axes.transAxes, ha="center", va="top",
                  fontsize=8, color=colour)
    axes.set_xlim(-amplitude, amplitude)
    axes.set_ylim(0, percent)
    axes.set_xlabel("sensor torque [N m]")
    axes.set_ylabel("share of time [%]")
    axes.set_title(title, fontsize=10)
    axes.grid(True, alpha=0.3)


def draw_torque_and_apd(plt, rig, torques, apds):
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 4.8), constrained_layout=True)
    for half_gap, colour, style in ((GAP, "tab:red", (0, (1, 1))), (0, "tab:blue", "-")):
        name = "half gap %d um" % half_gap if half_gap else "no backlash"
        left.plot(*torques[half_gap], color=colour, linestyle=style, linewidth=1.1, label=name)
        draw_apd(right, apds[half_gap], 0.3, 35, "", colour, style, name + ", skewness %.3f" % apds[half_gap]["skewness"])
    left.set_xlim(0, SHOWN)
    left.set_ylim(-0.4, 0.4)
    left.set_xlabel("time [s]")
    left.set_ylabel("sensor torque [N m]")
    left.set_title("Fig. 5: torque from rest", fontsize=10)
    right.set_title("Fig. 6: amplitude probability distribution, %d periods" % PERIODS, fontsize=10)
    left.grid(True, alpha=0.3)
    for axes in (left, right):
        axes.legend(fontsize=8, loc="upper right")
    figure.suptitle("Sarkar, Ellis and Moore (1997), axes of the paper, its curves are not printed as numbers; here: %s, "
                    "%g kHz" % (rig, RATE / 1e3), fontsize=10)
    return figure


def draw_curve(axes, points, rms):
    gap = [1e6 * p["half_gap"] for p in points]
    low, high = ([p["skewness"] + sign * 2 * p["scatter"] for p in points] for sign in (-1, 1))
    axes.fill_between(gap, low, high, color="tab:blue", alpha=0.2, linewidth=0,
                      label="scatter of one period (2 standard deviations)")
    axes.plot(gap, [p["skewness"] for p in points], "o-", color="tab:blue", markersize=3.5, label="here, mean")
    axes.plot(list(PUBLISHED), list(PUBLISHED.values()), "kD", markersize=6, markerfacecolor="none", label="published")
    axes.set_xlim(-2, 102)
    axes.set_ylim(1, 5)
    axes.set_xlabel("half gap [um]")
    axes.set_ylabel("skewness [-]")
    axes.set_title("(f) monitoring curve, rms difference %.3f" % rms, fontsize=10)
    axes.grid(True, alpha=0.3)
    axes.legend(fontsize=8)


def draw_figure_10(plt, rig, apds, points, rms):
    figure, grid = plt.subplots(2, 3, figsize=(13, 8), constrained_layout=True)
    for axes, letter, (half_gap, published) in zip(grid.flat, "abcde", PUBLISHED.items()):
        draw_apd(axes, apds[half_gap], 0.2, 30, "(%s) half gap %d um: skewness %.3f (published %.4f)" %
                 (letter, half_gap, here(points, half_gap)["skewness"], published))
    draw_curve(grid.flat[5], points, rms)
    layout = apds[0]
    figure.suptitle("Sarkar, Ellis and Moore (1997), Fig. 10, axes of the paper; here: %s, %g kHz, %d classes over %g to "
                    "%g N m, %d periods" % (rig, RATE / 1e3, layout["classes"], layout["lower"], layout["upper"], PERIODS),
                    fontsize=10)
    return figure


def reproduce(rig, out, plt):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "curve.yaml")
        run(["build_curve", rig, "--points", "21", "--max-backlash", "200e-6", "--sample-rate", str(RATE), "--periods",
             str(PERIODS), "--out", path])
        conditions, points = read_curve(path)
        if conditions["angular"] or conditions["signal"] != "sensor_torque":
            plotting.fail(65, "%s: needs a base radius and sensor_torque as the signal of its APD" % rig)
        duration = (conditions["settling_periods"] + PERIODS) / float(conditions["frequency"])
        apds = {half_gap: distribution(rig, half_gap, duration, path, folder) for half_gap in PUBLISHED}
        torques = {half_gap: torque(rig, half_gap, folder) for half_gap in (0, GAP)}
    rms = print_table(conditions["rig"], points)
    for name, figure in (("fig5_6.png", draw_torque_and_apd(plt, conditions["rig"], torques, apds)),
                         ("fig10.png", draw_figure_10(plt, conditions["rig"], apds, points, rms))):
        plotting.save(figure, os.path.join(out, name), 90)
        print(os.path.join(out, name))


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("--rig", metavar="RIG.yaml", default=default_rig(), help="default: the installed %(default)s")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder for fig5_6.png and fig10.png")
    arguments = parser.parse_args()
    plt = plotting.pyplot()
    try:
        import yaml  # noqa: F401, needed later, missed better now
    except ImportError as error:
        plotting.fail(70, "%s (Debian: python3-yaml)" % error)
    try:
        os.makedirs(arguments.out, exist_ok=True)
    except OSError as error:
        plotting.fail(73, "%s: %s" % (arguments.out, error))
    reproduce(arguments.rig, os.path.abspath(arguments.out), plt)


if __name__ == "__main__":
    plotting.run(main)
