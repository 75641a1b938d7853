#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Tries faults and bad input on the real commands and nodes and counts what comes of them.

Every case is drawn from the seed, its class and its number alone: a single one can be repeated with --only CLASS
--number N. Exit code 0 only if nothing was bad.
"""
import argparse
import os
import random
import shutil
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import bag_faults
import bench_faults
import csv_faults
import yaml_faults
from case import BAD, VERDICTS, run
from clean import Clean

PARTS = ("files", "messages", "processes")


def package_programs():
    import roslib.packages
    found = {}

    def program_of(name):
        if name not in found:
            found[name] = roslib.packages.find_node("backlash_diagnosis", name)[0]
        return found[name]
    return program_of, os.path.join(roslib.packages.get_pkg_dir("backlash_diagnosis"), "config")


class Table:
    def __init__(self):
        self.rows, self.bad, self.lines = {}, [], []

    def add(self, kind, verdict, what, why):
        self.rows.setdefault(kind, dict.fromkeys(VERDICTS, 0))[verdict] += 1
        self.lines.append("%s | %s | %s | %s" % (kind, verdict, what, why))
        if verdict == BAD:
            self.bad.append("%s: %s\n    %s" % (kind, what, why))

    def text(self):
        lines = ["| class | tried | right | cannot tell | refused | bad |", "|---|---|---|---|---|---|"]
        total = dict.fromkeys(VERDICTS, 0)
        for kind, counts in self.rows.items():
            lines.append(row_text(kind, counts))
            for verdict in VERDICTS:
                total[verdict] += counts[verdict]
        return "\n".join(lines + [row_text("all", total)])


def row_text(kind, counts):
    return "| %s | %d | %s |" % (kind, sum(counts.values()), " | ".join(str(counts[v]) for v in VERDICTS))


def run_files(arguments, table):
    program_of, config = package_programs()
    clean = Clean(program_of, config)
    classes = {}
    for module in (csv_faults, bench_faults, bag_faults, yaml_faults):
        classes.update(module.classes(clean))
    chosen = [kind for kind in classes if arguments.only in kind]
    jobs = [(kind, number) for kind in chosen for number in range(arguments.count)
            if arguments.number is None or number == arguments.number]

    def one(job):
        kind, number = job
        folder = tempfile.mkdtemp()
        case = classes[kind](random.Random("%d/%s/%d" % (arguments.seed, kind, number)))
        result = run(case, folder, program_of)
        if result.verdict == BAD and arguments.keep:
            shutil.copytree(folder, os.path.join(arguments.keep, "%s-%d" % (kind.replace(": ", "_"), number)),
                            dirs_exist_ok=True)
        shutil.rmtree(folder)
        return result
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for (kind, number), result in zip(jobs, pool.map(one, jobs)):
            what = "%s: %s (--seed %d --only '%s' --number %d)" % (
                result.case.command[0], result.case.what, arguments.seed, kind, number)
            table.add(kind, result.verdict, what, result.why)


def run_nodes(arguments, table, parts):
    """One master for both: rospy stays with the first that it meets."""
    import message_faults
    import process_faults
    from ros_master import Master
    with Master() as master:
        for part, module in (("messages", message_faults), ("processes", process_faults)):
            if part in parts:
                module.run(arguments, table, master)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", nargs="?", default="all", choices=PARTS + ("all",))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=10, help="cases per class of files and messages")
    parser.add_argument("--only", default="", help="only classes whose name holds this")
    parser.add_argument("--number", type=int, help="only the case of this number")
    parser.add_argument("--keep", default="", help="folder to keep the files of bad cases in")
    parser.add_argument("--log", default="", help="file to write every case to")
    parser.add_argument("--out", default="", help="file to write the table to, too")
    arguments = parser.parse_args()
    table = Table()
    parts = PARTS if arguments.part == "all" else (arguments.part,)
    if "files" in parts:
        run_files(arguments, table)
    if set(parts) != {"files"}:
        run_nodes(arguments, table, parts)
    for name, text in ((arguments.log, "\n".join(table.lines)), (arguments.out, table.text())):
        if name:
            with open(name, "w") as stream:
                stream.write(text + "\n")
    for text in table.bad:
        print("BAD " + text)
    print(table.text())
    return 1 if table.bad or not table.rows else 0


if __name__ == "__main__":
    sys.exit(main())
