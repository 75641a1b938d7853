#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs clang-tidy with the rules of .clang-tidy on the C++ files of the package.

All files are read in the groups in which the build compiles them, as what costs is reading the headers. With --changed-since
only the files that differ from that commit, each alone. Generated code is left out.
"""
import argparse
import concurrent.futures
import json
import os
import re
import shlex
import subprocess
import sys

INCLUDED = re.compile(r'^#include "(.*)"$', re.MULTILINE)


def parser_flags(command):
    """Of a compiler's command those that matter to the parser."""
    words = iter(shlex.split(command))
    flags = ["-std=c++17"]  # gcc's default, hence not always among the flags
    for word in words:
        if word == "-isystem":
            flags += [word, next(words)]
        elif word.startswith(("-D", "-I")):
            flags.append(word)
    return flags


def units_of(database, source):
    """[(path that is compiled, files of the package in it, flags)]"""
    units = []
    for entry in json.load(open(database)):
        path = entry["file"]
        if "/Unity/unity_" in path:
            files = INCLUDED.findall(open(path).read())
        else:
            files = [path]
        if all(file.startswith(source + os.sep) for file in files):
            units.append((path, files, parser_flags(entry["command"])))
    return units


def changed_files(source, commit):
    """Paths below `source` of the C++ files that differ from `commit`, and of those that git does not know yet."""
    def git(*words):
        return subprocess.run(["git", "-C", repository, *words], stdout=subprocess.PIPE, check=True,
                              universal_newlines=True).stdout.splitlines()
    repository = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
    names = git("diff", "--name-only", "--diff-filter=d", commit) + git("ls-files", "--others", "--exclude-standard")
    return [os.path.join(source, name) for name in sorted(set(names)) if name.endswith((".cpp", ".h"))]


def alone(files, units, source):
    """Each of the files as a unit of its own: a source with its flags, a header with those of a source of its room."""
    room_of = re.compile(re.escape(source) + r"/(?:src|include/backlash_diagnosis)/(\w+)/")
    flags_of, flags_of_room = {}, {}
    for _, members, flags in units:
        for member in members:
            flags_of[member] = flags
            room = room_of.match(member)
            if room:
                flags_of_room[room.group(1)] = flags
    chosen = []
    for file in files:
        room = room_of.match(file)
        flags = flags_of.get(file) or (flags_of_room.get(room.group(1)) if room else None)
        if flags:  # else a file of another project: benchmark, test/downstream
            chosen.append((file, [file], flags if file.endswith(".cpp") else flags + ["-xc++"]))
    return chosen


def tidy(path, flags, source):
    """What clang-tidy says of one unit; empty where all is well."""
    run = subprocess.run(
        ["clang-tidy", "--quiet", "--config-file=%s/.clang-tidy" % os.path.dirname(os.path.dirname(__file__)),
         "--header-filter=^%s/" % re.escape(source), path, "--", *flags],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True)
    return "" if run.returncode == 0 else run.stdout or run.stderr


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("database", help="compile_commands.json of the build")
    parser.add_argument("source", help="folder whose files are checked, as the build names it")
    parser.add_argument("--changed-since", metavar="COMMIT", help="only the files that differ from it")
    arguments = parser.parse_args()

    source = arguments.source.rstrip(os.sep)
    units = units_of(arguments.database, source)
    if not units:
        sys.exit("check_tidy: %s names no file below %s" % (arguments.database, source))
    if arguments.changed_since:
        units = alone(changed_files(source, arguments.changed_since), units, source)
    units.sort(key=lambda unit: -len(unit[1]))
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        answers = [pool.submit(tidy, path, flags, source) for path, _, flags in units]
        found = set()
        for answer in concurrent.futures.as_completed(answers):  # shown at once: all files take long
            new = set(re.findall(r"^\S+: (?:error|warning): .*", answer.result(), re.MULTILINE)) - found
            print("".join(line + "\n" for line in sorted(new)), end="", flush=True)
            found |= new
    bad = any(answer.result() for answer in answers)
    if not bad:
        print("%d files: as they should be" % sum(len(files) for _, files, _ in units))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
