# SPDX-License-Identifier: BSD-3-Clause
"""The command fleet_report: what it is given, what it does in which order, what it reports."""
import argparse
import json
import os
import shlex
import shutil
import subprocess
import sys
import time

import plotting

from . import engine, errors, fleet_page, history, joint_page, joints, records, reports, rig_map, scan
from .diagnosis import Commands, Diagnosis
from .progress import Progress
from .state import State

NAME = "fleet_report"
EPILOG = """\
Results are in DIR/fleet.sqlite, the state of the run: killed and started again it goes on where it was. DIR/fleet.html is the
page, DIR/fleet.json the same for programs, DIR/history a history per joint for backlash_trend.

Examples:
  rosrun backlash_diagnosis fleet_report /data/robots --rigs map.yaml --out /data/fleet
  rosrun backlash_diagnosis fleet_report monday.txt --rigs map.yaml --out fleet --scheduler tcp://10.0.0.1:8786

Exit codes, by the joint that needs a look most:
  0   healthy, or without limits
  1   watch: a grade is watch, or a limit is reached within the horizon
  2   fault found: service or stop, a limit exceeded, a change within a record
  3   inconclusive: a joint has no answer, or there is none
  64  usage   65  bad input data   66  input missing, no scheduler   70  internal error   73  cannot write
  130 stopped by a signal: start it again to go on
"""
WITHOUT_JOINT = 1000  # records of no joint that are listed


def _number(kind, lower):
    def read(text):
        try:
            value = kind(text)
        except ValueError:
            value = None
        if value is None or not lower <= value < float("inf"):
            raise argparse.ArgumentTypeError("'%s': must be a number from %s on" % (text, lower))
        return value
    return read


def parser():
    p = plotting.Parser("Diagnoses the records of many joints, and reports which joints grow.")
    p.formatter_class = argparse.RawDescriptionHelpFormatter
    p.epilog = EPILOG
    p.add_argument("source", metavar="FOLDER|LIST", help="folder with records (.csv .bag .mcap .db3), or a text file with the "
                   "path of one per line")
    p.add_argument("--rigs", required=True, metavar="MAP.yaml", help="which rig file stands for which records")
    p.add_argument("--out", required=True, metavar="DIR", help="where the results are and go")
    p.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster (tcp://HOST:8786) whose machines see the same "
                   "paths; default: a cluster of the cores of this machine")
    p.add_argument("--cores", type=_number(int, 1), metavar="N", help="of this machine; default: all that the process may use")
    p.add_argument("--time-limit", type=_number(float, 1e-3), default=600.0, metavar="S", help="for a record [s]; one that takes "
                   "longer is a row that says so; default: 600")
    p.add_argument("--horizon", type=_number(float, 1e-3), default=90.0, metavar="DAYS", help="a limit that is reached within so "
                   "many days is worth watching; default: 90")
    p.add_argument("--reports", type=_number(int, 0), default=1, metavar="N", help="pages of the newest N records of each joint, "
                   "a second each; default: 1")
    p.add_argument("--retry", action="store_true", help="compute records again whose command crashed or ran out of time")
    p.add_argument("--diagnose-record", metavar="PATH", help="the command to run, on each machine; default: the one beside this "
                   "program")
    p.add_argument("--version", action="version", version="")
    return p


def _command(given):
    """Absolute path of diagnose_record; the other commands are beside it."""
    beside = os.path.join(os.path.dirname(os.path.abspath(sys.argv[0])), "diagnose_record")
    path = given or (beside if os.path.exists(beside) else shutil.which("diagnose_record"))
    if not path or not os.access(path, os.X_OK):
        raise errors.missing("%s: there is no such command; build the package, or give --diagnose-record"
                             % (path or "diagnose_record"))
    return os.path.abspath(path)


def _version(command):
    try:
        words = subprocess.run([command, "--version"], stdin=subprocess.DEVNULL, capture_output=True, timeout=60, text=True,
                               check=True).stdout.split()
        return words[-1]
    except (OSError, subprocess.SubprocessError, IndexError) as error:
        raise errors.internal("%s --version: %s" % (command, error)) from None


def _folder(path):
    try:
        os.makedirs(path, exist_ok=True)
    except OSError as error:
        raise errors.cannot_write(path, error.strerror) from None
    if not os.access(path, os.W_OK | os.X_OK):
        raise errors.cannot_write(path, "permission denied")


