#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs trace_residual on machines that it has never seen and says how often it names what they lack.

Makes a seeded suite of machines with make_machine (servos with one, two, three or no undeclared effects, and effects
that no dictionary holds, clean and with 20 % torque noise; joints with one encoder in a position loop; joints of a
robot's size with two), runs trace_residual on each and compares what it adds with the
truth. Prints a line per machine, the confusion table and the totals against the goals, and writes all as JSON.
Exit code: 0 where every goal is met, 1 where not, 64 usage, 66 executable missing.
"""
import argparse
import collections
import concurrent.futures
import json
import os
import secrets
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import builds

PACKAGE = "backlash_diagnosis"
REPOSITORY = Path(__file__).resolve().parents[2]
NOTHING = "(nothing)"
UNEXPLAINED = "(unexplained)"
LEARNED = "learned_map"
RESULT_CODES = (0, 1, 2, 3)  # trace_residual came to an answer

# Goals. Errors are compared to half a percent: figures are given to three digits.
EXACT_GOAL = 0.95
REDUCTION_GOAL = 0.3
SAME_ERROR = 1.005
AT_FLOOR = 1.1

NAMED = ["asymmetric_coulomb", "asymmetric_viscous", "stribeck", "quadratic_drag", "square_root_friction",
         "load_dependent_friction", "position_dependent_friction", "friction_drift", "gravity", "cogging",
         "transmission_error", "varying_backlash", "mesh_hardening", "varying_reduction_ratio", "encoder_scale",
         "delay", "presliding", "local_fault"]
OUTSIDE = ["torque_saturation", "slipping_coupling", "damaged_tooth", "thermal_growth", "speed_ripple", "creep",
           "two_gaps"]
PAIRS = ["gravity,cogging", "varying_backlash,stribeck", "transmission_error,load_dependent_friction",
         "friction_drift,varying_backlash", "delay,gravity", "quadratic_drag,encoder_scale",
         "position_dependent_friction,transmission_error", "cogging,mesh_hardening"]
TRIPLES = ["gravity,cogging,varying_backlash", "stribeck,friction_drift,transmission_error",
           "asymmetric_coulomb,transmission_error,varying_backlash"]

LUGRE, HERTZ = ["--friction", "lugre"], ["--contact", "hertz"]
COARSE, STILL, SHORT = ["--encoder-bits", "18"], ["--no-dither"], ["--duration", "10"]
NOISY = ["--noise-share", "0.2"]

JOINTS = ["none"] * 4 + ["gravity,load_dependent_friction"] * 6 + [
    "load_dependent_friction", "load_dependent_friction", "gravity", "gravity", "stribeck", "stribeck", "gravity,stribeck",
    "quadratic_drag", "gravity,quadratic_drag", "asymmetric_viscous", "gravity,asymmetric_viscous",
    "position_dependent_friction", "gravity,position_dependent_friction", "friction_drift", "gravity,friction_drift",
    "cogging", "cogging", "gravity,cogging", "gravity,cogging", "stribeck,load_dependent_friction",
    "gravity,stribeck,load_dependent_friction", "gravity,cogging,friction_drift",
    "outside_torque", "gravity,outside_torque", "wandering_torque", "gravity,wandering_torque", "friction_swing",
    "gravity,friction_swing", "payload_step", "gravity,payload_step"]
RIGS = {"servo": "config/two_inertia_servo.yaml", "joint": "config/ur10e_joint.yaml"}
# Joints of a robot's size with two encoders, recorded as by ROS, by make_robot_joint; with linear teeth and
# Coulomb friction, with teeth and friction of all kinds, and both with masses and shafts between their ends.
ROBOTS = ["none", "cogging", "stribeck", "load_dependent_friction", "position_dependent_friction", "transmission_error",
          "varying_backlash", "gravity", "asymmetric_coulomb"]
GROUPS = ("clean", "noisy", "joint", "robot")

Case = collections.namedtuple("Case", "name effects options group")


def suite(first_seed):
    """The cases; every one has a seed of its own."""
    cases = []

    def add(effects, options, group):
        seed = first_seed + len(cases)
        how = "_".join(o.lstrip("-").replace("-", "_") for o in options if o not in ("--friction", "--contact"))
        name = "_".join(filter(None, [f"{len(cases):03d}", group, effects.replace(",", "+"), how]))
        more = {"clean": [], "noisy": NOISY, "joint": ["--machine", "joint"]}[group]
        cases.append(Case(name, effects, ["--seed", str(seed), "--effects", effects] + options + more, group))

    for options in ([], [], LUGRE, HERTZ, COARSE, STILL, SHORT):
        add("none", options, "clean")
    for effects in NAMED + PAIRS + TRIPLES + OUTSIDE:
        add(effects, [], "clean")
    for options in ([], LUGRE, HERTZ, COARSE, SHORT):
        add("none", options, "noisy")
    variants = ([], SHORT, LUGRE, SHORT + LUGRE)
    for i, effects in enumerate(NAMED + PAIRS[:4] + TRIPLES[:2] + OUTSIDE):
        add(effects, variants[i % len(variants)], "noisy")
    for effects, options in (("gravity", HERTZ), ("cogging", COARSE), ("varying_backlash", COARSE),
                             ("stribeck", STILL), ("transmission_error", HERTZ), ("torque_saturation", LUGRE)):
        add(effects, options, "clean")
    for effects in JOINTS:
        add(effects, [], "joint")
    for teeth, more in (("", []), ("_own_teeth", ["--own-teeth"]), ("_masses", ["--masses"]),
                        ("_own_teeth_masses", ["--own-teeth", "--masses"])):
        for effect in ROBOTS:
            seed = first_seed + len(cases)
            cases.append(Case(f"{len(cases):03d}_robot_{effect}{teeth}", effect,
                              ["--seed", str(seed), "--effect", effect, "--duration", "18"] + more, "robot"))
    return cases


def quick(cases):
    """A dozen across the suite."""
    return cases[::max(1, len(cases) // 12)][:12]


def find(name, given):
    """The path of an executable: as given, from PATH, or from the workspace that is set up."""
    if given:
        return str(Path(given).resolve()) if Path(given).is_file() else None
    folders = [Path(p) / "lib" / PACKAGE for p in os.environ.get("CMAKE_PREFIX_PATH", "").split(":") if p]
    return shutil.which(name) or next((str(f / name) for f in folders if (f / name).is_file()), None)


def make(case, folder, maker):
    """Makes the machine unless it is there already."""
    arguments = " ".join(case.options)
    stamp = folder / "arguments.txt"
    if stamp.is_file() and stamp.read_text() == arguments:
        return
    shutil.rmtree(folder, ignore_errors=True)
    subprocess.run([maker] + case.options + ["--out", str(folder)], check=True)
    stamp.write_text(arguments)


def trace(folder, tracer, rig, timeout):
    """Runs trace_residual unless its report is there already; exit code and seconds."""
    done = folder / "run.json"
    if done.is_file():
        return json.loads(done.read_text())
    train, test = ("m0.csv", "m1.csv") if (folder / "m0.csv").is_file() else ("train.csv", "test.csv")
    command = [tracer, "--rig", rig, "--train", str(folder / train), "--test", str(folder / test),
               "--out", str(folder / "report")]
    started = time.monotonic()
    try:
        with open(folder / "log.txt", "w", encoding="utf-8") as log:
            code = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, timeout=timeout,
                                  check=False).returncode
    except subprocess.TimeoutExpired:
        code = None
    outcome = {"code": code, "seconds": round(time.monotonic() - started, 1)}
    if code in RESULT_CODES:
        done.write_text(json.dumps(outcome))
    return outcome


def without_equivalents(true, found, truth):
    """What was found, with names that cannot be distinguished from the true ones replaced by these."""
    found = set(found)
    for effect, others in truth.get("indistinguishable", {}).items():
        if effect not in found and found & set(others) - true:
            found = found - set(others) | {effect}
    return found - (set(truth.get("tolerated", [])) - true)


def reduced(channel):
    """Whether the error of a channel fell as far as it must, or to the noise."""
    floor = channel.get("floor") or 0
    return channel["after"] <= max(REDUCTION_GOAL * channel["before"], AT_FLOOR * floor)


def worst_channel(channels):
    """The channel where most is missing: before, over the floor."""
    return max(channels, key=lambda name: channels[name]["before"] / max(channels[name].get("floor") or 0, 1e-6))


def judge(case, truth, outcome, report):
    """One machine: what was found, and which goals it meets."""
    result = {"name": case.name, "group": case.group, "true": sorted(truth["undeclared_effects"]),
              "found": [], "verdict": "failed", "channels": {}, "seconds": outcome["seconds"],
              "code": outcome["code"], "outside": bool(truth["outside_dictionary"]), "score": "wrong", "worse": False}
    if report is None:
        return result
    true = set(result["true"])
    found = {step["effect"] for step in report["steps"]}
    result.update(found=sorted(found), verdict=report["verdict"], channels=report["channels"],
                  unexplained=report.get("unexplained"))
    result["worse"] = any(c["after"] > SAME_ERROR * c["before"] for c in report["channels"].values())
    if result["outside"]:
        channel = report["channels"][worst_channel(report["channels"])]
        # A load over the position of a servo is a shape that can be learned; what depends on the time only is not.
        learned = case.group != "joint" and report["verdict"] == "effect_found" and reduced(channel)
        met = bool(report.get("unexplained")) or learned
        result["score"] = "met" if met else "wrong"
        return result
    verdict_fits = report["verdict"] == ("effect_found" if found else "nothing_missing")
    if verdict_fits and found == true:
        result["score"] = "exact"
    elif verdict_fits and without_equivalents(true, found, truth) == true:
        result["score"] = "equivalent"
    return result


def run_case(case, args):
    folder = args.folder / case.name
    robot = case.group == "robot"
    make(case, folder, str(Path(args.make).with_name("make_robot_joint")) if robot else args.make)
    rig = folder / "rig.yaml" if robot else args.rigs["joint" if case.group == "joint" else "servo"]
    outcome = trace(folder, args.trace, str(rig), args.timeout)
    report = None
    if outcome["code"] in RESULT_CODES:
        report = json.loads((folder / "report" / "report.json").read_text())
    return judge(case, json.loads((folder / "truth.json").read_text()), outcome, report)


def line(result):
    """What a reader wants to know of one machine."""
    channels = "  ".join(f"{name} {c['before']:.4f} -> {c['after']:.4f} (floor {c.get('floor') or 0:.4f})"
                         for name, c in result["channels"].items())
    found = " + ".join(result["found"]) or NOTHING
    return (f"{result['score']:<10} {result['name']}: {' + '.join(result['true']) or NOTHING} -> {found}, "
            f"{result['verdict']}{', TEST ERROR LARGER' if result['worse'] else ''}; {channels}; "
            f"{result['seconds']:.0f} s")


def confusion(results):
    """counts[true][found]. What was missed is charged to what was found in its place."""
    counts = collections.defaultdict(collections.Counter)
    for result in results:
        true, found = set(result["true"]), set(result["found"])
        for effect in true & found:
            counts[effect][effect] += 1
        instead = found - true
        if not instead and (true - found or not true):
            instead = {UNEXPLAINED if result["verdict"] in ("unexplained", "failed") else NOTHING}
        for effect in true - found or ({NOTHING} if instead else set()):
            for other in instead:
                counts[effect][other] += 1
    return counts


def print_confusion(counts):
    order = [NOTHING] + NAMED + OUTSIDE
    names = set(counts) | {column for row in counts.values() for column in row}
    columns = [n for n in order + sorted(names - set(order) - {LEARNED, UNEXPLAINED}) + [LEARNED, UNEXPLAINED]
               if any(row[n] for row in counts.values())]
    print("Rows: true; columns: found. What was missed is charged to what was found in its place.")
    for i, name in enumerate(columns):
        print(f"  {i + 1:>2} {name}")
    print(f"{'':<28}" + "".join(f"{i + 1:>4}" for i in range(len(columns))))
    for row in [n for n in order if n in counts]:
        print(f"{row:<28}" + "".join(f"{counts[row][c] or '.':>4}" for c in columns))


def totals(results):
    """Figures of one half of the suite, and whether each goal is met."""
    outside = [r for r in results if r["outside"]]
    empty = [r for r in results if not r["outside"] and not r["true"]]
    inside = [r for r in results if not r["outside"] and r["true"]]
    right = sum(r["score"] in ("exact", "equivalent") for r in inside)
    figures = {"machines": len(results), "in_dictionary": len(inside),
               "exact": sum(r["score"] == "exact" for r in inside),
               "equivalent": sum(r["score"] == "equivalent" for r in inside),
               "empty": len(empty), "empty_right": sum(r["score"] != "wrong" for r in empty),
               "outside": len(outside), "outside_met": sum(r["score"] == "met" for r in outside),
               "worse": sum(r["worse"] for r in results), "failed": sum(r["verdict"] == "failed" for r in results),
               "seconds": round(sum(r["seconds"] for r in results), 1)}
    figures["goals"] = {"right_set": right >= EXACT_GOAL * len(inside),
                        "nothing_added": figures["empty_right"] == len(empty),
                        "outside": figures["outside_met"] == len(outside),
                        "never_worse": figures["worse"] == 0,
                        "no_failure": figures["failed"] == 0}
    return figures


def print_totals(title, figures):
    def mark(goal):
        return "met" if figures["goals"][goal] else "MISSED"

    f = figures
    share = (f["exact"] + f["equivalent"]) / max(1, f["in_dictionary"])
    print(f"\n{title}: {f['machines']} machines, {f['seconds']:.0f} s")
    print(f"  right set        {f['exact']} exact + {f['equivalent']} equivalent of {f['in_dictionary']}"
          f" = {100 * share:.0f} %, goal {100 * EXACT_GOAL:.0f} %: {mark('right_set')}")
    print(f"  nothing missing  {f['empty_right']} of {f['empty']} left as they are: {mark('nothing_added')}")
    print(f"  no dictionary    {f['outside_met']} of {f['outside']} reduced to {REDUCTION_GOAL} or to the noise, or"
          f" said to be unexplained: {mark('outside')}")
    print(f"  larger error     {f['worse']} on the test record: {mark('never_worse')}")
    print(f"  failed           {f['failed']}: {mark('no_failure')}")


def read_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--trace", help="path of trace_residual (default: PATH, then the workspace)")
    parser.add_argument("--make", help="path of make_machine (default: PATH, then the workspace)")
    parser.add_argument("--only", default="", metavar="PATTERN", help="machines whose name contains it")
    parser.add_argument("--build", choices=builds.BUILDS, default="servo",
                        help="of the servos (default: %(default)s, as in the rig file)")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="each N-th machine only")
    parser.add_argument("--quick", action="store_true", help="12 machines")
    parser.add_argument("--seed", type=int, help="of the first machine (default: drawn, and printed)")
    parser.add_argument("--jobs", type=int, default=2, help="at the same time (default: %(default)s)")
    parser.add_argument("--timeout", type=float, default=900, help="s, per machine (default: %(default)s)")
    parser.add_argument("--keep", metavar="DIR", help="work here, keep all, skip what is made and run already")
    parser.add_argument("--json", metavar="FILE", help="all results (default: confusion_table.json in --keep)")
    parser.add_argument("--list", action="store_true", help="names of the machines")
    args = parser.parse_args()
    if args.seed is None:
        args.seed = secrets.randbelow(2**31)
        print(f"--seed {args.seed}", flush=True)
    if args.jobs < 1:
        parser.error("--jobs: at least 1")
    return args


def run_all(cases, args):
    results = {}
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        jobs = {pool.submit(run_case, case, args): case for case in cases}
        for job in concurrent.futures.as_completed(jobs):
            results[jobs[job].name] = job.result()
            print(line(job.result()), flush=True)
    return [results[case.name] for case in cases]


def main():
    args = read_arguments()
    build = builds.BUILDS[args.build]
    cases = builds.of_build(build, [case for case in suite(args.seed) if args.only in case.name])[::args.every]
    if args.quick:
        cases = quick(cases)
    if args.list:
        print("\n".join(f"{case.name}: {' '.join(case.options)}" for case in cases))
        return 0
    if not cases:
        print(f"confusion_table: no machine has {args.only} in its name", file=sys.stderr)
        return 64
    for tool in ("trace", "make"):
        path = find({"trace": "trace_residual", "make": "make_machine"}[tool], getattr(args, tool))
        if path is None:
            print(f"confusion_table: --{tool}: executable not found", file=sys.stderr)
            return 66
        setattr(args, tool, path)

    with tempfile.TemporaryDirectory() as scratch:
        args.folder = Path(args.keep or scratch).resolve()
        args.folder.mkdir(parents=True, exist_ok=True)
        args.rigs = {name: REPOSITORY / path for name, path in RIGS.items()}
        args.rigs["servo"] = builds.declared(build, args.rigs["servo"], args.folder)
        results = run_all(cases, args)
    summary = {}
    for group in GROUPS:
        part = [r for r in results if r["group"] == group]
        if part:
            print(f"\n== {group}")
            print_confusion(confusion(part))
            summary[group] = totals(part)
            print_totals(group, summary[group])
    output = args.json or (args.keep and str(Path(args.keep) / "confusion_table.json"))
    if output:
        table = {true: dict(row) for true, row in confusion(results).items()}
        Path(output).write_text(json.dumps({"schema_version": 1, "seed": args.seed, "totals": summary, "confusion": table,
                                            "machines": results}, indent=1) + "\n")
    return 0 if all(all(half["goals"].values()) for half in summary.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
