#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws a monitoring curve with its scatter; the stretch where it is not monotonic is marked.

Exit codes: 0 done, 64 usage, 65 not a curve, 66 curve missing, 70 matplotlib missing, 73 cannot write.
"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402


def load(path):
    curve = plotting.load_yaml(path, "a monitoring curve")
    try:
        columns = [[point[key] for point in curve["points"]] for key in ("backlash", "skewness", "scatter", "monotonic")]
        return curve["conditions"], [[float(v) for v in column] for column in columns]
    except (KeyError, TypeError, ValueError) as error:
        plotting.fail(65, "%s: not a monitoring curve: %r" % (path, error))


def title(conditions):
    apd = conditions["apd"]
    return ("%s: %s, %s excitation %.4g N m at %.4g Hz, sampled at %.4g Hz\n"
            "%s classes over %s to %s, %s periods x %s runs, sensor noise %.3g" %
            (conditions["rig"], conditions["signal"], conditions["excitation"], float(conditions["amplitude"]),
             float(conditions["frequency"]), float(conditions["sampling_rate"]), apd["classes"], apd["lower"], apd["upper"],
             conditions["periods"], conditions["seeds"], float(conditions["noise"])))


def draw(conditions, columns):
    plt = plotting.pyplot()
    angular = conditions["angular"]
    backlash, skewness, scatter, monotonic = columns
    x = [1e3 * b if angular else 1e6 * b for b in backlash]
    figure, axes = plt.subplots(figsize=(9, 5.5), constrained_layout=True)
    low = [s - 2 * d for s, d in zip(skewness, scatter)]
    high = [s + 2 * d for s, d in zip(skewness, scatter)]
    axes.fill_between(x, low, high, color="tab:blue", alpha=0.2, linewidth=0,
                      label="scatter of one period (2 standard deviations)")
    axes.plot(x, skewness, "o-", color="tab:blue", markersize=3.5, label="mean skewness")
    step = 0.5 * (x[1] - x[0])
    label = "not monotonic"
    for centre, good in zip(x, monotonic):
        if not good:
            axes.axvspan(centre - step, centre + step, color="tab:red", alpha=0.15, linewidth=0, label=label)
            label = None
    axes.set_xlabel("backlash, angle at the load [mrad]" if angular else
                    "backlash, total free play along the line of action [um]")
    axes.set_ylabel("skewness of the class values [-]")
    axes.set_title(title(conditions), fontsize=9)
    axes.grid(True, alpha=0.3)
    axes.legend()
    return figure


def main():
    parser = plotting.Parser("Draws a monitoring curve.")
    parser.add_argument("curve", metavar="CURVE.yaml")
    parser.add_argument("--out", metavar="PICTURE", required=True, help="picture to write: .png, .svg or .pdf")
    arguments = parser.parse_args()
    try:
        conditions, columns = load(arguments.curve)
    except ImportError as error:
        plotting.fail(70, "%s (Debian: python3-yaml)" % error)
    plotting.save(draw(conditions, columns), arguments.out, 120)


if __name__ == "__main__":
    plotting.run(main)
