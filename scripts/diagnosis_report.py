#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws the figures of a diagnosis, as JSON with the pictures inside; diagnose_record --report calls it.

usage: diagnosis_report.py SERIES.json --out FIGURES.json
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

MEASURED, GOOD, PALE, BAD = "#1f6fb4", "#2a8a3e", "#9aa7b5", "#b3261e"
COLOURS = {"motor_torque": PALE, "load_position": "#d98200"}  # beside MEASURED
LIMITS = {"watch": "#d9b200", "service": "#d98200", "stop": BAD}


class Data:
    def __init__(self, series):
        self.report, self.curve, self.limits = series["report"], series["curve"], series["limits"]
        self.waveform = series["waveform"]
        self.linear, self.locked, self.rigid = series["linear"], series["locked"], series["rigid"]
        record = series["record"]
        self.period = record["period"]
        time = np.array(record["time"], float)
        steps = np.diff(time)
        gaps = np.flatnonzero(steps > 2.5 * np.median(steps)) + 1 if steps.size else []  # no line is drawn across them
        self.time = np.insert(time, gaps, np.nan)
        self.channels = {name: np.insert(np.array(c["values"], float), gaps, np.nan)
                         for name, c in record["channels"].items()}
        self.units = {name: c["unit"] for name, c in record["channels"].items()}
        shown = [*self.report["estimates"], self.report["verdict"]]
        # What the answers are compared in: along the line of action, or as an angle where the rig has no base radius.
        self.lengths = self.linear or any(e["backlash"] is not None for e in shown)
        self.key = "backlash" if self.lengths and not self.linear else "backlash_angle"
        self.scale, self.unit = (1e-6, "µm") if self.lengths else (1e-3, "mrad")

    def torque(self):
        """What the teeth feel most directly."""
        return next((name for name in ("sensor_torque", "motor_torque") if name in self.channels), None)

    def deflection(self):
        """Values and label of the position across the teeth, where there are teeth and the record has it."""
        motor, load = self.channels.get("motor_position"), self.channels.get("load_position")
        # In the unit of the answers where that is one of an angle, else as a thousandth or a millionth of its own.
        scale, unit = (1e-6, "µm") if self.linear else (1e-3, "mrad")
        if motor is not None and self.locked:
            return motor / scale, "motor position [%s], output locked" % unit
        if motor is not None and load is not None and not self.rigid:
            return (motor - load) / scale, "motor - load position [%s]" % unit
        return None


def interval(answer, key):
    """Value and 95 % interval of an estimate or the verdict; what is not known is NaN."""
    ends = answer["interval"] if key == "backlash" else answer.get("interval_angle") or answer.get("angle_interval")
    return [np.nan if v is None else v for v in [answer[key], *(ends or [None, None])]]


def new_figure(height=1.0):
    width, normal = plotting.PAGE_FIGURE
    return plt.subplots(figsize=(width, normal * height), layout="constrained")


def over_time(data, names):
    figure, axes = new_figure()
    start = data.time[0]
    for name in names:
        colour = COLOURS.get(name, MEASURED) if len(names) > 1 else MEASURED
        axes.plot(data.time - start, data.channels[name], color=colour, linewidth=0.8, label=name.replace("_", " "))
    axes.set_xlabel("time [s], from %.6g s of the record on" % start)
    axes.set_ylabel("%s [%s]" % (names[-1].split("_")[-1], data.units[names[-1]]))
    axes.margins(y=0.18)
    axes.legend(loc="upper right", ncol=2)
    return figure


def span(data):
    return "over three periods" if data.period else "over the record"


def time_pictures(data):
    for names in (("motor_torque", "sensor_torque", "output_torque"), ("motor_current",), ("acceleration",),
                  ("motor_position", "load_position")):
        present = [name for name in names if name in data.channels]
        if present:
            caption = "%s %s" % (" and ".join(present).replace("_", " "), span(data))
            yield plotting.picture(over_time(data, present), caption[0].upper() + caption[1:])
    if data.deflection() is not None and not data.locked:
        values, label = data.deflection()
        figure, axes = new_figure()
        axes.plot(data.time - data.time[0], values, color=MEASURED, linewidth=0.8)
        axes.set_xlabel("time [s]")
        axes.set_ylabel(label)
        yield plotting.picture(figure, "Motor minus load position %s" % span(data))


