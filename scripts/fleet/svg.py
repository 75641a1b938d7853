# SPDX-License-Identifier: BSD-3-Clause
"""Curves of estimates over time as SVG: a small one for a row, a large one for the page of a joint."""
import datetime

_EPOCH = datetime.datetime(1970, 1, 1)
UNITS = {"m": (1e6, "µm"), "rad": (1e3, "mrad")}


class _Scale:
    def __init__(self, values, start, end, margin):
        low, high = min(values), max(values)
        reach = (high - low) * margin if high > low else abs(high) * 0.1 or 1.0
        self._low, self._factor, self._start = low - reach, (end - start) / (high - low + 2 * reach), start

    def __call__(self, value):
        return round(self._start + (value - self._low) * self._factor, 1)


def _line(trend, times):
    """Ends of the trend's line over these times."""
    if not trend or trend.get("rate") is None or len(times) < 2:
        return None
    return [(t, trend["level"] + trend["rate"] * (t - trend["time"])) for t in (min(times), max(times))]


def _path(points, x, y):
    return " ".join("%g,%g" % (x(t), y(v)) for t, v in points)


def small(series, trend, width=150, height=38):
    """The estimates as dots, the trend's line, the limit where it is near. Empty where there is nothing to show."""
    if not series or not series["time"]:
        return ""
    times, values = series["time"], series["value"]
    limit = (trend or {}).get("limit")
    near = limit is not None and limit <= 3 * max(values)
    x = _Scale(times, 3, width - 3, 0)
    y = _Scale(values + ([limit] if near else []), height - 3, 3, 0.05)
    parts = ['<svg class="curve" viewBox="0 0 %d %d" width="%d" height="%d" role="img" aria-label="%d estimates">'
             % (width, height, width, height, len(values))]
    if near:
        parts.append('<path class="limit" d="M0 %gH%d"/>' % (y(limit), width))
    line = _line(trend, times)
    if line and trend.get("grows"):
        parts.append('<polyline class="trend" points="%s"/>' % _path(line, x, y))
    dots = " ".join("M%g %gh0" % (x(t), y(v)) for t, v in zip(times, values))
    parts.append('<path class="dots" d="%s"/></svg>' % dots)
    return "".join(parts)


def _ticks(low, high, most=6):
    """Round numbers between two."""
    span = high - low
    step = 10.0 ** len(str(int(span))) if span >= 1 else 10.0
    while span / step < most / 2:
        step /= 10 if span / (step / 10) <= most else 2
    first = int(low / step) + (1 if low > 0 else 0)
    return [(first + i) * step for i in range(int((high - first * step) / step) + 1)]


def _dates(low, high, count=5):
    times = [low + (high - low) * i / (count - 1) for i in range(count)] if high > low else [low]
    form = "%Y-%m-%d" if high - low > 3 * 86400 else "%m-%d %H:%M"
    return [(t, (_EPOCH + datetime.timedelta(seconds=t)).strftime(form)) for t in times]


def large(series, trend, width=900, height=320):
    if not series or not series["time"]:
        return ""
    factor, unit = UNITS[(trend or {}).get("unit") or "m"]
    times, values = series["time"], [factor * v for v in series["value"]]
    ends = [None if i is None or None in i else [factor * e for e in i] for i in series["interval"]]
    limit = (trend or {}).get("limit")
    shown = values + [e for i in ends if i for e in i] + ([factor * limit] if limit is not None else [])
    x, y = _Scale(times, 64, width - 16, 0.02), _Scale(shown, height - 34, 12, 0.05)
    parts = ['<svg class="large" viewBox="0 0 %d %d" role="img" aria-label="estimates over time">' % (width, height)]
    for tick in _ticks(min(shown), max(shown)):
        parts.append('<path class="grid" d="M64 %gH%d"/><text x="58" y="%g" text-anchor="end">%g</text>'
                     % (y(tick), width - 16, y(tick) + 4, tick))
    for time, text in _dates(min(times), max(times)):
        parts.append('<text x="%g" y="%d" text-anchor="middle">%s</text>' % (min(max(x(time), 84), width - 44), height - 10, text))
    parts.append('<text x="8" y="12">%s</text>' % unit)
    if limit is not None:
        parts.append('<path class="limit" d="M64 %gH%d"/><text x="%d" y="%g" text-anchor="end">service limit %.4g %s</text>'
                     % (y(factor * limit), width - 16, width - 20, y(factor * limit) - 4, factor * limit, unit))
    parts.append('<path class="bars" d="%s"/>' % " ".join("M%g %gV%g" % (x(t), y(i[0]), y(i[1]))
                                                          for t, i in zip(times, ends) if i))
    line = _line(trend, times)
    if line:
        parts.append('<polyline class="%s" points="%s"/>' % ("trend" if trend.get("grows") else "flat",
                                                            _path([(t, factor * v) for t, v in line], x, y)))
    parts.append('<path class="dots" d="%s"/></svg>' % " ".join("M%g %gh0" % (x(t), y(v)) for t, v in zip(times, values)))
    return "".join(parts)
