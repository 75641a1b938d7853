# SPDX-License-Identifier: BSD-3-Clause
"""joints/NAME.html: the history of a joint large, and each of its records with what was said of it."""
import json
import os
import shlex

from . import history, svg
from .diagnosis import Commands
from .html_page import escape, grade, page as framed, value
from .joints import LEVEL_OF_GRADE


def _changes(row):
    found = json.loads(row["changes"]) if row["changes"] else None
    if found is None:
        return ""
    if found["status"] != "done":
        return "no search for changes: " + found["reason"]
    return "; ".join("%s changed since %.1f s" % (c["effect"], c["since"]) for c in found["changes"]) or "no change within"


def _record(row, unit, report):
    done = row["status"] == "done"
    columns = ("angle", "angle_lower", "angle_upper") if unit == "rad" else ("backlash", "lower", "upper")
    number, low, high = (row[column] for column in columns)
    message = json.loads(row["verdict"])["message"] if done else row["reason"]
    said = "<br>".join(escape(text) for text in (message, _changes(row)) if text)
    when = history.date(row["time"]).replace("T", " ").rstrip("Z") if row["time"] is not None else "no date"
    mark = grade(LEVEL_OF_GRADE[row["grade"]], row["grade"].replace("_", " ")) if done else grade("unusable", row["status"].replace(
        "_", " "))
    link = '<a href="%s">report</a>' % escape(report) if report else ""
    return ('<tr><td class="number">%s</td><td class="text">%s</td><td>%s</td><td class="number">%s</td>'
            '<td class="text small">%s</td><td>%s</td></tr>'
            % (escape(when), escape(row["name"]), mark, value(number, [low, high], unit), said, link))


def _command(rows):
    """How a report of any of the records is written."""
    for row in reversed(rows):
        if row["verdict"]:
            words = Commands("diagnose_record", None).diagnose(row["path"], json.loads(row["options"]))
            words[words.index("--json") + 1] = "report.json"
            return "rosrun backlash_diagnosis " + shlex.join(words + ["--report", "report.html"])
    return None


def page(joint, series, rows, report_of):
    """`report_of(row)` is the path of a record's page, or None."""
    lines = ['<p class="small"><a href="../fleet.html">all joints</a></p>', "<h1>%s</h1>" % escape(joint["joint"])]
    said = [text for text in (joint["message"], (joint["trend"] or {}).get("message")) if text]
    lines.append('<p class="verdict %s">%s</p>' % (joint["level"], "<br>".join(escape(text) for text in said)
                                                   or "no record of this joint can be used"))
    for note in joint["notes"] + (joint["trend"] or {}).get("warnings", []):
        lines.append('<p class="small">%s</p>' % escape(note))
    lines.append(svg.large(series, joint["trend"]))
    lines.append('<h2>Records</h2>\n<div class="scroll"><table id="records" class="stacked"><thead><tr><th>time (UTC)</th><th>record</th>'
                 "<th>grade</th><th>backlash</th><th>what was said</th><th></th></tr></thead><tbody>")
    lines.extend(_record(row, joint["unit"], report_of(row)) for row in reversed(rows))
    lines.append("</tbody></table></div>")
    command = _command(rows)
    if command:
        lines.append('<p class="small">The report of a record that has none yet:</p><pre id="command">%s</pre>' % escape(command))
    lines.append('<p class="small">History for backlash_trend: %s</p>'
                 % escape(os.path.join("history", history.file_name(joint["joint"]) + ".csv")))
    return framed(joint["joint"], "\n".join(lines))
