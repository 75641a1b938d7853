# SPDX-License-Identifier: BSD-3-Clause
"""Pages of single records, by diagnose_record: of the newest of each joint, as each takes a second for its plots."""
import json
import os

from . import history
from .errors import cannot_write


def file_name(key):
    return "reports/%s.html" % key[:16]


class Reports:
    """A source of tasks for the engine; pages that are there already are left."""

    def __init__(self, state, commands, version, folder, per_joint):
        self._state, self._commands, self._version, self._folder = state, commands, version, folder
        self._per_joint = per_joint
        self._tasks = None
        self.done, self.failed = 0, []
        try:
            os.makedirs(os.path.join(folder, "reports"), exist_ok=True)
        except OSError as error:
            raise cannot_write(os.path.join(folder, "reports"), error.strerror) from None

    def _wanted(self):
        seen = set()
        for joint in self._state.joints() if self._per_joint else ():
            for row in history.usable(self._state.of_joint(joint))[-self._per_joint:]:
                path = os.path.join(self._folder, file_name(row["key"]))
                if row["key"] in seen or os.path.exists(path) or not os.path.exists(row["path"]):
                    continue
                seen.add(row["key"])
                place = self._state.place(row["path"])
                options = json.loads(self._state.settings(row["settings"])["options"])
                yield {"key": "page-" + row["key"], "record": row["path"], "size": place["size"], "mtime": place["mtime"],
                       "version": self._version, "time_limit": self._commands.time_limit, "changes": None,
                       "command": self._commands.diagnose(row["path"], options) + ["--report", path]}

    async def source(self, count):
        if self._tasks is None:
            self._tasks = self._wanted()
        return [task for _, task in zip(range(count), self._tasks)]

    async def take(self, pairs):
        for task, row in pairs:
            self.done += 1
            if row["status"] != "done":
                self.failed.append((task["record"], row["reason"]))