def loop_picture(data):
    torque, deflection = data.torque(), data.deflection()
    if torque is None or deflection is None:
        return
    figure, axes = new_figure()
    axes.plot(deflection[0], data.channels[torque], color=MEASURED, linewidth=0.7)
    axes.set_xlabel(deflection[1])
    axes.set_ylabel("%s [%s]" % (torque.replace("_", " "), data.units[torque]))
    yield plotting.picture(figure, "Hysteresis loop: torque over position")


def apd_picture(data):
    apd = data.report["apd"]
    if not apd or not apd["samples"]:
        return
    figure, axes = new_figure()
    edges = np.linspace(apd["lower"], apd["upper"], apd["classes"] + 1)
    share = np.array(apd["percentages"])
    axes.bar(edges[:-1], share, width=np.diff(edges), align="edge", color=MEASURED, edgecolor="white", linewidth=0.3)
    used = np.flatnonzero(share)
    if used.size:
        margin = 4 * (edges[1] - edges[0])
        axes.set_xlim(edges[used[0]] - margin, edges[used[-1] + 1] + margin)
    axes.set_xlabel("%s [%s]" % (apd["signal"].replace("_", " "), data.units.get(apd["signal"], "")))
    axes.set_ylabel("share of time [%]")
    skewness = "" if apd["skewness"] is None else ", skewness %.3f" % apd["skewness"]
    yield plotting.picture(figure, "Amplitude probability distribution of %d periods%s" % (apd["periods"], skewness))


def curve_picture(data):
    """The curve, and on it the skewness of the record with what apd_skewness makes of it."""
    if not data.curve:
        return
    key, to_axis = ("backlash_angle", data.curve["backlash_to_angle"]) if data.curve["angular"] else ("backlash", 1)
    scale, unit = (1e-3, "mrad") if data.curve["angular"] else (1e-6, "µm")
    x = np.array(data.curve["backlash"], float) * (to_axis or np.nan) / scale
    y, scatter = np.array(data.curve["skewness"], float), np.array(data.curve["scatter"], float)
    figure, axes = new_figure()
    axes.fill_between(x, y - scatter, y + scatter, color=MEASURED, alpha=0.15, linewidth=0,
                      label="95 % of single periods")
    axes.plot(x, y, color=MEASURED, linewidth=1.2, label="monitoring curve")
    estimate = next((e for e in data.report["estimates"] if e["method"] == "apd_skewness"), None)
    if estimate and estimate["skewness"] is not None:
        value, low, high = (v / scale for v in interval(estimate, key))
        axes.axhline(estimate["skewness"], color=BAD, linewidth=0.7, linestyle=":")
        if np.isfinite(low) or np.isfinite(high):
            axes.axvspan(low if np.isfinite(low) else x[0], high if np.isfinite(high) else x[-1], color=BAD, alpha=0.1,
                         linewidth=0)
        label = "this record: %s" % estimate["status"].replace("_", " ")
        if np.isfinite(value):
            label = "this record: %.4g %s [%.4g, %.4g]" % (value, unit, low, high)
        axes.plot([value], [estimate["skewness"]], "o", color=BAD, markersize=5, label=label)
    axes.set_xlabel("backlash [%s]" % unit)
    axes.set_ylabel("skewness of the APD [-]")
    axes.margins(y=0.12)
    axes.legend(loc="best", fontsize=8)
    yield plotting.picture(figure, "Monitoring curve, with the estimate and its interval")


def bar(axes, row, answer, data, colour, width):
    value, low, high = (v / data.scale for v in interval(answer, data.key))
    if np.isfinite(low) or np.isfinite(high):
        left, right = axes.get_xlim()
        axes.plot([low if np.isfinite(low) else left, high if np.isfinite(high) else right], [row, row], "-",
                  color=colour, linewidth=width, solid_capstyle="butt")
        if not np.isfinite(high):
            axes.plot([right], [row], ">", color=colour, markersize=5, clip_on=False)
    if np.isfinite(value):
        axes.plot([value], [row], "o", color=colour, markersize=5)
    return np.isfinite(value) or np.isfinite(low)


def limit_lines(axes, data):
    if not data.limits or data.limits["angular"] != (data.key == "backlash_angle"):
        return
    left, right = axes.get_xlim()
    for name, colour in LIMITS.items():
        at = data.limits[name] / data.scale
        if left <= at <= right:
            axes.axvline(at, color=colour, linewidth=1, linestyle="--", label=name)


