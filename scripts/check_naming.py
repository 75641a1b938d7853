#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks the names in all C++ files that a build compiles, by clang-tidy with the rules of .clang-tidy.

What costs is reading the headers, so files that are compiled alike are checked together, several as one. Names that two
files both keep to themselves would clash: such files go into different groups, and a group that clang still cannot read
as one is halved. Generated code is left out.
"""
import argparse
import collections
import concurrent.futures
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile

FILES_PER_GROUP = 12
# What a file defines is in column 0, as .clang-format has it, and what follows tells names from types; constants may come
# several in a line. Aliases may be repeated, and tests of one room have different names anyway.
DEFINED = re.compile(r"^(?!TEST|using|namespace)(?=\w).*?(\w+)(?:\[\w*\])*(?: final)?(?: : .*)? ?[({=;]|\b(k[A-Z]\w*) = ",
                     re.MULTILINE)


def compiled_files(database, source):
    """Path -> flags that matter to the parser, for the files below `source`."""
    files = {}
    for entry in json.load(open(database)):
        words = iter(shlex.split(entry["command"]))
        flags = ["-std=c++17"]  # gcc's default, hence not among the flags
        for word in words:
            if word == "-isystem":
                flags += [word, next(words)]
            elif word.startswith(("-D", "-I")):
                flags.append(word)
        if entry["file"].startswith(source + os.sep):
            files[entry["file"]] = tuple(flags)
    return files


def defined_names(path):
    return {first or second for first, second in DEFINED.findall(open(path).read())}


def grouped(files):
    """Lists of files that have the same flags and define different names."""
    groups = collections.defaultdict(list)  # flags -> [(files, names)]
    for path, flags in sorted(files.items()):
        names = defined_names(path)
        alike = groups[flags]
        for members, taken in alike:
            if len(members) < FILES_PER_GROUP and not names & taken:
                members.append(path)
                taken |= names
                break
        else:
            alike.append(([path], names))
    return [(members, flags) for flags, alike in groups.items() for members, _ in alike]


def tidy(members, flags, source):
    """What clang-tidy says of the files, read as one; empty where all is well."""
    with tempfile.NamedTemporaryFile("w", suffix=".cpp") as together:
        together.write("".join('#include "%s"\n' % path for path in members))
        together.flush()
        run = subprocess.run(
            ["clang-tidy", "--quiet", "--config-file=%s/.clang-tidy" % os.path.dirname(os.path.dirname(__file__)),
             "--header-filter=^%s/" % re.escape(source), together.name, "--", *flags],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True)
    if run.returncode == 0:
        return ""
    if "clang-diagnostic-error" in run.stdout and len(members) > 1:
        half = len(members) // 2
        return tidy(members[:half], flags, source) + tidy(members[half:], flags, source)
    return run.stdout or run.stderr


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("database", help="compile_commands.json of the build")
    parser.add_argument("source", help="folder whose files are checked, as the build names it")
    arguments = parser.parse_args()

    source = arguments.source.rstrip(os.sep)
    files = compiled_files(arguments.database, source)
    if not files:
        sys.exit("check_naming: %s names no file below %s" % (arguments.database, source))
    groups = sorted(grouped(files), key=lambda group: -len(group[0]))
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        answers = list(pool.map(lambda group: tidy(*group, source), groups))
    found = sorted(set(re.findall(r"^\S+: (?:error|warning): .*", "".join(answers), re.MULTILINE)))
    print("\n".join(found) or "%d files: names are as they should be" % len(files))
    return 1 if any(answers) else 0


if __name__ == "__main__":
    sys.exit(main())
