#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs diagnose_record on machines that make_robot_joint or make_torque_rig draws, and counts answers and misses.

Each joint is recorded in two motions, with the load's encoder and with the motor's alone. A record shows the play where
each flank is pressed for a tenth of the time and the gap is crossed ten times, by a loop that is stable; the others are counted apart.
Each rig is recorded under three torques, with motor_position and without. With
--before the answers are compared with those that an earlier run has written: newly answered, lost, newly outside.
Exit code: 0, 64 usage, 66 executable missing.
"""
import argparse
import collections
import concurrent.futures
import csv
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

MOTOR = ("time", "motor_torque", "motor_position")  # of a joint, where it has no other encoder
TORQUES = ("time", "motor_torque", "sensor_torque")  # of a rig, where it has no encoder
SHOWN_SHARE, SHOWN_CROSSINGS = 0.1, 10  # what a record that shows the play has at least
HAMMERS = 1000  # crossings, of a loop that is not stable: no robot is left so


def one_channel_less(path):
    part = path.with_name(f"{path.stem}_motor.csv")
    if not part.is_file():
        with open(path, newline="", encoding="utf-8") as whole, open(part, "w", newline="", encoding="utf-8") as fewer:
            rows = csv.DictReader(whole)
            writer = csv.DictWriter(fewer, TORQUES if "sensor_torque" in rows.fieldnames else MOTOR, extrasaction="ignore",
                                    lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    return part


def run_command(command):
    """What it writes to standard error, and the seconds of processor that it takes."""
    with tempfile.TemporaryFile() as errors:
        with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=errors) as process:
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        errors.seek(0)
        return errors.read().decode(), usage.ru_utime + usage.ru_stime


def diagnose(folder, motion, alone, args):
    """One line of the table: what is true, what was answered."""
    truth = json.loads((folder / "truth.json").read_text())
    shown = truth["motions"][motion]
    record = one_channel_less(folder / f"{motion}.csv") if alone else folder / f"{motion}.csv"
    report = folder / f"{record.stem}.json"
    report.unlink(missing_ok=True)
    rig = folder / "rig_motor_alone.yaml"
    errors, took = run_command([args.diagnose, str(record), "--rig", str(rig if alone and rig.is_file() else folder / "rig.yaml"),
                                "--json", str(report)] + (["--method", args.method] if args.method else []))
    line = {"name": f"{folder.name}/{record.stem}", "alone": alone, "true": truth["backlash_angle"], "took": took,
            "shows": "crossings" not in shown or (min(shown["press_pos"], shown["press_neg"]) > SHOWN_SHARE
                                                  and SHOWN_CROSSINGS <= shown["crossings"] < HAMMERS),
            "answers": {}, "reasons": {}}
    if not report.is_file():
        line["reasons"]["verdict"] = errors.strip()
        return line
    answer = json.loads(report.read_text())
    for estimate in answer["estimates"]:
        if estimate["backlash_angle"] is not None and estimate["interval_angle"]:
            line["answers"][estimate["method"]] = [estimate["backlash_angle"], *estimate["interval_angle"]]
        else:
            line["reasons"][estimate["method"]] = estimate["message"]
    verdict = answer["verdict"]
    if verdict["backlash_angle"] is not None and verdict["angle_interval"]:
        line["answers"]["verdict"] = [verdict["backlash_angle"], *verdict["angle_interval"]]
    return line


def judge(line, who="verdict"):
    """"", "holds", "misses" or "sure" (outside by more than twice the interval's width)."""
    if who not in line["answers"]:
        return ""
    _, low, high = line["answers"][who]
    away = max(line["true"] - high, low - line["true"])
    return "holds" if away <= 0 else "sure" if away > 2 * (high - low) else "misses"


def show(lines, who):
    judged = [judge(line, who) for line in lines]
    counts = collections.Counter(judged)
    answered = len(lines) - counts[""]
    widths = [(line["answers"][who][2] - line["answers"][who][1]) / 2 / line["true"] for line in lines if who in line["answers"]]
    print(f"  {who:<20}{answered:>4} of {len(lines):<4} hold {counts['holds']:<4} sure {counts['sure']:<3} "
          f"median half width {100 * statistics.median(widths) if widths else float('nan'):.0f} %")


def compare(before, lines):
    old = {line["name"]: line for line in before}
    for line in lines:
        if line["name"] not in old:
            continue
        was, now = judge(old[line["name"]]), judge(line)
        if was != now:
            print(f"  {line['name']}: {was or 'no answer'} -> {now or 'no answer'}")


def read_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--diagnose", required=True, metavar="EXECUTABLE")
    parser.add_argument("--make", required=True, metavar="EXECUTABLE", help="make_robot_joint or make_torque_rig")
    parser.add_argument("--make-option", dest="make_options", action="append", default=[], metavar="OPTION", help="of --make")
    parser.add_argument("--method", metavar="NAME", help="this estimator alone")
    parser.add_argument("--keep", required=True, type=pathlib.Path, metavar="FOLDER", help="for records and answers")
    parser.add_argument("--seeds", default="1-20", metavar="FIRST-LAST")
    parser.add_argument("--folders", nargs="*", type=pathlib.Path, help="joints that are there, in place of drawn ones")
    parser.add_argument("--channels", choices=("both", "motor", "all"), default="all")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--before", type=pathlib.Path, metavar="JSON", help="answers of an earlier run")
    parser.add_argument("--json", type=pathlib.Path, help="where the answers are written")
    args = parser.parse_args()
    for executable in (args.diagnose, args.make):
        if not pathlib.Path(executable).is_file():
            print(f"{parser.prog}: {executable} is missing: build it first", file=sys.stderr)
            sys.exit(66)
    return args


def make(args):
    first, last = (int(x) for x in args.seeds.split("-"))
    folders = [args.keep / str(seed) for seed in range(first, last + 1)]
    for folder in folders:
        if not (folder / "truth.json").is_file():
            subprocess.run([args.make, "--seed", folder.name, "--out", str(folder)] + args.make_options, check=True)
    return folders


def main():
    args = read_arguments()
    folders = args.folders or make(args)
    kinds = {"both": (False,), "motor": (True,), "all": (False, True)}[args.channels]
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        jobs = [pool.submit(diagnose, folder, motion, alone, args)
                for folder in folders for motion in json.loads((folder / "truth.json").read_text())["motions"] for alone in kinds]
        lines = [job.result() for job in jobs]
    for line in lines:
        result = judge(line)
        answer = "{:.4g} [{:.4g}, {:.4g}]".format(*line["answers"]["verdict"]) if result else ""
        print(f"{line['name']:<24}{'' if line['shows'] else 'hidden ':<8}true {line['true']:.4g}  {result or 'no answer':<10}{answer}  {line['took']:.1f} s")
    for alone in kinds:
        for shows in (True, False):
            some = [line for line in lines if line["alone"] == alone and line["shows"] == shows]
            if some:
                print(f"{'one channel less' if alone else 'all channels'}, {'play shown' if shows else 'play not shown'}:")
                for who in sorted({who for line in some for who in line["answers"]}):
                    show(some, who)
    print(f"processor of a command: median {statistics.median(line['took'] for line in lines):.1f} s")
    if args.before:
        compare(json.loads(args.before.read_text()), lines)
    if args.json:
        args.json.write_text(json.dumps(lines, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
