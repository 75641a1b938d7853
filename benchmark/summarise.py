#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Puts results of Google Benchmark together, prints each figure as a ratio to its peer, and compares with an older run."""
import argparse
import json
import math
import sys

UNITS = {"ns": 1e-6, "us": 1e-3, "ms": 1.0, "s": 1e3}  # in ms
ERRORS = (1e-4, 1e-6, 1e-8)
TOLERANCES = {"one_rig": "boost_dopri5", "32_rigs": "boost_dopri5"}  # work against precision, with their peers
PAIRS = [  # figure, peer, which result, larger is better
    ("statistics/period_analyser", "statistics/boost", "ns_per_sample", False),
    ("statistics/sample_stream", "statistics/boost", "ns_per_sample", False),
    ("curve/build_curve", "curve/boost_dopri5", "real_time", False),
    ("bags/read", "bags/bare_view", "messages_per_s", True),
    ("bags/read_and_diagnose", "bags/bare_view", "messages_per_s", True),
    ("bags/read_and_diagnose_waveform", "bags/bare_view", "messages_per_s", True),
    ("nodes/diagnoser/flood", "nodes/bare/flood", "messages_per_s", True),
    ("nodes/diagnoser/1000_Hz", "nodes/bare/1000_Hz", "us_per_message", False),
    ("nodes/diagnoser/20000_Hz", "nodes/bare/20000_Hz", "us_per_message", False),
    ("nodes/diagnoser/64_joints", "nodes/diagnoser/1_joints", "us_per_joint_sample", False),
    ("fleet/report", "fleet/xargs", "records_per_s", True),
]


def milliseconds(result, key="cpu_time"):
    return result[key] * UNITS[result["time_unit"]]


def base_name(name):
    """Without what Google Benchmark adds to it."""
    return "/".join(part for part in name.split("/") if part not in ("process_time", "real_time"))


def cost_at(points, error):
    """CPU ms at an error, interpolated between the tightest tolerance that misses it and the next; None: never there."""
    better = None
    for found, cost in sorted(points):
        if found > error:
            if better is None:
                return None
            share = math.log(found / error) / math.log(found / better[0])
            return cost * (better[1] / cost) ** share
        better = (found, cost)
    return better[1] if better else None


def work_precision(results, group, figures):
    methods = {}
    for name, result in results.items():
        parts = name.split("/")
        if parts[0] == group:
            methods.setdefault(parts[1], []).append((result["error"], milliseconds(result)))
    peer = TOLERANCES[group]
    if peer not in methods:
        return
    print(f"\n{group}: CPU ms at a relative error of the sensor torque, and times the peer {peer}")
    print("  " + "".ljust(18) + "".join(f"{error:>18.0e}" for error in ERRORS))
    for method, points in sorted(methods.items()):
        line = "  " + method.ljust(18)
        for error in ERRORS:
            cost, peers = cost_at(points, error), cost_at(methods[peer], error)
            if cost is None or peers is None:
                line += "-".rjust(18)
                continue
            line += f"{cost:10.2f} ({cost / peers:5.2f})".rjust(18)
            figures[f"{group}/{method} at {error:.0e}"] = cost / peers
        print(line)


def pairs(results, figures):
    print("\nfigure, and times the peer")
    for name, peer, key, larger in PAIRS:
        if any(each not in results or not results[each].get("handled", True) for each in (name, peer)):
            continue
        values = []
        for each in (name, peer):
            result = results[each]
            value = milliseconds(result, key) if key.endswith("time") else result[key]
            values.append(value)
        unit = {"real_time": "ms", "ns_per_sample": "ns/sample", "messages_per_s": "messages/s", "records_per_s": "records/s",
                "us_per_message": "us/message", "us_per_joint_sample": "us/joint"}[key]
        figures[name] = values[0] / values[1]
        print(f"  {name:30} {values[0]:12.4g} {unit:12} {values[0] / values[1]:7.2f} x {peer} ({values[1]:.4g})"
              f"{', more is better' if larger else ''}")


def show(results):
    """What has no peer, or more to say than a ratio."""
    print("\nnodes")
    for name, result in results.items():
        if not name.startswith("nodes/"):
            continue
        values = {key: value for key, value in result.items() if key not in ("name", "time_unit")}
        print("  " + name.ljust(34) + "  ".join(
            f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}" for key, value in values.items()))
    print("\nrecords: s, s per minute of record, MB")
    for name, result in results.items():
        if name.startswith("records/"):
            print(f"  {name:32} {result['real_time']:8.1f} {60 * result['real_time'] / result['length_s']:8.1f} "
                  f"{result['memory_mb']:8.0f}  {', '.join(result.get('effects', []))}")


def compare(figures, path):
    with open(path, encoding="utf-8") as file:
        older = json.load(file)["ratios"]
    print(f"\nratios against {path}")
    for name, now in figures.items():
        if name in older:
            print(f"  {name:40} {older[name]:8.3f} -> {now:8.3f}  ({100 * (now / older[name] - 1):+.0f} %)")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", nargs="+", help="JSON of Google Benchmark")
    parser.add_argument("--out", required=True, help="all results and ratios, as JSON")
    parser.add_argument("--older", help="JSON of an earlier run")
    options = parser.parse_args()
    results, context = {}, {}
    for path in options.results:
        with open(path, encoding="utf-8") as file:
            content = json.load(file)
        context = context or content.get("context", {})
        for result in content["benchmarks"]:
            results[base_name(result["name"])] = result
    figures = {}
    for group in TOLERANCES:
        work_precision(results, group, figures)
    pairs(results, figures)
    show(results)
    if options.older:
        compare(figures, options.older)
    machine = {key: context[key] for key in ("date", "num_cpus", "mhz_per_cpu", "library_build_type") if key in context}
    with open(options.out, "w", encoding="utf-8") as file:
        json.dump({"machine": machine, "ratios": figures, "results": list(results.values())}, file, indent=1)
    print(f"\nwritten: {options.out}")


if __name__ == "__main__":
    sys.exit(main())
