#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws the figures of a day, as JSON with the pictures inside; day_report calls it.

usage: day_report.py DAY.json --out FIGURES.json
"""
import datetime
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

plt = plotting.page_pyplot()
import matplotlib.dates  # noqa: E402

KNOWN, CHANGE, SILENT = "#1f6fb4", "#b3261e", "#9aa7b5"
EPOCH = datetime.datetime(1970, 1, 1)


def date(seconds):
    return EPOCH + datetime.timedelta(seconds=seconds)


def begin(day):
    """Where the plots begin: with the day, or shortly before its first entry."""
    times = [e["time"] for joint in day["joints"] for e in joint["series"]]
    times += [change["since_interval"][0] for joint in day["joints"] for change in joint["changes"]]
    return max(day["from"], min(times) - 0.05 * (day["to"] - min(times)) - 60) if times else day["from"]


def lengths(day):
    """One unit on all plots: lengths only if every play has one."""
    return all(e["backlash"] is not None or e["interval"] is not None for joint in day["joints"] for e in joint["series"]
               if e["backlash_angle"] is not None or e["angle_interval"] is not None)


def draw(joint, day):
    """Estimates with their intervals over the day; changes, and estimates without a result, at its foot."""
    figure, axes = plt.subplots(figsize=plotting.PAGE_FIGURE, constrained_layout=True)
    value, ends, scale, unit = (("backlash", "interval", 1e6, "µm") if lengths(day) else
                                ("backlash_angle", "angle_interval", 1e3, "mrad"))
    known = [e for e in joint["series"] if e[ends] is not None and e[ends][1] is not None]
    times = [date(e["time"]) for e in known]
    if known:
        axes.vlines(times, [scale * (e[ends][0] or 0) for e in known], [scale * e[ends][1] for e in known], color=KNOWN,
                    alpha=0.3, linewidth=1, label="95 %")
    points = [(t, scale * e[value]) for t, e in zip(times, known) if e[value] is not None]
    if points:
        axes.plot([t for t, _ in points], [v for _, v in points], ".", color=KNOWN, markersize=3, label="play")
    silent = [date(e["time"]) for e in joint["series"] if e not in known]
    if silent:
        axes.plot(silent, [0.02] * len(silent), "|", color=SILENT, markersize=5, transform=axes.get_xaxis_transform(),
                  label="cannot tell")
    for change in joint["changes"]:
        axes.axvspan(date(change["since_interval"][0]), date(change["since_interval"][1]), color=CHANGE, alpha=0.25)
        axes.axvline(date(change["since"]), color=CHANGE, linewidth=1.2, label=change["effect"] + ", since")
        if change["until"] is not None:
            axes.axvline(date(change["until"]), color=CHANGE, linewidth=1.2, linestyle=":", label=change["effect"] + ", until")
    left, right = begin(day), day["to"]
    axes.set_xlim(date(left), date(right + 0.02 * (right - left)))
    axes.xaxis.set_major_formatter(matplotlib.dates.ConciseDateFormatter(axes.xaxis.get_major_locator()))
    if known:
        axes.set_ylim(0, 1.1 * scale * max(e[ends][1] for e in known))
    axes.set_ylabel("play [%s]" % unit)
    if not known:
        axes.set_yticks([])
        axes.set_ylabel("no estimate states the play")
    axes.set_xlabel("UTC")
    axes.legend(fontsize=7, loc="lower center", bbox_to_anchor=(0.5, 1), ncol=4)
    return plotting.picture(figure, joint["joint"])


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("day", metavar="DAY.json", help="written by day_report")
    parser.add_argument("--out", required=True, metavar="FIGURES.json", help="figures for the page")
    arguments = parser.parse_args()
    day = plotting.load_json(arguments.day, "a day")
    try:
        pictures = [draw(joint, day) for joint in day["joints"] if joint["series"] or joint["changes"]]
    except (KeyError, TypeError, ValueError, IndexError) as error:
        plotting.fail(65, "%s: not a day: %r" % (arguments.day, error))
    plotting.save_sections([plotting.section("", pictures)], arguments.out)


if __name__ == "__main__":
    plotting.run(main)
