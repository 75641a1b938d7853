#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""identify and trace_residual on longer and longer records: time, memory, and how both grow with the length.

A machine of the test generator (its own integrator, seeded) with two undeclared effects, gravity and cogging, 1 kHz, two
encoders. Prints JSON in the form of Google Benchmark.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SEED, EFFECTS = 24, "gravity,cogging"
LENGTHS = (30, 60, 120, 240)  # s
RIG = Path(__file__).resolve().parents[1] / "config/two_inertia_servo.yaml"


def run(name, length, *command):
    start = time.monotonic()
    process = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(f"{command[0]} ended with {os.waitstatus_to_exitcode(status)}")
    seconds = time.monotonic() - start
    result = {"name": f"records/{name}/{length}_s", "length_s": length, "real_time": seconds, "time_unit": "s",
              "cpu_time": usage.ru_utime + usage.ru_stime, "memory_mb": usage.ru_maxrss / 1024}
    print(result, file=sys.stderr)
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the package's executables are")
    parser.add_argument("--lengths", type=int, nargs="+", default=LENGTHS, help="of the training record [s]")
    options = parser.parse_args()
    results = []
    with tempfile.TemporaryDirectory() as temporary:
        for length in options.lengths:
            folder = Path(temporary) / str(length)
            subprocess.run([options.folder / "make_machine", "--seed", str(SEED), "--effects", EFFECTS, "--duration",
                            str(length), "--out", folder], check=True, stdout=subprocess.DEVNULL)
            results.append(run("identify", length, options.folder / "identify", folder / "train.csv", "--rig", RIG,
                               "--out", folder / "fitted.yaml", "--json", folder / "fit.json"))
            results.append(run("trace_residual", length, options.folder / "trace_residual", "--rig", RIG, "--train",
                               folder / "train.csv", "--test", folder / "test.csv", "--out", folder / "report"))
            with open(folder / "report/report.json", encoding="utf-8") as report:
                results[-1]["effects"] = [step["effect"] for step in json.load(report)["steps"]]
    print(json.dumps({"benchmarks": results}))


if __name__ == "__main__":
    main()
