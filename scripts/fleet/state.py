# SPDX-License-Identifier: BSD-3-Clause
"""The state of a run: one SQLite file with a row per record and a row per result. It has one writer, the client."""
import fcntl
import os
import sqlite3

from .errors import FleetError, CANNOT_WRITE, bad_data, cannot_write

SCHEMA = 1
# A date before ROS was there is none: such stamps count from the start of a record.
FIRST_DATE = 1167609600  # 2007-01-01

RESULT = ("key", "status", "reason", "exit_code", "grade", "message", "backlash", "lower", "upper", "angle", "angle_lower",
          "angle_upper", "skewness", "methods", "rig", "rig_digest", "begin", "end", "residual", "changes", "estimates",
          "verdict", "warnings", "seconds", "host", "finished")
# Ends of a command that another start may spare: --retry asks again.
AGAIN = ("crashed", "timed_out")

TABLES = """
CREATE TABLE IF NOT EXISTS meta (name TEXT PRIMARY KEY, value TEXT) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS settings (digest TEXT PRIMARY KEY, options TEXT, healthy TEXT) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS record (
  path TEXT PRIMARY KEY, name TEXT, joint TEXT, size INTEGER, mtime INTEGER, time_from TEXT, named_time REAL,
  digest TEXT, settings TEXT, key TEXT, reason TEXT, seen INTEGER, waits INTEGER);
CREATE INDEX IF NOT EXISTS record_waits ON record (path) WHERE waits = 1;
CREATE INDEX IF NOT EXISTS record_key ON record (key);
CREATE INDEX IF NOT EXISTS record_joint ON record (joint);
CREATE TABLE IF NOT EXISTS result (
  key TEXT PRIMARY KEY, record_digest TEXT, settings TEXT, version TEXT, status TEXT, reason TEXT, exit_code INTEGER,
  grade TEXT, message TEXT, backlash REAL, lower REAL, upper REAL, angle REAL, angle_lower REAL, angle_upper REAL,
  skewness REAL, methods TEXT, rig TEXT, rig_digest TEXT, begin REAL, end REAL, residual REAL, changes TEXT,
  estimates TEXT, verdict TEXT, warnings TEXT, seconds REAL, host TEXT, finished REAL);
CREATE TABLE IF NOT EXISTS trend (joint TEXT PRIMARY KEY, input TEXT, exit_code INTEGER, json TEXT);
DROP VIEW IF EXISTS fleet;
CREATE VIEW fleet AS SELECT record.path, record.name, record.joint, record.seen, record.settings, settings.options, record.digest AS record_digest,
  CASE record.time_from WHEN 'name' THEN record.named_time WHEN 'mtime' THEN record.mtime / 1e9
    ELSE CASE WHEN result.end >= %d THEN result.end END END AS time,
  record.time_from, coalesce(result.status, CASE WHEN record.waits = 1 THEN 'waiting' ELSE 'unusable' END) AS status,
  coalesce(record.reason, result.reason) AS reason, result.key, result.exit_code, result.grade, result.backlash, result.lower,
  result.upper, result.angle, result.angle_lower, result.angle_upper, result.skewness, result.methods, result.rig,
  result.rig_digest, result.residual, result.changes, result.estimates, result.verdict, result.warnings, result.seconds,
  result.host, result.finished
  FROM record LEFT JOIN result ON result.key = record.key LEFT JOIN settings ON settings.digest = record.settings;
""" % FIRST_DATE


