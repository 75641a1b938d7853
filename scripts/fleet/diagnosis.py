# SPDX-License-Identifier: BSD-3-Clause
"""Feeds the engine with the records that wait and writes what comes back. The same record twice is one task."""
import asyncio
import json
import os

from . import digests

_OPTIONS = {"rig": "--rig", "limits": "--limits", "baseline": "--baseline", "curve": "--curve", "topic": "--topic",
            "joint_in_record": "--joint"}


class Commands:
    """The offline commands, by absolute paths that hold on every worker."""

    def __init__(self, diagnose_record, time_limit):
        self.diagnose_record, self.time_limit = diagnose_record, time_limit
        self.detect_changes = os.path.join(os.path.dirname(diagnose_record), "detect_changes")

    def diagnose(self, path, options):
        words = [self.diagnose_record, path, "--json", "-"]
        for name, value in options.items():
            words += [_OPTIONS[name], value]
        return words

    def changes(self, path, options, healthy):
        return [self.detect_changes, "--rig", options["rig"], "--healthy", *healthy, "--json", "-", path]


class Diagnosis:
    def __init__(self, state, commands, version):
        self._state, self._commands, self._version = state, commands, version
        self._after = ""    # path of the last record that was taken
        self._flying = {}   # key -> rows of records whose result it is
        self._settings = {}
        self.done = 0

    async def source(self, count):
        """Up to so many tasks; records whose result is known meanwhile are settled on the way."""
        tasks = []
        while not tasks:
            rows = self._state.waiting(self._after, count)
            if not rows:
                return []
            self._after = rows[-1]["path"]
            named = await asyncio.to_thread(self._digested, rows)
            with self._state.transaction():
                tasks = [task for row, digest in named if (task := self._task(row, digest)) is not None]
        return tasks

    @staticmethod
    def _digested(rows):
        named = []
        for row in rows:
            try:
                named.append((row, row["digest"] or digests.of_file(row["path"])))
            except OSError as error:
                named.append((row, error))
        return named

    def _task(self, row, digest):
        """None where there is nothing to compute."""
        if isinstance(digest, OSError):
            self._give_up(row["path"], "cannot be read: %s" % digest.strerror)
            return None
        key = digests.key(digest, row["settings"], self._version)
        if self._state.has_result(key):
            self._settle([row], digest, key)
            return None
        if key in self._flying:
            self._flying[key].append(row)
            return None
        self._flying[key] = [row]
        options, healthy = self._settings_of(row["settings"])
        return {"key": key, "digest": digest, "record": row["path"], "size": row["size"], "mtime": row["mtime"],
                "version": self._version, "time_limit": self._commands.time_limit,
                "command": self._commands.diagnose(row["path"], options),
                "changes": self._commands.changes(row["path"], options, healthy) if healthy else None}

    def _settings_of(self, digest):
        if digest not in self._settings:
            row = self._state.settings(digest)
            self._settings[digest] = json.loads(row["options"]), json.loads(row["healthy"])
        return self._settings[digest]

    async def take(self, pairs):
        with self._state.transaction():
            for task, row in pairs:
                waiting = self._flying.pop(task["key"])
                if row["status"] in ("changed", "missing"):
                    for record in waiting:
                        self._give_up(record["path"], row["reason"])
                    continue
                self._state.put_result(row, task["digest"], waiting[0]["settings"], self._version)
                self._settle(waiting, task["digest"], task["key"])

    def _settle(self, rows, digest, key):
        for row in rows:
            self._state.settle(row["path"], digest, key)
        self.done += len(rows)

    def _give_up(self, path, reason):
        self._state.give_up(path, reason, again=True)
        self.done += 1