class Run:
    """One call of the command."""

    def __init__(self, options):
        self._options = options
        self._begin = time.time()
        command = _command(options.diagnose_record)
        self._commands = Commands(command, options.time_limit)
        self._version = _version(command)
        self._trend_command = os.path.join(os.path.dirname(command), "backlash_trend")
        rigs = rig_map.RigMap(options.rigs)
        found = records.find(options.source, options.out)
        _folder(options.out)
        self._state = State(options.out)
        if options.retry:
            self._state.forget_failures()
        self._scan(rigs, found)

    def _scan(self, rigs, found):
        progress = Progress("records found")
        looked = scan.Scan(self._state, rigs, self._version)
        looked.run(found, progress)
        progress.end()
        if looked.found == 0:
            raise errors.missing("%s: holds no record (%s)" % (self._options.source, " ".join(records.ENDINGS)))
        self._found = looked.found

    async def compute(self):
        """Diagnoses what waits, then writes the pages of single records."""
        waiting = self._state.count_waiting()
        wanted = reports.Reports(self._state, self._commands, self._version, self._options.out, self._options.reports)
        self._computed = waiting
        async with engine.Engine(self._options.scheduler, self._options.cores) as cluster:
            diagnosis, progress = Diagnosis(self._state, self._commands, self._version), Progress("records", waiting)
            await self._drive(cluster, diagnosis, progress)
            await self._drive(cluster, wanted, Progress("pages"))
        for path, reason in wanted.failed:
            sys.stderr.write("%s: no page of %s: %s\n" % (NAME, path, reason))

    @staticmethod
    async def _drive(cluster, part, progress):
        async def take(pairs):
            await part.take(pairs)
            progress(part.done)
        try:
            await cluster.run(part.source, take)
        finally:
            progress.end()

    def report(self):
        """Trends, page and JSON; returns the exit code."""
        names = self._state.joints()
        progress, asked = Progress("trends", len(names)), [0]

        def each():
            asked[0] += 1
            progress(asked[0])
        history.Trends(self._state, self._options.out, self._trend_command, self._options.horizon, self._version).run(names, each)
        progress.end()
        written = self._write_joints(names)
        written.sort(key=lambda item: joints.rank(item[0]))
        fleet = self._fleet([item[0] for item in written])
        self._write("fleet.json", json.dumps(fleet, indent=1) + "\n")
        self._write("fleet.html", fleet_page.page(fleet, {item[0]["joint"]: item[1] for item in written}))
        self._summarise(fleet)
        return fleet["exit_code"]

    def _write_joints(self, names):
        _folder(os.path.join(self._options.out, "joints"))
        written = []
        for name in names:
            summary, series, rows = joints.summary(self._state, name)
            self._write("joints/%s.html" % history.file_name(name), joint_page.page(summary, series, rows, self._report_of))
            written.append((summary, _thinned(series)))
        return written

    def _report_of(self, row):
        """Where the page of a record is, as seen from those of joints; None where there is none."""
        name = reports.file_name(row["key"]) if row["key"] else None
        return "../" + name if name and os.path.exists(os.path.join(self._options.out, name)) else None

    def _fleet(self, summaries):
        return {"schema_version": 1, "version": self._version, "command": "rosrun backlash_diagnosis " + shlex.join(
                    [NAME] + sys.argv[1:]), "written": history.date(time.time()), "seconds": time.time() - self._begin,
                "exit_code": joints.exit_code([joint["level"] for joint in summaries]), "horizon": self._options.horizon,
                "records": {"found": self._found, "computed": self._computed, "by_status": self._state.counts()},
                "levels": {level: sum(joint["level"] == level for joint in summaries) for level in joints.LEVELS},
                "joints": summaries,
                "without_joint": [{"record": row["name"], "reason": row["reason"]}
                                  for row in self._state.without_joint(WITHOUT_JOINT)]}

    def _write(self, name, text):
        plotting.save_text(text, os.path.join(self._options.out, name))

    def _summarise(self, fleet):
        by_status = ", ".join("%d %s" % (count, status.replace("_", " ")) for status, count in
                              sorted(fleet["records"]["by_status"].items()))
        levels = ", ".join("%d %s" % (count, level.replace("_", " ")) for level, count in fleet["levels"].items() if count)
        lines = ["%d records found, %d to compute; of all: %s" % (self._found, self._computed, by_status),
                 "%d joints: %s" % (len(fleet["joints"]), levels or "none")]
        lines += ["  %s: %s" % (joint["joint"], (joint["trend"] or {}).get("message") or joint["message"])
                  for joint in fleet["joints"] if joint["level"] in ("fault", "watch")]
        try:
            print("\n".join(lines + [os.path.join(self._options.out, "fleet.html")]), flush=True)
        except BrokenPipeError:  # read by `head`: all is written already
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())

    def close(self):
        self._state.close()


def _thinned(series, most=120):
    """For a small curve."""
    if not series or len(series["time"]) <= most:
        return series
    count = len(series["time"])
    chosen = sorted({round(i * (count - 1) / (most - 1)) for i in range(most)})
    return {key: [values[i] for i in chosen] for key, values in series.items()}


def main():
    if "--version" in sys.argv[1:]:
        print("%s (backlash_diagnosis) %s" % (NAME, _version(_command(None))))
        return errors.HEALTHY
    options = parser().parse_args()
    run = Run(options)
    try:
        engine.run(run.compute())
        return run.report()
    finally:
        run.close()


def entry():
    try:
        return main()
    except errors.FleetError as error:
        sys.stderr.write("%s: %s\n" % (NAME, error))
        return error.code
    except KeyboardInterrupt:
        sys.stderr.write("%s: %s\n" % (NAME, engine.Stopped()))
        return errors.INTERRUPTED
    except SystemExit:
        raise
    except Exception as error:  # noqa: BLE001 the commands of this package end so
        sys.stderr.write("%s: internal error: %s: %s\n" % (NAME, type(error).__name__, error))
        if os.environ.get("BACKLASH_DIAGNOSIS_TRACEBACK"):
            raise
        return errors.INTERNAL