class State:
    """Throws FleetError where the file cannot be written, is none of this command or is in use by another one."""

    def __init__(self, folder):
        self.path = os.path.join(folder, "fleet.sqlite")
        self._lock(os.path.join(folder, "fleet.lock"))
        try:
            self._base = sqlite3.connect(self.path, isolation_level=None, timeout=30)
            self._base.row_factory = sqlite3.Row
            self._base.execute("PRAGMA journal_mode = WAL")
            self._base.execute("PRAGMA synchronous = NORMAL")  # a power cut may cost the last results, never the file
            self._base.executescript(TABLES)
            self._check_schema()
        except sqlite3.OperationalError as error:
            raise cannot_write(self.path, error) from None
        except sqlite3.DatabaseError as error:
            raise bad_data("%s: is no state of fleet_report: %s" % (self.path, error)) from None
        self.run = 1 + int(self._meta("run") or 0)
        self._set_meta("run", self.run)

    def _lock(self, path):
        try:
            self._locked = open(path, "a+", encoding="utf-8")
            fcntl.flock(self._locked, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._locked.truncate(0)
            self._locked.write("%d\n" % os.getpid())
            self._locked.flush()
        except BlockingIOError:
            raise FleetError(CANNOT_WRITE, "%s: another fleet_report is writing there" % os.path.dirname(path)) from None
        except OSError as error:
            raise cannot_write(path, error.strerror) from None

    def _check_schema(self):
        there = self._meta("schema")
        if there is None:
            self._set_meta("schema", SCHEMA)
        elif there != str(SCHEMA):
            raise bad_data("%s: has schema %s, this version writes %d: give another --out" % (self.path, there, SCHEMA))

    def _meta(self, name):
        row = self._base.execute("SELECT value FROM meta WHERE name = ?", (name,)).fetchone()
        return row[0] if row else None

    def _set_meta(self, name, value):
        self._base.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (name, str(value)))

    def close(self):
        self._base.close()
        self._locked.close()

    def transaction(self):
        """All that is written within it is there, or nothing of it."""
        return _Transaction(self._base)

    # What there is to do.

    def place(self, path):
        """A record as it was seen last, or None."""
        return self._base.execute("SELECT * FROM record WHERE path = ?", (path,)).fetchone()

    def put_place(self, row):
        columns = ", ".join(row)
        self._base.execute("INSERT OR REPLACE INTO record (%s) VALUES (%s)" % (columns, ", ".join("?" * len(row))),
                           tuple(row.values()))

    def put_settings(self, digest, options, healthy):
        self._base.execute("INSERT OR REPLACE INTO settings VALUES (?, ?, ?)", (digest, options, healthy))

    def settings(self, digest):
        return self._base.execute("SELECT * FROM settings WHERE digest = ?", (digest,)).fetchone()

    def waiting(self, after, count):
        """The next records in the order of their paths whose result is not known."""
        return self._base.execute("SELECT * FROM record WHERE waits = 1 AND path > ? ORDER BY path LIMIT ?",
                                  (after, count)).fetchall()

    def count_waiting(self):
        return self._base.execute("SELECT count(*) FROM record WHERE waits = 1").fetchone()[0]

    def has_result(self, key):
        return self._base.execute("SELECT 1 FROM result WHERE key = ?", (key,)).fetchone() is not None

    def forget_failures(self):
        """Results of records that shall be tried again."""
        marks = ", ".join("?" * len(AGAIN))
        with self.transaction():
            self._base.execute("UPDATE record SET waits = 1, key = NULL WHERE key IN "
                               "(SELECT key FROM result WHERE status IN (%s))" % marks, AGAIN)
            self._base.execute("DELETE FROM result WHERE status IN (%s)" % marks, AGAIN)

    # What came of it.

    def settle(self, path, digest, key):
        """The result of this record is that of the key."""
        self._base.execute("UPDATE record SET digest = ?, key = ?, reason = NULL, waits = 0 WHERE path = ?", (digest, key, path))

    def give_up(self, path, reason, again):
        """This record has no result; `again`: the next start tries it once more."""
        self._base.execute("UPDATE record SET key = NULL, digest = NULL, reason = ?, waits = ? WHERE path = ?",
                           (reason, 2 if again else 0, path))

    def put_result(self, row, record_digest, settings, version):
        values = [row.get(column) for column in RESULT] + [record_digest, settings, version]
        self._base.execute("INSERT OR REPLACE INTO result (%s, record_digest, settings, version) VALUES (%s)"
                           % (", ".join(RESULT), ", ".join("?" * len(values))), values)

    def mark_gone(self):
        """Records that this run did not find stay in the history; nothing is left to do for them."""
        self._base.execute("UPDATE record SET waits = 0, reason = coalesce(reason, 'no longer there') "
                           "WHERE seen != ? AND waits != 0", (self.run,))

    # What is reported of it.

    def counts(self):
        """Number of records by status."""
        return dict(self._base.execute("SELECT status, count(*) FROM fleet GROUP BY status").fetchall())

    def joints(self):
        rows = self._base.execute("SELECT DISTINCT joint FROM record WHERE joint IS NOT NULL ORDER BY joint").fetchall()
        return [row[0] for row in rows]

    def of_joint(self, joint):
        """Its records, those without a time last."""
        return self._base.execute("SELECT * FROM fleet WHERE joint = ? ORDER BY time IS NULL, time, path", (joint,)).fetchall()

    def without_joint(self, most):
        return self._base.execute("SELECT * FROM fleet WHERE joint IS NULL ORDER BY path LIMIT ?", (most,)).fetchall()

    def trend(self, joint):
        return self._base.execute("SELECT * FROM trend WHERE joint = ?", (joint,)).fetchone()

    def put_trend(self, joint, digest, exit_code, text):
        self._base.execute("INSERT OR REPLACE INTO trend VALUES (?, ?, ?, ?)", (joint, digest, exit_code, text))


class _Transaction:
    def __init__(self, base):
        self._base = base

    def __enter__(self):
        self._base.execute("BEGIN IMMEDIATE")

    def __exit__(self, kind, *_):
        self._base.execute("COMMIT" if kind is None else "ROLLBACK")
