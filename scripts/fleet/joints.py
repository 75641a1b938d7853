# SPDX-License-Identifier: BSD-3-Clause
"""What is reported of each joint: its grade now, its trend, what is not known. Nothing is estimated here."""
import json

from . import errors, history

# How much a joint needs a look; the first that fits.
LEVELS = ("fault", "watch", "cannot_tell", "good", "ungraded")
LEVEL_OF_GRADE = {"stop": "fault", "service": "fault", "watch": "watch", "cannot_tell": "cannot_tell", "good": "good",
           "ungraded": "ungraded"}
_WORST = ("stop", "service", "watch", "cannot_tell", "ungraded", "good")
_LEVEL_OF_TREND = {1: "watch", 2: "fault"}
_CODES = {"fault": errors.FAULT, "watch": errors.WATCH, "cannot_tell": errors.INCONCLUSIVE, "good": errors.HEALTHY,
          "ungraded": errors.HEALTHY}


def _newest(rows):
    """The record that shows how the joint is; where none has a time, the worst."""
    dated = history.usable(rows)
    if dated:
        return dated[-1]
    done = [row for row in rows if row["status"] == "done"]
    return min(done, key=lambda row: _WORST.index(row["grade"])) if done else None


def _changes(row):
    found = json.loads(row["changes"]) if row is not None and row["changes"] else {}
    return found.get("changes") or []


def _level(newest, trend_code):
    """Of the newest verdict, the trend and what has changed in the newest record."""
    if newest is None:
        return "cannot_tell"
    levels = [LEVEL_OF_GRADE[newest["grade"]], _LEVEL_OF_TREND.get(trend_code), "fault" if _changes(newest) else None]
    return next(level for level in LEVELS if level in levels)


def _notes(rows, newest):
    """What a reader must know before believing the rest."""
    notes = []
    bad = [row for row in rows if row["status"] != "done"]
    undated = [row for row in rows if row["status"] == "done" and row["time"] is None]
    if bad:
        notes.append("%d of %d records cannot be used: %s" % (len(bad), len(rows), bad[-1]["reason"]))
    if undated:
        notes.append("%d of %d records have no date (%s): not in the trend" % (len(undated), len(rows), _no_date(undated[0])))
    if newest is not None and newest["time"] is None:
        notes.append("no record has a date: the worst one is shown")
    return notes


def _no_date(row):
    return {"name": "{time} in the name is none", "stamps": "their stamps are none: say time: mtime in the map"}[row["time_from"]]


def summary(state, joint):
    """Of one joint, as in fleet.json."""
    rows = state.of_joint(joint)
    newest, stored = _newest(rows), state.trend(joint)
    trend = json.loads(stored["json"]) if stored is not None and history.usable(rows) else None
    level = _level(newest, stored["exit_code"] if trend else None)
    angular = newest is not None and newest["backlash"] is None and newest["angle"] is not None
    if trend and trend.get("unit"):
        angular = trend["unit"] == "rad"
    entry = {"joint": joint, "level": level, "grade": newest["grade"] if newest is not None else None,
             "records": len(rows), "usable": sum(row["status"] == "done" for row in rows),
             "unit": "rad" if angular else "m", "backlash": None, "interval": None, "time": None, "date": None,
             "message": None, "record": None, "changes": _changes(newest), "notes": _notes(rows, newest)}
    if newest is not None:
        value, ends = ("angle", ("angle_lower", "angle_upper")) if angular else ("backlash", ("lower", "upper"))
        entry.update(backlash=newest[value], interval=[newest[end] for end in ends], time=newest["time"],
                     date=history.date(newest["time"]) if newest["time"] is not None else None,
                     message=json.loads(newest["verdict"])["message"], record=newest["name"])
    entry["trend"] = {key: value for key, value in trend.items() if key != "series"} if trend else None
    return entry, (trend or {}).get("series"), rows


def rank(entry):
    """Sorts joints: those that need a look first, among them those that grow, by the date of the limit and the rate."""
    trend = entry["trend"] or {}
    reaches = (trend.get("reaches") or {}).get("time")
    return (LEVELS.index(entry["level"]), not trend.get("grows"), reaches is None, reaches or 0,
            -(trend.get("rate") or 0), entry["joint"])


def exit_code(levels):
    """Of the whole fleet: that of the joint that needs a look most."""
    if not levels:
        return errors.INCONCLUSIVE
    return _CODES[min(levels, key=LEVELS.index)]
