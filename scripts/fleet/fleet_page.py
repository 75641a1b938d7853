# SPDX-License-Identifier: BSD-3-Clause
"""fleet.html: all joints, those that need a look first, with small curves; a filter; each leads to its records."""
import urllib.parse

from . import history, svg
from .html_page import LABELS, digits, ends, escape, grade, page as framed, value
from .joints import LEVELS

MONTH = 30 * 86400  # s

SCRIPT = """
'use strict';
const body = document.querySelector('#joints tbody'), rows = Array.from(body.rows), find = document.getElementById('find');
const buttons = Array.from(document.querySelectorAll('.filters button')), shown = document.getElementById('shown');
function show() {
  const words = find.value.toLowerCase().split(/\\s+/).filter(word => word);
  const chosen = buttons.filter(b => b.getAttribute('aria-pressed') === 'true').map(b => b.dataset.show);
  const levels = chosen.filter(c => c !== 'growing');
  let count = 0;
  for (const row of rows) {
    const text = row.dataset.text;
    const there = words.every(word => text.includes(word)) && (!levels.length || levels.includes(row.dataset.level)) &&
      (!chosen.includes('growing') || row.dataset.grows === '1');
    row.hidden = !there;
    count += there;
  }
  shown.textContent = count === rows.length ? rows.length + ' joints' : count + ' of ' + rows.length + ' joints';
  try {
    history.replaceState(null, '', '#' + new URLSearchParams({find: find.value, show: chosen.join(',')}));
  } catch (error) { /* a browser that allows no address for files keeps none */ }
}
function sort(head, index) {
  const ascending = head.getAttribute('aria-sort') === 'none' ? head.dataset.first !== 'descending' :
    head.getAttribute('aria-sort') !== 'ascending';
  for (const other of head.parentNode.cells) if (other.hasAttribute('aria-sort')) other.setAttribute('aria-sort', 'none');
  head.setAttribute('aria-sort', ascending ? 'ascending' : 'descending');
  const key = row => row.cells[index].dataset.sort, number = head.dataset.kind === 'number';
  const compare = (a, b) => {
    const x = key(a), y = key(b);
    if (x === '' || y === '') return (x === '') - (y === '');  // unknown last, either way
    const difference = number ? x - y : x.localeCompare(y);
    return ascending ? difference : -difference;
  };
  body.append(...rows.sort(compare));
}
for (const button of buttons) button.addEventListener('click', () => {
  button.setAttribute('aria-pressed', button.getAttribute('aria-pressed') !== 'true');
  show();
});
find.addEventListener('input', show);
Array.from(document.querySelectorAll('#joints th')).forEach((head, index) => {
  const button = head.querySelector('button');
  if (button) button.addEventListener('click', () => sort(head, index));
});
const before = new URLSearchParams(location.hash.slice(1));
find.value = before.get('find') || '';
for (const button of buttons)
  button.setAttribute('aria-pressed', (before.get('show') || '').split(',').includes(button.dataset.show));
show();
"""
HEADS = (("joint", "text", "ascending"), ("grade", "number", "ascending"), ("backlash", "number", "descending"),
         ("history", None, None), ("growth in 30 days", "number", "descending"), ("limit reached", "number", "ascending"),
         ("records", "number", "descending"), ("newest", "number", "descending"), ("to know", None, None))


def _head():
    cells = []
    for text, kind, first in HEADS:
        if kind is None:
            cells.append("<th>%s</th>" % text)
        else:
            cells.append('<th aria-sort="none" data-kind="%s" data-first="%s"><button>%s</button></th>' % (kind, first, text))
    return "<thead><tr>%s</tr></thead>" % "".join(cells)


def _cell(content, sort=None, kind=""):
    return '<td%s%s>%s</td>' % (' class="%s"' % kind if kind else "",
                                ' data-sort="%s"' % escape("" if sort is None else sort) if sort is not False else "", content)


def _growth(joint):
    """What the trend says, and by what it is sorted."""
    trend = joint["trend"]
    if not trend or trend.get("rate") is None:
        return "&ndash;", None
    factor, unit = svg.UNITS[joint["unit"]]
    rate = factor * MONTH * trend["rate"]
    if not trend["known"]:
        return "&ndash;", None
    interval = ends([MONTH * r if r is not None else None for r in trend["rate_interval"] or (None, None)], factor)
    if not trend["grows"]:
        return '<span class="interval">none seen<br>%s %s</span>' % (interval, unit), rate
    return '<b>+%s %s</b><br><span class="interval">%s</span>' % (digits(rate), unit, interval), rate


def _reaches(joint):
    trend = joint["trend"] or {}
    if trend.get("exceeded"):
        return "<b>exceeded</b>", 0
    reaches = trend.get("reaches")
    if not reaches or not reaches.get("date"):
        return "&ndash;" if trend.get("limit") is not None or not trend else '<span class="interval">no limit</span>', None
    dates = [date[:10] if date else "?" for date in reaches["date_interval"]]
    return "%s<br><span class=\"interval\">%s to %s</span>" % (reaches["date"][:10], *dates), reaches["time"]


