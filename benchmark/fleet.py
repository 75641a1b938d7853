#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""fleet_report beside a plain loop over the same records: throughput, their ratio, memory of client and scheduler.

The plain loop is xargs on as many cores, each record by diagnose_record with its JSON in a file. Records are simulated
(config/simulated_robot/shoulder.yaml, known play). Both begin with the files in the cache. Prints JSON in the form of
Google Benchmark.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

RIGS = Path(__file__).resolve().parents[1] / "config/simulated_robot"
MAP = 'schema_version: 1\nrecords:\n  - {match: "{joint}/{time}.csv", rig: %s}\n'
START = 1785736800  # s, the name of the first record


def simulate(options, folder):
    """Joints of 20 records each, a week between them."""
    def one(number):
        joint, week = divmod(number, 20)
        path = folder / ("joint_%04d" % joint) / ("%d.csv" % (START + 7 * 86400 * week))
        path.parent.mkdir(exist_ok=True)
        play = 3e-4 + 1e-7 * joint + 1e-5 * week * (joint % 3)
        subprocess.run([options.folder / "simulate", options.rig, "--duration", str(options.duration), "--backlash", repr(play),
                        "--seed", str(number), "--out", path], check=True, stdout=subprocess.DEVNULL)
    with ThreadPoolExecutor(options.cores) as pool:
        list(pool.map(one, range(options.records)))


def loop(options, records, out):
    out.mkdir()
    command = 'exec "$0" "$1" --rig "$2" --json "$3/$(basename "$(dirname "$1")")_$(basename "$1").json" >/dev/null'
    words = ["xargs", "-0", "-P", str(options.cores), "-I", "{}", "bash", "-c", command, options.folder / "diagnose_record", "{}",
             options.rig, out]
    paths = sorted(records.rglob("*.csv"))
    names = b"\0".join(os.fsencode(path) for path in paths[:: len(paths) // options.loop_records][: options.loop_records])
    start = time.monotonic()
    ended = subprocess.run(words, input=names)
    seconds = time.monotonic() - start
    written = len(list(out.iterdir()))
    if written != options.loop_records:
        raise RuntimeError("the loop wrote %d of %d answers (exit code %d)" % (written, options.loop_records, ended.returncode))
    return seconds


class Memory(threading.Thread):
    """Resident memory of a process, each second [MB]."""

    def __init__(self, process):
        super().__init__(daemon=True)
        self._process, self.seen = process, []

    def run(self):
        while self._process.poll() is None:
            try:
                status = Path("/proc/%d/status" % self._process.pid).read_text()
                self.seen.append(next(int(line.split()[1]) / 1024 for line in status.splitlines() if line.startswith("VmRSS")))
            except (OSError, StopIteration):
                return
            time.sleep(1)


def fleet(options, records, out):
    map_path = out.with_suffix(".yaml")
    map_path.write_text(MAP % options.rig)
    words = [sys.executable, options.folder / "fleet_report", records, "--rigs", map_path, "--out", out, "--cores",
             str(options.cores), "--reports", "0"]
    start = time.monotonic()
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL)
    memory = Memory(process)
    memory.start()
    process.wait()
    seconds = time.monotonic() - start
    result = json.loads((out / "fleet.json").read_text())
    if result["records"]["by_status"] != {"done": options.records}:
        raise RuntimeError(result["records"])
    return seconds, memory.seen


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the package's executables are")
    parser.add_argument("--records", type=int, default=400)
    parser.add_argument("--loop-records", type=int, help="of them, spread evenly, for the plain loop; default: all")
    parser.add_argument("--duration", type=float, default=10, help="of each [s]")
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--rig", type=Path, default=RIGS / "shoulder.yaml")
    parser.add_argument("--repeat", type=int, default=1, help="loop and fleet by turns")
    options = parser.parse_args()
    options.loop_records = options.loop_records or options.records
    results = []
    with tempfile.TemporaryDirectory() as temporary:
        records = Path(temporary) / "records"
        records.mkdir()
        simulate(options, records)
        for turn in range(options.repeat):
            plain = loop(options, records, Path(temporary) / ("loop_%d" % turn))
            seconds, memory = fleet(options, records, Path(temporary) / ("fleet_%d" % turn))
            late = memory[len(memory) // 4:] or [0]
            found = [{"name": "fleet/report", "real_time": seconds, "time_unit": "s", "records_per_s": options.records / seconds,
                      "memory_mb": max(memory, default=0), "memory_after_a_quarter_mb": late[0],
                      "memory_at_the_end_mb": late[-1]},
                     {"name": "fleet/xargs", "real_time": plain, "time_unit": "s", "records_per_s": options.loop_records / plain}]
            print(found, file=sys.stderr)
            results += found
    print(json.dumps({"benchmarks": results}))


if __name__ == "__main__":
    main()
