#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws the figures of a trace_residual report, as JSON with the pictures inside.

usage: trace_report.py REPORT.json --series SERIES.json --out FIGURES.json
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

BEFORE, AFTER, MEASURED = "#9aa7b5", "#1f6fb4", "#222222"
HIGHEST_ORDER = 80
ORDERS = 500  # of a spectrum
BINS = 40
SMOOTH = 0.95  # share of a contribution that a coordinate explains, from which it is a curve over it
NAMES = {"time": "time", "motor_position": "motor position", "motor_velocity": "motor velocity",
         "motor_torque": "motor torque", "load_position": "load position", "load_velocity": "load velocity",
         "mesh_torque": "torque through the mesh"}

class Data:
    def __init__(self, series):
        self.linear = series["linear"]
        self.coordinates = {name: (np.array(c["values"], float), c["unit"])
                            for name, c in series["coordinates"].items()}
        self.channels = {}
        for name, c in series["channels"].items():
            measured = np.array(c["measured"], float)
            residuals = {key: measured - np.array(c[key], float) for key in ("before", "after")}
            self.channels[name] = (residuals, c["unit"])

    def words(self, channel):
        force = "force" if self.linear else "torque"
        return {"torque": force, "deflection": "deflection (motor - load)"}.get(channel, channel)

    def label(self, coordinate):
        name = NAMES[coordinate]
        return "%s [%s]" % (name.replace("torque", "force") if self.linear else name, self.coordinates[coordinate][1])


def edges_of(x, bins):
    """Of bins with equally many samples: none is thin."""
    return np.unique(np.quantile(x, np.linspace(0, 1, bins + 1)))


def binned(x, y, bins=BINS):
    """Middle, mean and count of bins of x; None where there are too few different values."""
    edges = edges_of(x, bins) if len(x) else []
    if len(edges) < 4:
        return None
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    count = np.bincount(place, minlength=len(edges) - 1)
    used = count > 0
    middle = np.bincount(place, x, len(edges) - 1)[used] / count[used]
    mean = np.bincount(place, y, len(edges) - 1)[used] / count[used]
    return middle, mean, count[used]


def broken(x, y):
    """The line with a gap where x has one: there are no samples between."""
    wide = np.flatnonzero(np.diff(x) > 0.15 * (x[-1] - x[0])) + 1
    return np.insert(x, wide, np.nan), np.insert(y, wide, np.nan)