def _row(joint, series):
    trend = joint["trend"] or {}
    link = "joints/%s.html" % urllib.parse.quote(history.file_name(joint["joint"]))
    growth, rate = _growth(joint)
    reached, when = _reaches(joint)
    count = "%d" % joint["usable"] if joint["usable"] == joint["records"] else "%d of %d" % (joint["usable"], joint["records"])
    notes = list(joint["notes"])
    if joint["changes"]:
        notes.insert(0, "changed within the newest record: " + ", ".join(change["effect"] for change in joint["changes"]))
    if trend and not trend.get("known"):
        notes.append(trend["message"])
    words = " ".join([joint["joint"], joint["level"], joint["grade"] or "", joint["message"] or ""] + notes).lower()
    cells = [
        _cell('<a href="%s">%s</a>' % (escape(link), escape(joint["joint"])), joint["joint"], "joint"),
        _cell(grade(joint["level"], joint["grade"].replace("_", " ") if joint["level"] == "fault" and joint["grade"] in
                    ("service", "stop") else None), LEVELS.index(joint["level"])),
        _cell(value(joint["backlash"], joint["interval"], joint["unit"]), joint["backlash"], "number"),
        _cell(svg.small(series, trend), False),
        _cell(growth, rate, "number"), _cell(reached, when, "number"), _cell(count, joint["usable"], "number"),
        _cell((joint["date"] or "&ndash;")[:10], joint["time"], "number"),
        _cell("<br>".join('<span title="%s">%s</span>' % (escape(note), escape(note.partition(": ")[0])) for note in notes), False,
              "text small")]
    cells = [cell if head in ("joint", "history") else cell.replace("<td", '<td data-label="%s"' % head, 1)
             for (head, _, _), cell in zip(HEADS, cells)]
    return '<tr data-level="%s" data-grows="%d" data-text="%s">%s</tr>' % (joint["level"], bool(trend.get("grows")),
                                                                           escape(words), "".join(cells))


def _filters(fleet):
    growing = sum(bool((joint["trend"] or {}).get("grows")) for joint in fleet["joints"])
    buttons = ['<button class="%s" data-show="%s" aria-pressed="false">%d %s</button>' % (level, level, count, LABELS[level])
               for level, count in fleet["levels"].items() if count]
    buttons.append('<button class="growing" data-show="growing" aria-pressed="false">%d growing</button>' % growing)
    return ('<div class="filters">%s<input id="find" type="search" placeholder="find a joint" aria-label="find a joint">'
            '<span id="shown" class="small">%d joints</span></div>' % ("".join(buttons), len(fleet["joints"])))


def _without_joint(fleet):
    if not fleet["without_joint"]:
        return ""
    rows = "".join('<tr><td class="text">%s</td><td class="text">%s</td></tr>' % (escape(row["record"]), escape(row["reason"]))
                   for row in fleet["without_joint"])
    return ('<h2>Records of no joint</h2>\n<div class="scroll"><table class="others"><thead><tr><th>record</th><th>why</th></tr>'
            "</thead><tbody>%s</tbody></table></div>\n" % rows)


def page(fleet, series):
    counts = fleet["records"]["by_status"]
    other = ", ".join("%d %s" % (n, status.replace("_", " ")) for status, n in sorted(counts.items()) if status != "done")
    lines = ['<h1>Backlash of the fleet</h1>', '<p class="small">%s UTC: %d joints, %d records, %d of them diagnosed%s.</p>'
             % (escape(fleet["written"][:16].replace("T", " ")), len(fleet["joints"]), sum(counts.values()),
                counts.get("done", 0), escape("; " + other) if other else ""), _filters(fleet)]
    rows = "\n".join(_row(joint, series[joint["joint"]]) for joint in fleet["joints"])
    lines.append('<div class="scroll"><table id="joints" class="stacked">%s<tbody>\n%s\n</tbody></table></div>' % (_head(), rows))
    lines.append('<p class="small">Backlash is that of the newest record, with its 95 %% interval; growth is the rate of the '
                 'trend over all records. A joint is put under <i>service</i> or <i>watch</i> by its newest grade, or where the '
                 'trend says that the limit (dashed) is exceeded or reached within %g days. Red line: a growth that is sure '
                 'with 95 %%. A click on a joint shows its records.</p>' % fleet["horizon"])
    lines.append(_without_joint(fleet))
    lines.append('<h2>How this page came about</h2>\n<pre id="command">%s</pre>\n<p class="small">backlash_diagnosis %s; '
                 '%d records computed in this run of %.0f s, the others before.</p>'
                 % (escape(fleet["command"]), escape(fleet["version"]), fleet["records"]["computed"], fleet["seconds"]))
    return framed("Backlash of the fleet", "\n".join(lines), SCRIPT)
