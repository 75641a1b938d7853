# SPDX-License-Identifier: BSD-3-Clause
"""Looks at every record once: what is it of, is its result known, what is left to do. Nothing is computed here."""
import datetime
import json
import re

from . import digests, rig_map

_COMMIT_EACH = 500  # records
_FORMATS = ("%Y%m%dT%H%M%S", "%Y-%m-%dT%H:%M:%S", "%Y-%m-%dT%H-%M-%S", "%Y-%m-%d_%H-%M-%S", "%Y%m%d_%H%M%S", "%Y-%m-%d",
            "%Y%m%d")
_SECONDS = re.compile(r"\d{9,10}(\.\d+)?\Z")


def named_time(text):
    """s since 1970 of a time in UTC as names have it; None where it is none."""
    if _SECONDS.match(text):
        return float(text)
    text = text.rstrip("Z")
    for form in _FORMATS:
        try:
            return datetime.datetime.strptime(text, form).replace(tzinfo=datetime.timezone.utc).timestamp()
        except ValueError:
            continue
    return None


class Scan:
    def __init__(self, state, rigs, version):
        self._state, self._rigs, self._version = state, rigs, version
        self._settings = digests.Settings(rig_map.FILES)
        self._known = {}  # assignment without its time -> digest of its settings
        self.found = 0

    def run(self, records, each=lambda count: None):
        """Brings the state up to the records that are there. Throws FleetError for an ambiguous map."""
        group = []
        for record in records:
            group.append(record)
            if len(group) == _COMMIT_EACH:
                self._take(group)
                each(self.found)
                group = []
        self._take(group)
        self._state.mark_gone()

    def _take(self, group):
        with self._state.transaction():
            for record in group:
                self._state.put_place(self._place(record))
        self.found += len(group)

    def _place(self, record):
        row = {"path": record.path, "name": record.name, "size": record.size, "mtime": record.mtime,
               "seen": self._state.run, "waits": 2}
        try:
            record.path.encode()
        except UnicodeEncodeError:
            row["path"] = row["name"] = record.path.encode("utf-8", "backslashreplace").decode()
            return dict(row, reason="its name is not UTF-8: rename it")
        assignment = self._rigs.assignment(record.name)
        if assignment is None:
            return dict(row, reason="no entry of the map matches it")
        row.update(joint=assignment.joint, time_from=assignment.time)
        if assignment.time == "name":
            row["named_time"] = named_time(assignment.named_time)
        if record.size is None:
            return dict(row, reason="there is no such file")
        try:
            row["settings"] = self._settings_of(assignment)
        except OSError as error:
            return dict(row, reason="%s: cannot be read: %s" % (error.filename, error.strerror))
        return self._with_result(row)

    def _settings_of(self, assignment):
        digest = self._known.get((assignment.options, assignment.healthy))
        if digest is None:
            digest = self._settings.digest(assignment)
            self._known[assignment.options, assignment.healthy] = digest
            self._state.put_settings(digest, json.dumps(dict(assignment.options)), json.dumps(list(assignment.healthy)))
        return digest

    def _with_result(self, row):
        """The same file with the same settings was computed before, or waits."""
        before = self._state.place(row["path"])
        row["waits"] = 1
        if before is not None and before["digest"] and (before["size"], before["mtime"]) == (row["size"], row["mtime"]):
            row["digest"] = before["digest"]
            key = digests.key(row["digest"], row["settings"], self._version)
            if self._state.has_result(key):
                row.update(key=key, waits=0)
        return row
