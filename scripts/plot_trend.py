#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws a trend: estimates with their intervals, the line, the interval of its rate, the limit and its date.

Exit codes: 0 done, 64 usage, 65 not a trend, 66 trend missing, 70 matplotlib missing, 73 cannot write.
"""
import datetime
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

EPOCH = datetime.datetime(1970, 1, 1)


def date(seconds):
    """matplotlib's dates end with the year 9999."""
    return EPOCH + datetime.timedelta(seconds=min(max(seconds, -6e10), 2.5e11))


def draw_points(axes, series, scale):
    times = [date(t) for t in series["time"]]
    values = [scale * v for v in series["value"]]
    known = [(t, v, [scale * e for e in i]) for t, v, i in zip(times, values, series["interval"])
             if i is not None and None not in i]
    if known:
        axes.errorbar([k[0] for k in known], [k[1] for k in known],
                      yerr=[[max(v - i[0], 0) for _, v, i in known], [max(i[1] - v, 0) for _, v, i in known]],
                      fmt="none", ecolor="0.75", elinewidth=0.8, label="95 % of each estimate")
    axes.plot(times, values, ".", color="tab:blue", markersize=4, label="estimates")


def draw_line(axes, trend, end, scale):
    """The line, and how far its rate lets it turn about the middle of the points."""
    start = trend["time"] - trend["span"]
    middle = trend["time"] - 0.5 * trend["span"]

    def at(rate, time):
        return scale * (trend["level"] + trend["rate"] * (middle - trend["time"]) + rate * (time - middle))

    times = [start + (end - start) * i / 100 for i in range(101)]
    axes.plot([date(t) for t in times], [at(trend["rate"], t) for t in times], color="tab:red", linewidth=1.2,
              label="trend" if trend["grows"] else "line, no trend")
    if trend["rate_interval"]:
        edges = [[at(r, t) for r in trend["rate_interval"]] for t in times]
        axes.fill_between([date(t) for t in times], [min(e) for e in edges], [max(e) for e in edges],
                          color="tab:red", alpha=0.15, linewidth=0, label="95 % of the rate")


def draw_date(axes, reaches, limit):
    low, high = reaches["interval"] or (None, None)
    if reaches["time"] is None or low is None:
        return
    right = date(high) if high is not None else axes.get_xlim()[1]
    axes.plot([date(low), right], [limit, limit], color="black", linewidth=4, solid_capstyle="butt", alpha=0.5,
              label="date, 95 %")
    axes.plot([date(reaches["time"])], [limit], "D", color="black", markersize=6,
              label=reaches["date"][:10] if reaches["date"] else "date")


def draw(trend):
    plt = plotting.pyplot()
    figure, axes = plt.subplots(figsize=(11, 5.5), constrained_layout=True)
    scale, unit = (1e6, "um") if trend["unit"] == "m" else (1e3, "mrad")
    if not trend["series"]["time"]:
        axes.text(0.5, 0.5, "no estimate with a value in the history yet", transform=axes.transAxes, ha="center", fontsize=14)
        axes.set_xticks([])
        axes.set_yticks([])
        axes.set_title(trend["message"], fontsize=9, wrap=True)
        figure.suptitle(os.path.basename(trend["history"]), fontsize=11)
        return figure
    draw_points(axes, trend["series"], scale)
    end, reaches = trend["time"], trend["reaches"]
    if reaches and reaches["time"] is not None:
        # As far as the date, but not so far that the points become a dot.
        latest = (reaches["interval"] or [None, None])[1] or reaches["time"]
        end = max(end, min(latest, trend["time"] + 10 * trend["span"]))
    if trend["rate"] is not None:
        draw_line(axes, trend, end, scale)
    if trend["limit"] is not None:
        axes.axhline(scale * trend["limit"], color="black", linestyle="--", linewidth=1,
                     label="limit %.4g %s" % (scale * trend["limit"], unit))
        if reaches and (reaches["time"] or 0) <= end:
            draw_date(axes, reaches, scale * trend["limit"])
    axes.set_ylabel(trend["quantity"].replace("_", " ") + " [%s]" % unit)
    axes.set_xlabel("UTC")
    axes.grid(True, alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8, loc="best")
    axes.set_title(trend["message"], fontsize=9, wrap=True)
    figure.suptitle(os.path.basename(trend["history"]), fontsize=11)
    return figure


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("trend", metavar="TREND.json", help="written by backlash_trend")
    parser.add_argument("--out", required=True, metavar="OUT.png", help="picture to write (.png, .svg, .pdf)")
    arguments = parser.parse_args()
    trend = plotting.load_json(arguments.trend, "a trend")
    try:
        figure = draw(trend)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        plotting.fail(65, "%s: not a trend: %r" % (arguments.trend, error))
    plotting.save(figure, arguments.out, 110)


if __name__ == "__main__":
    plotting.run(main)
