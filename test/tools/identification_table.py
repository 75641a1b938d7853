#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs identify on machines that lack nothing or something and counts the values that are off and sure of it.

The servos of confusion_table.py (another simulator, values up to 40 % off the rig file, effects that nobody declares),
their first motion. A value is off where it differs from the truth by more than three of its standard errors and 5 %.
Prints those, and how many there are of each parameter. With --build the servos are of another build, and declared as that.
Exit code: 0, 64 usage, 66 executable missing.
"""
import argparse
import collections
import concurrent.futures
import json
import secrets
import subprocess
import sys
from pathlib import Path

import builds
import confusion_table

ERRORS, SHARE = 3, 0.05


def identify(case, args):
    """(parameter, fitted, standard error, true) of all that the truth has, or nothing where identify refuses."""
    folder = args.folder / case.name
    confusion_table.make(case, folder, args.make)
    result = folder / "identification.json"
    result.unlink(missing_ok=True)
    subprocess.run([args.identify, str(folder / "train.csv"), "--rig", args.rig, "--json", str(result),
                    "--out", str(folder / "identified.yaml")],
                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    if not result.is_file():
        return []
    truth = json.loads((folder / "truth.json").read_text())["rig"]
    fitted = json.loads(result.read_text())["parameters"]
    return [(name, fitted[name]["value"], fitted[name]["standard_error"] or 0, truth[name]["value"])
            for name in fitted if name in truth]


def is_off(value, error, true):
    return abs(value - true) > max(ERRORS * error, SHARE * abs(true))


def read_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--identify", help="path of identify (default: PATH, then the workspace)")
    parser.add_argument("--make", help="path of make_machine (default: PATH, then the workspace)")
    parser.add_argument("--seed", type=int, help="of the first machine (default: drawn, and printed)")
    parser.add_argument("--build", choices=builds.BUILDS, default="servo", help="of the servos (default: %(default)s)")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="each N-th machine only")
    parser.add_argument("--jobs", type=int, default=2, help="at the same time (default: %(default)s)")
    parser.add_argument("--keep", metavar="DIR", required=True, help="work here, machines that are there are kept")
    args = parser.parse_args()
    if args.seed is None:
        args.seed = secrets.randbelow(2**31)
        print(f"--seed {args.seed}", flush=True)
    for name, tool in (("identify", "identify"), ("make", "make_machine")):
        path = confusion_table.find(tool, getattr(args, name))
        if path is None:
            print(f"identification_table: --{name}: executable not found", file=sys.stderr)
            sys.exit(66)
        setattr(args, name, path)
    args.folder = Path(args.keep).resolve()
    args.folder.mkdir(parents=True, exist_ok=True)
    servo = confusion_table.REPOSITORY / confusion_table.RIGS["servo"]
    args.rig = builds.declared(builds.BUILDS[args.build], servo, args.folder)
    return args


def main():
    args = read_arguments()
    # As confusion_table.py counts, joints among them, so that the same machines are looked at.
    cases = builds.of_build(builds.BUILDS[args.build], confusion_table.suite(args.seed))[::args.every]
    cases = [c for c in cases if c.group != "joint"]
    total, off = collections.Counter(), collections.Counter()
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        for case, values in zip(cases, pool.map(lambda case: identify(case, args), cases)):
            for name, value, error, true in values:
                total[name] += 1
                if is_off(value, error, true):
                    off[name] += 1
                    print(f"{case.name}: {name} {value:.4g} +- {error:.2g}, true {true:.4g}", flush=True)
    print(f"\n{len(cases)} machines, {sum(total.values())} values, {sum(off.values())} off and sure of it")
    for name in total:
        print(f"{name:<18}{off[name]:>4} of {total[name]}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