def intervals_picture(data):
    """All methods beside each other; no picture where none has an interval."""
    report = data.report
    rows = [(e["method"], e, e["method"] in report["verdict"]["members"]) for e in report["estimates"]]
    if report["verdict"]["members"]:
        rows.append(("together", report["verdict"], True))
    ends = np.array([v / data.scale for _, answer, _ in rows for v in interval(answer, data.key)], float)
    ends = ends[np.isfinite(ends)]
    if not ends.size:
        return
    figure, axes = new_figure(0.35 + 0.11 * len(rows))
    room = 0.12 * (ends.max() - ends.min()) or 0.1 * abs(ends.max()) or 1
    axes.set_xlim(ends.min() - room, ends.max() + room)
    for row, (name, answer, member) in enumerate(rows):
        colour = "#222222" if name == "together" else GOOD if member else PALE
        if not bar(axes, row, answer, data, colour, 4 if name == "together" else 2):
            axes.text(0.5, row, answer["status"].replace("_", " "), transform=axes.get_yaxis_transform(), ha="center",
                      va="center", color="#666666", fontsize=8)
    limit_lines(axes, data)
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlabel("backlash [%s], value and 95 %% interval" % data.unit)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncol=3, fontsize=8)
    yield plotting.picture(figure, "Intervals of all methods; green: those that the verdict combines")


def traces(axes, rest, window, channel, data, scale):
    """One window of the fit: what was measured, the machine's waveform over it, and below what is left."""
    trace = window[channel]
    measured, model = (np.array(trace[key], float) / scale for key in ("measured", "model"))
    time = 1e3 * np.array(window["times"], float)
    axes.plot(time, measured, ".", color=MEASURED, markersize=2.5, label="measured")
    axes.plot(time, model, color=BAD, linewidth=0.9, label="fitted machine")
    noise = data.waveform[channel + "_noise"] / scale
    rest.axhspan(-2 * noise, 2 * noise, color=PALE, alpha=0.3, linewidth=0)
    rest.plot(time, measured - model, color="#222222", linewidth=0.6)
    rest.set_xlabel("ms from %.4g s" % window["start"], fontsize=8)


def waveform_pictures(data):
    """Why the estimate by waveform is believed, or is not."""
    if not data.waveform:
        return
    windows = data.waveform["windows"]
    for channel, scale, label in (("torque", 1, "sensor torque [N m]"), ("position", 1e-3, "motor position [mrad]")):
        if windows[0][channel] is None:
            continue
        width, height = plotting.PAGE_FIGURE
        figure, grid = plt.subplots(2, len(windows), figsize=(1.5 * width, 1.15 * height), layout="constrained",
                                    sharex="col", sharey="row", squeeze=False, height_ratios=(3, 1))
        for column, window in enumerate(windows):
            traces(grid[0][column], grid[1][column], window, channel, data, scale)
            names = [name for name, is_it in (("first", window is windows[0]),
                                              ("worst", window["misfit"] == max(w["misfit"] for w in windows))) if is_it]
            grid[0][column].set_title(" and ".join(names or ["median"]), fontsize=8)
        grid[0][0].set_ylabel(label)
        grid[1][0].set_ylabel("rest")
        grid[0][0].legend(loc="best", fontsize=7, markerscale=2)
        most = max(np.abs(line.get_ydata()).max() for rest in grid[1] for line in rest.get_lines())
        grid[1][0].set_ylim(-1.2 * most, 1.2 * most)  # shared; the grey may fill it
        yield plotting.picture(figure, "%s about reversals of the torque, %d fitted, %d left out: the first, that with "
                               "the median and that with the largest rest; grey: twice what the fit takes as noise" %
                               (label.partition(" [")[0].capitalize(), data.waveform["fitted"],
                                data.waveform["left_out"]))


def sections(series):
    data = Data(series)
    pictures = [p for draw in (intervals_picture, curve_picture, apd_picture, loop_picture, time_pictures)
                for p in draw(data)]
    fitted = list(waveform_pictures(data))
    return [plotting.section("", pictures)] + ([plotting.section("The fitted machine over the record", fitted)]
                                               if fitted else [])


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("series", metavar="SERIES.json", help="of a diagnosis")
    parser.add_argument("--out", metavar="FIGURES.json", required=True, help="to write")
    arguments = parser.parse_args()
    series = plotting.load_json(arguments.series, "the series of a diagnosis")
    try:
        drawn = sections(series)
    except (KeyError, TypeError, IndexError, ValueError) as error:
        plotting.fail(65, "%s: not the series of a diagnosis: %r" % (arguments.series, error))
    plotting.save_sections(drawn, arguments.out)


if __name__ == "__main__":
    plotting.run(main)
