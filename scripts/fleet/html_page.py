# SPDX-License-Identifier: BSD-3-Clause
"""The frame of the pages: one file that loads nothing, and runs nothing but the script that it was written with."""
import base64
import hashlib
import html
import math

from . import svg

STYLE = """
* { box-sizing: border-box; }
body { font: 15px/1.45 sans-serif; color: #222; max-width: 84em; margin: 1.5em auto; padding: 0 1.2em; }
h1 { font-size: 1.5em; margin: 0 0 0.2em; overflow-wrap: anywhere; }
h2 { font-size: 1.15em; margin-top: 2em; border-bottom: 1px solid #ccc; }
a { color: #1a5e9a; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; vertical-align: middle; padding: 0.35em 0.9em 0.35em 0; }
th { font-weight: normal; color: #666; white-space: nowrap; border-bottom: 1px solid #ccc; }
tbody tr + tr td { border-top: 1px solid #eee; } tbody tr:hover td { background: #f7f9fb; }
.scroll { overflow-x: auto; }
.number { white-space: nowrap; font-variant-numeric: tabular-nums; }
.small, .interval { color: #666; font-size: 0.87em; } .text { overflow-wrap: anywhere; min-width: 11em; }
.joint { overflow-wrap: anywhere; min-width: 11em; font-weight: bold; }
.grade { display: inline-block; padding: 0.05em 0.6em; border-radius: 0.8em; color: #fff; white-space: nowrap; font-size: 0.9em; }
.grade.fault { background: #b3261e; } .grade.watch { background: #b06a00; } .grade.good { background: #2a7d3c; }
.grade.cannot_tell, .grade.unusable { background: #6b6b6b; } .grade.ungraded { background: #51708c; }
.verdict { border-left: 0.5em solid #888; padding: 0.5em 1em; background: #f6f6f6; overflow-wrap: anywhere; }
.verdict.fault { border-color: #b3261e; } .verdict.watch { border-color: #d98200; } .verdict.good { border-color: #2a8a3e; }
.filters { display: flex; flex-wrap: wrap; gap: 0.5em; align-items: center; margin: 1em 0; }
.filters button { font: inherit; padding: 0.3em 0.9em; border: 1px solid #bbb; border-radius: 0.4em; background: #fff;
  cursor: pointer; border-left-width: 0.4em; }
.filters button.fault { border-left-color: #b3261e; } .filters button.watch { border-left-color: #d98200; }
.filters button.cannot_tell { border-left-color: #888; } .filters button.good { border-left-color: #2a8a3e; }
.filters button.ungraded { border-left-color: #51708c; } .filters button.growing { border-left-color: #1f6fb4; }
.filters button[aria-pressed=true] { background: #e3edf6; border-color: #1f6fb4; }
.filters input { font: inherit; padding: 0.3em 0.6em; border: 1px solid #bbb; border-radius: 0.4em; min-width: 12em; flex: 0 1 20em; }
th button { font: inherit; color: inherit; background: none; border: 0; padding: 0; cursor: pointer; }
th[aria-sort=ascending] button::after { content: " \\25B4"; } th[aria-sort=descending] button::after { content: " \\25BE"; }
svg.curve { display: block; } svg.large { width: 100%; max-width: 62em; height: auto; } svg text { font: 12px sans-serif; fill: #666; }
.dots { stroke: #1f6fb4; stroke-width: 3.2; stroke-linecap: round; fill: none; } .large .dots { stroke-width: 5; }
.bars { stroke: #b9c6d2; stroke-width: 1; fill: none; } .grid { stroke: #eee; fill: none; }
.trend { stroke: #b3261e; stroke-width: 1.5; fill: none; } .flat { stroke: #999; stroke-width: 1; fill: none; }
.limit { stroke: #222; stroke-width: 1; stroke-dasharray: 4 3; fill: none; }
pre { background: #f6f6f6; padding: 0.6em 1em; overflow: auto; font-size: 0.85em; white-space: pre-wrap; overflow-wrap: anywhere; }
/* On a telephone a row is a paragraph. */
@media (max-width: 40em) {
  .stacked thead, .stacked td:empty { display: none; } .stacked, .stacked tbody, .stacked tr, .stacked td { display: block; }
  .stacked tr { padding: 0.5em 0; } .stacked tbody tr + tr { border-top: 1px solid #ccc; }
  .stacked tbody tr td { padding: 0.1em 0; border: 0; min-width: 0; white-space: normal; }
  .stacked td[data-label]::before { content: attr(data-label) ": "; color: #666; font-weight: normal; } .stacked td br { display: none; }
  .stacked tr[hidden] { display: none; }
}
"""
LABELS = {"fault": "service", "watch": "watch", "cannot_tell": "cannot tell", "good": "good", "ungraded": "ungraded"}


def escape(text):
    return html.escape(str(text), quote=True)


def page(title, body, script=""):
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    if script:
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        policy += "; script-src 'sha256-%s'" % digest
        script = "<script>%s</script>\n" % script
    return ("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
            "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
            "<meta http-equiv=\"Content-Security-Policy\" content=\"%s\">\n<title>%s</title>\n<style>%s</style>\n</head>\n"
            "<body>\n%s\n%s</body>\n</html>\n" % (policy, escape(title), STYLE, body, script))


def digits(value):
    return "%.3g" % value if abs(value) < 1000 else "%.0f" % value


def value(number, interval, unit):
    """A value with its 95 % interval below it, in um or mrad; a dash where it is not known."""
    factor, name = svg.UNITS[unit]
    if number is None:
        return "&ndash;"
    text = "%s %s" % (digits(factor * number), name)
    if interval and any(end is not None for end in interval):
        text += '<br><span class="interval">%s</span>' % ends(interval, factor)
    return text


def ends(interval, factor):
    """Both ends to three digits of the larger one."""
    known = [factor * end for end in interval if end is not None and math.isfinite(end)]
    largest = max(map(abs, known), default=0)
    places = max(0, 2 - math.floor(math.log10(largest))) if largest > 0 else 0
    return "%s to %s" % tuple("?" if end is None or not math.isfinite(end) else "%.*f" % (places, factor * end)
                              for end in interval)


def grade(level, text=None):
    return '<span class="grade %s">%s</span>' % (level, escape(text or LABELS.get(level, level)))
