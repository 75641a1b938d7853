#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs identify on servos of the generator that shares no code with the package, and counts how often its 95 % intervals
hold. What is there already in the folder is not made again.
"""
import argparse
import json
import statistics
import subprocess
from pathlib import Path

REACH = 1.96  # standard errors, 95 % of a normal distribution


def z_values(args, seed):
    folder = args.folder / str(seed)
    if not (folder / "truth.json").is_file():
        subprocess.run([args.make, "--seed", str(seed), "--out", str(folder)], check=True)
    if not (folder / args.name).is_file():
        subprocess.run([args.identify, str(folder / "train.csv"), "--rig", args.rig, "--out", str(folder / "fitted.yaml"),
                        "--json", str(folder / args.name)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    truth = json.loads((folder / "truth.json").read_text())["rig"]
    found = json.loads((folder / args.name).read_text())["parameters"]
    return {name: ((p["value"] - truth[name]["value"]) / p["standard_error"], p["standard_error"] / truth[name]["value"])
            for name, p in found.items() if name in truth}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--make", required=True, help="make_machine")
    parser.add_argument("--identify", required=True)
    parser.add_argument("--rig", required=True)
    parser.add_argument("--machines", type=int, default=200)
    parser.add_argument("--seed", type=int, default=20001, help="of the first; default %(default)s")
    parser.add_argument("--name", default="identify.json", help="of the answer in each folder")
    args = parser.parse_args()
    every = {}
    for seed in range(args.seed, args.seed + args.machines):
        for name, z in z_values(args, seed).items():
            every.setdefault(name, []).append(z)
    print(f"{'parameter':<16} machines  held    median z  median |z|  largest  se/value")
    for name, values in every.items():
        z = [v[0] for v in values]
        held = sum(abs(x) < REACH for x in z) / len(z)
        print(f"{name:<16} {len(z):8d}  {100 * held:5.1f} % {statistics.median(z):8.2f} "
              f"{statistics.median(map(abs, z)):11.2f} {max(map(abs, z)):8.1f}  {statistics.median(v[1] for v in values):.2g}")


if __name__ == "__main__":
    main()
