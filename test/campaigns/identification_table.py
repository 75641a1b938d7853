#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs identify on machines that lack nothing or something and counts the values that are off and sure of it.

The machines of confusion_table.py (another simulator, values up to 40 % off the rig file, effects that nobody declares),
servos and joints with one encoder, their first motion. A value is off where it differs from the truth by more than three
of its standard errors and 5 %. Prints those, and how many there are of each parameter. With --build the machines are
servos of another build, and declared as that.
Exit code: 0, 64 usage, 66 executable missing.
"""
import collections
import concurrent.futures
import json
import subprocess
import sys

import builds
import confusion_table
import table_arguments

ERRORS, SHARE = 3, 0.05
JOINT = confusion_table.REPOSITORY / confusion_table.RIGS["joint"]


def identify(case, args):
    """(parameter, fitted, standard error, true) of all that the truth has, or nothing where identify refuses."""
    folder = args.folder / case.name
    confusion_table.make(case, folder, args.make)
    result = folder / "identification.json"
    result.unlink(missing_ok=True)
    rig = JOINT if case.group == "joint" else args.rig
    subprocess.run([args.identify, str(folder / "train.csv"), "--rig", str(rig), "--json", str(result), "--out",
                    str(folder / "identified.yaml")],
                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    if not result.is_file():
        return []
    truth = json.loads((folder / "truth.json").read_text())
    if case.group == "joint":
        true = {name: truth["joint"][name] for name in ("inertia", "viscous", "coulomb")}
    else:
        true = {name: value["value"] for name, value in truth["rig"].items()}
    fitted = json.loads(result.read_text())["parameters"]
    return [(name, fitted[name]["value"], fitted[name]["standard_error"] or 0, true[name])
            for name in fitted if name in true]


def is_off(value, error, true):
    return abs(value - true) > max(ERRORS * error, SHARE * abs(true))


def read_arguments():
    parser = table_arguments.parser_of(__doc__.split("\n", maxsplit=1)[0], "identify")
    parser.add_argument("--group", choices=confusion_table.GROUPS, nargs="+", default=confusion_table.GROUPS,
                        help="these machines only")
    return table_arguments.arguments_of(parser, "identify")


def main():
    args = read_arguments()
    # As confusion_table.py counts, so that the same machines are looked at.
    cases = builds.of_build(builds.BUILDS[args.build], confusion_table.suite(args.seed))[::args.every]
    cases = [c for c in cases if c.group in args.group]
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
