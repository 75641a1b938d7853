#!/usr/bin/env python3
"""Draws a monitoring curve with its scatter; the stretch where it is not monotonic is marked.

Exit codes: 0 done, 64 usage, 65 not a curve, 66 curve missing, 70 matplotlib missing, 73 cannot write.
"""
import argparse
import os
import sys
import tempfile


class Parser(argparse.ArgumentParser):
    def error(self, message):
        self.exit(64, "%s: %s; see --help\n" % (self.prog, message))


def fail(code, message):
    sys.stderr.write("plot_curve.py: %s\n" % message)
    sys.exit(code)


def load(path):
    import yaml
    try:
        with open(path) as stream:
            curve = yaml.load(stream, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
        if curve["schema_version"] != 1:
            raise ValueError("schema_version is not 1")
        columns = [[point[key] for point in curve["points"]] for key in ("backlash", "skewness", "scatter", "monotonic")]
        return curve["conditions"], [[float(v) for v in column] for column in columns]
    except OSError as error:
        fail(66, error)
    except (yaml.YAMLError, KeyError, TypeError, ValueError) as error:
        fail(65, "%s: not a monitoring curve: %r" % (path, error))


def title(conditions):
    apd = conditions["apd"]
    return ("%s: %s, %s excitation %.4g N m at %.4g Hz, sampled at %.4g Hz\n"
            "%s classes over %s to %s, %s periods x %s runs, sensor noise %.3g" %
            (conditions["rig"], conditions["signal"], conditions["excitation"], float(conditions["amplitude"]),
             float(conditions["frequency"]), float(conditions["sampling_rate"]), apd["classes"], apd["lower"], apd["upper"],
             conditions["periods"], conditions["seeds"], float(conditions["noise"])))


def draw(conditions, columns):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
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


def save(figure, path):
    """Whole or not at all."""
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(dir=os.path.dirname(path) or ".", suffix=os.path.splitext(path)[1])
        os.close(handle)
        figure.savefig(temporary, dpi=120)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        os.replace(temporary, path)
        temporary = None
    except OSError as error:
        fail(73, "%s: cannot be written: %s" % (path, error))
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)


def main():
    parser = Parser(prog="plot_curve.py", description="Draws a monitoring curve.")
    parser.add_argument("curve", metavar="CURVE.yaml")
    parser.add_argument("--out", metavar="PICTURE", required=True, help="picture to write: .png, .svg or .pdf")
    arguments = parser.parse_args()
    try:
        conditions, columns = load(arguments.curve)
        figure = draw(conditions, columns)
    except ImportError as error:
        fail(70, "%s (Debian: python3-matplotlib, python3-yaml)" % error)
    save(figure, arguments.out)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