def spectrum(position, residual, turn):
    """Amplitudes of the least-squares sine at each order: the positions need not be even."""
    travel = (position.max() - position.min()) / turn
    if travel <= 0:
        return None
    lowest = 0.5 / travel
    orders = np.linspace(lowest, max(HIGHEST_ORDER, 20 / travel), ORDERS)
    step = max(1, len(position) // 6000)
    x, r = position[::step] * 2 * np.pi / turn, residual[::step] - residual[::step].mean()
    amplitudes = []
    for order in orders:
        c, s = np.cos(order * x), np.sin(order * x)
        c, s = c - c.mean(), s - s.mean()
        matrix = np.array([[c @ c, c @ s], [c @ s, s @ s]])
        amplitudes.append(np.hypot(*np.linalg.lstsq(matrix, np.array([c @ r, s @ r]), rcond=None)[0]))
    return orders, np.array(amplitudes)


def scatter(axes, data, coordinate, residuals):
    """All samples pale, means of bins on top."""
    x = data.coordinates[coordinate][0]
    for key, colour, z in (("before", BEFORE, 1), ("after", AFTER, 2)):
        use = np.isfinite(residuals[key])
        axes.plot(x[use], residuals[key][use], ".", color=colour, markersize=2.2, alpha=0.5, zorder=z,
                  markeredgewidth=0)
        means = binned(x[use], residuals[key][use])
        if means is not None:
            axes.plot(*broken(means[0], means[1]), "-", color="#4d5a66" if key == "before" else "#0b3c66", linewidth=1.6,
                      zorder=z + 2, label="mean, " + key)
    axes.set_xlabel(data.label(coordinate))


def new_figure():
    return plt.subplots(figsize=plotting.PAGE_FIGURE, layout="constrained")


def scaled(axes, residuals, unit):
    finite = [r[np.isfinite(r)] for r in residuals.values()]
    limit = max(np.abs(r).max() if r.size else 0 for r in finite)
    axes.set_ylim(-1.15 * limit or None, 1.3 * limit or None)
    axes.set_ylabel("residual [%s]" % unit)


def over_time_figure(data, residuals, unit):
    figure, axes = new_figure()
    for key, colour in (("before", BEFORE), ("after", AFTER)):  # gaps where samples do not count
        axes.plot(data.coordinates["time"][0], residuals[key], "-", color=colour, linewidth=0.6, label=key)
    axes.set_xlabel(data.label("time"))
    for line in axes.legend(loc="upper right", ncol=2).get_lines():
        line.set_linewidth(2)
    scaled(axes, residuals, unit)
    return figure


def over_coordinate_figure(data, coordinate, residuals, unit):
    figure, axes = new_figure()
    scatter(axes, data, coordinate, residuals)
    axes.legend(loc="upper right", ncol=2)
    scaled(axes, residuals, unit)
    return figure


def over_order_figure(data, residuals, unit):
    figure, axes = new_figure()
    turn = 1 if data.linear else 2 * np.pi
    for key, colour in (("before", BEFORE), ("after", AFTER)):
        use = np.isfinite(residuals[key])
        lines = spectrum(data.coordinates["motor_position"][0][use], residuals[key][use], turn) if use.any() else None
        if lines is not None:
            axes.plot(*lines, color=colour, linewidth=1, label=key)
    axes.set_xlabel("cycles per m of motor position" if data.linear else "order [1/turn] of motor position")
    axes.set_ylabel("amplitude [%s]" % unit)
    axes.set_ylim(bottom=0)
    return figure


def channel_figures(data, channel):
    residuals, unit = data.channels[channel]
    word = data.words(channel)
    drawn = [(over_time_figure(data, residuals, unit), "time")]
    drawn += [(over_coordinate_figure(data, name, residuals, unit), NAMES[name])
              for name in ("motor_velocity", "motor_position")]
    drawn.append((over_order_figure(data, residuals, unit), "orders of the motor position"))
    return [plotting.picture(figure, "Residual of %s over %s" % (word, what)) for figure, what in drawn]


def explained(x, y):
    """Share of the variance of y that its means in narrow bins of x hold."""
    means = binned(x, y, 200)
    if means is None or y.var() == 0:
        return 0
    return np.average((means[1] - y.mean()) ** 2, weights=means[2]) / y.var()


def followed(data, values):
    """The coordinate that a contribution follows, and how well. Time explains all that is slow: it comes last."""
    shares = {name: explained(x, values) for name, (x, _) in data.coordinates.items() if np.isfinite(x).all()}
    best = max((name for name in shares if name != "time"), key=shares.get)
    if shares[best] < SMOOTH and shares["time"] > shares[best]:
        best = "time"
    return best, shares[best]


def learned_curve(axes, term, data):
    """Catmull-Rom cubic as in src/model/terms/learned_map.cpp."""
    x, y = np.array(term["points"], float), np.array(term["values"], float)
    slope = np.zeros(len(x))
    slope[1:-1] = (y[2:] - y[:-2]) / (x[2:] - x[:-2])
    fine = np.linspace(x[0], x[-1], 600)
    i = np.clip(np.searchsorted(x, fine, side="right") - 1, 0, len(x) - 2)
    width = x[i + 1] - x[i]
    t = (fine - x[i]) / width
    u, rise = 1 - t, y[i + 1] - y[i]
    value = y[i] + rise * t * t * (3 - 2 * t) + t * u * (width * slope[i] * u - width * slope[i + 1] * t)
    axes.plot(fine, value, "-", color=AFTER)
    axes.plot(x, y, "o", color=AFTER, markersize=3)
    axes.set_xlabel(data.label(term["coordinate"]))
    gap, force = term["acts_on"] == "gap", "force" if data.linear else "torque"
    unit = data.coordinates["motor_position"][1] if gap else data.coordinates["motor_torque"][1]
    axes.set_ylabel("%s [%s]" % ("displacement of the mesh" if gap else force + " on the " + term["acts_on"], unit))


def draw_contributions(axes, contributions, data):
    """Of one unit, over what the first of them follows."""
    name, share = followed(data, np.array(contributions[0]["values"], float))
    x = data.coordinates[name][0]
    order = np.argsort(x, kind="stable")
    for c, colour, style in zip(contributions, (AFTER, "#d98200"), ("-", "--")):
        values = np.array(c["values"], float)
        if share > 0.99 or name == "time":  # a curve
            axes.plot(x[order], values[order], style, color=colour, linewidth=1.2, label=c["quantity"])
        else:
            axes.plot(x, values, ".", color=colour, markersize=2, alpha=0.5, markeredgewidth=0, label=c["quantity"])
    axes.set_xlabel(data.label(name))
    unit = contributions[0]["unit"]
    if len(contributions) == 1:
        axes.set_ylabel("%s [%s]" % (contributions[0]["quantity"], unit))
    else:
        axes.set_ylabel("contribution [%s]" % unit)
        axes.margins(y=0.15)
        axes.legend(loc="upper right", markerscale=4)


def effect_figures(data, step, contributions):
    maps = [t for t in step["terms"] if "coordinate" in t]
    units = sorted({c["unit"] for c in contributions})
    count = len(maps) or len(units)
    pictures = []
    for i in range(count):
        figure, axes = new_figure()
        if maps:
            learned_curve(axes, maps[i], data)
        else:
            draw_contributions(axes, [c for c in contributions if c["unit"] == units[i]], data)
        pictures.append(plotting.picture(figure, "What %s adds" % step["effect"]))
    return pictures


def sections(report, series):
    data = Data(series)
    drawn = [plotting.section("Residual of %s (measured - model) in the test record" % data.words(channel),
                              channel_figures(data, channel)) for channel in data.channels]
    for step, shown in zip(report["steps"], series["steps"]):
        figures = effect_figures(data, step, shown["contributions"])
        if figures:
            drawn.append(plotting.section("What %s adds in the test record" % step["effect"], figures))
    return drawn


def main():
    parser = plotting.Parser("Draws the figures of a trace_residual report.")
    parser.add_argument("report", metavar="REPORT.json")
    parser.add_argument("--series", metavar="SERIES.json", required=True, help="of the same trace")
    parser.add_argument("--out", metavar="FIGURES.json", required=True, help="to write")
    arguments = parser.parse_args()
    report = plotting.load_json(arguments.report, "a trace")
    series = plotting.load_json(arguments.series, "the series of a trace")
    try:
        drawn = sections(report, series)
    except (KeyError, TypeError, IndexError, ValueError) as error:
        plotting.fail(65, "%s: not a trace: %r" % (arguments.report, error))
    plotting.save_sections(drawn, arguments.out)


if __name__ == "__main__":
    plotting.run(main)
