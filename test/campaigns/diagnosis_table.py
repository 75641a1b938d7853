#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs diagnose_record on machines that it has never seen and counts the intervals that miss the play.

The servos of confusion_table.py (another simulator, values up to 40 % off the rig file, effects that nobody declares,
half with 20 % torque noise), both of their motions. Prints each miss, and per estimator and for the verdict how many
answer, miss, and are wrong and sure: outside by twice the interval's width, or by a fifth of the play. With
--motor-alone the records have no load encoder, as on most robots; with --build the servos are of another build, and
declared as that.
Exit code: 0, 64 usage, 66 executable missing.
"""
import collections
import concurrent.futures
import csv
import json
import math
import subprocess
import sys

import builds
import confusion_table
import table_arguments

MOTIONS = ("train", "test")
MOTOR = ("time", "motor_torque", "motor_position")
VERDICT = "verdict"


def plays(truth, duration):
    """The least and the largest play that the machine had during the record."""
    gap = truth["rig"]["backlash_angle"]["value"]
    effects = truth["undeclared_effects"]
    low = high = gap
    if "two_gaps" in effects:
        low = high = gap + effects["two_gaps"]["A"]
    if "thermal_growth" in effects:
        grown = effects["thermal_growth"]["A"] * (1 - math.exp(-duration / effects["thermal_growth"]["s"]))
        low, high = sorted((gap, gap * (1 + grown)))
    for name in ("local_fault", "damaged_tooth"):
        high += max(0, effects.get(name, {}).get("A", 0))
    waves = sum(abs(v) for k, v in effects.get("varying_backlash", {}).items() if k[0] == "a" and k[1:].isdigit())
    return low * (1 - waves), high * (1 + waves)


def answers(report):
    """(who, value, lower, upper) of whoever gives an interval."""
    for estimate in report["estimates"]:
        if estimate["backlash_angle"] is not None and estimate["interval_angle"]:
            yield (estimate["method"], estimate["backlash_angle"], *estimate["interval_angle"])
    verdict = report["verdict"]
    if verdict["backlash_angle"] is not None and verdict["angle_interval"]:
        yield (VERDICT, verdict["backlash_angle"], *verdict["angle_interval"])


def judge(value, lower, upper, low, high):
    """"holds", "misses" or "sure"."""
    away = max(low - upper, lower - high)
    if away <= 0:
        return "holds"
    far = min(abs(value - low), abs(value - high))
    return "sure" if away > 2 * (upper - lower) or far > 0.2 * high else "misses"


def motor_alone(path):
    """The record without the load encoder, in a file beside it."""
    motor = path.with_name(f"{path.stem}_motor.csv")
    if not motor.is_file() or motor.stat().st_mtime < path.stat().st_mtime:
        with open(path, newline="", encoding="utf-8") as whole, open(motor, "w", newline="", encoding="utf-8") as part:
            writer = csv.DictWriter(part, MOTOR, extrasaction="ignore", lineterminator="\n")
            writer.writeheader()
            writer.writerows(csv.DictReader(whole))
    return motor


def diagnose(case, motion, args):
    folder = args.folder / case.name
    record = folder / f"{motion}.csv"
    if args.motor_alone:
        record = motor_alone(record)
    report = folder / f"diagnosis_{record.stem}.json"
    subprocess.run([args.diagnose, str(record), "--rig", args.rig, "--json", str(report)],
                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    truth = json.loads((folder / "truth.json").read_text())
    play = plays(truth, truth["made_with"]["duration"])
    return [(case.name, motion, play, answer, judge(*answer[1:], *play))
            for answer in answers(json.loads(report.read_text()))]


def read_arguments():
    parser = table_arguments.parser_of(__doc__.split("\n", maxsplit=1)[0], "diagnose_record")
    parser.add_argument("--only", default="", metavar="PATTERN", help="machines whose name contains it")
    parser.add_argument("--motor-alone", action="store_true", help="without the load encoder")
    return table_arguments.arguments_of(parser, "diagnose_record")


def main():
    args = read_arguments()
    cases = [c for c in confusion_table.suite(args.seed) if c.group != "joint" and args.only in c.name]
    cases = builds.of_build(builds.BUILDS[args.build], cases)[::args.every]
    counts = collections.defaultdict(collections.Counter)
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        list(pool.map(lambda case: confusion_table.make(case, args.folder / case.name, args.make), cases))
        jobs = [pool.submit(diagnose, case, motion, args) for case in cases for motion in MOTIONS]
        for job in jobs:
            for name, motion, (low, high), (who, value, lower, upper), result in job.result():
                counts[who][result] += 1
                if result != "holds":
                    print(f"{result:<7}{name} {motion}: {who} {value:.4g} ({lower:.4g} to {upper:.4g}) rad, "
                          f"true {low:.4g}" + (f" to {high:.4g}" if high > low else ""), flush=True)
    print(f"\n{len(cases)} machines, {len(MOTIONS) * len(cases)} records")
    print(f"{'':<22}{'answered':>9}{'miss':>6}{'sure':>6}  hold")
    for who, c in sorted(counts.items()):
        total = sum(c.values())
        print(f"{who:<22}{total:>9}{c['misses'] + c['sure']:>6}{c['sure']:>6}  {100 * c['holds'] / total:.1f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main())
