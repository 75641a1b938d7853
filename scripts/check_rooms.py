#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks that every room is in its namespace, and includes only headers of rooms that it may know and private headers of
no other room, that the fuzzers, which compile rooms by themselves, have all that those know, and that the table of rooms on a page
has the sizes that they have, within a tenth.

Usage: check_rooms.py CMakeLists.txt INCLUDE SRC PAGE [--write]      --write puts the sizes into the page
What a room may know is what CMakeLists.txt says: room(NAME [FOLDER FOLDER] KNOWS ROOM... [READS_PRIVATE ROOM]), and all that those know.
"""
import os
import re
import sys

ROOM = re.compile(r"^room\((\w+)(?: COMPUTES)?(?: FOLDER (\S+))?((?: KNOWS(?: [a-z_]+)+)?)(?: READS_PRIVATE (\w+))?", re.MULTILINE)
FUZZED = re.compile(r"^foreach\(room ((?:[a-z_]+ ?)+)\)", re.MULTILINE)
FUZZ = "test/fuzz/CMakeLists.txt"
FUZZED_IN_PART = {"simulation"}
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)
NAMESPACE = re.compile(r"^namespace backlash(\S*) \{", re.MULTILINE)
SHARED = ("base", "nodes")  # in the outer namespace: the words of all rooms, and mains
OTHER_NAMES = {"ros": "ros_bridge", "ros_arm": "ros_bridge"}  # backlash::ros would hide ::ros
PROGRAMS = ("nodes", "tools")  # read private headers of all: nobody links them


def known_rooms(cmake_file):
    """Room -> rooms that it may include, itself among them; the same for their private headers; folder -> room of inner ones."""
    known, private, inner = {}, {}, {}
    for name, folder, knows, reads_private in ROOM.findall(open(cmake_file).read()):
        if folder:
            inner[folder] = name
        known[name] = {name}
        private[name] = {name, reads_private}
        for other in knows.split()[1:]:
            known[name] |= known[other]
    for program in PROGRAMS:
        known[program] = private[program] = set(known) | {program}
    return known, private, inner


def room_of(path, inner):
    """The room of a file, by its path in src or include."""
    return next((room for folder, room in inner.items() if path.startswith(folder + "/")), path.split("/")[0])


def room_of_include(name, path, inner, src):
    """The room of what a file includes, and whether it is private to that room; None for what is generated."""
    if name.startswith("backlash_diagnosis/"):
        parts = name.split("/")
        return (room_of("/".join(parts[1:]), inner), False) if len(parts) > 2 else None
    for folder in (os.path.dirname(path), src):
        found = os.path.normpath(os.path.join(folder, name))
        if os.path.exists(found):
            return room_of(os.path.relpath(found, src), inner), True
    return None


def misnamed(path, room, text):
    """What is wrong with the namespace of a file; None if nothing is. A forward declaration may be of an outer one."""
    wanted = "" if room in SHARED else "::" + OTHER_NAMES.get(room, room)
    found = [name for name in NAMESPACE.findall(text) if name != ""] or [""]
    if all(name == wanted or name.startswith(wanted + "::") for name in found) or "namespace backlash" not in text:
        return None
    return "%s: is in backlash%s, its room in backlash%s" % (path, found[0], wanted)


def missing_of_fuzzers(cmake_file, known):
    """Rooms that those of the fuzzers know and that are not compiled with them."""
    fuzz_file = os.path.join(os.path.dirname(cmake_file), FUZZ)
    rooms = set(FUZZED.search(open(fuzz_file).read())[1].split())
    missing = set().union(*(known[room] for room in rooms)) - rooms - FUZZED_IN_PART
    return ["%s: lacks room %s" % (fuzz_file, room) for room in sorted(missing)]


def with_sizes(page, lines):
    """The text of the page with the sizes of its rooms, rounded to hundreds of lines; what is wrong with those that it has."""
    problems = []

    def row(match):
        size = lines.get(match[2], 0)
        if abs(int(match[4]) - size) > 0.1 * size + 50:
            problems.append("%s: says %s lines of %s, which has %d (--write mends it)" % (page, match[4], match[2], size))
        return "%s%d |" % (match[1], round(size, -2))

    text, rows = re.subn(r"^(\| `(\w+)` \| ([^|]*) \| )(\d+) \|$", row, open(page).read(), flags=re.MULTILINE)
    if rows != len(lines):
        problems.append("%s: has a line for %d of %d rooms" % (page, rows, len(lines)))
    return text, problems


def main(cmake_file, include, src, page, write=""):
    known, private, inner = known_rooms(cmake_file)
    problems, lines = missing_of_fuzzers(cmake_file, known), {room: 0 for room in known}
    for root in (include, src):
        for folder, _, names in os.walk(root):
            for path in (os.path.join(folder, name) for name in names if name.endswith((".h", ".cpp"))):
                room = room_of(os.path.relpath(path, root), inner)
                text = open(path).read()
                lines[room] = lines.get(room, 0) + text.count("\n")
                problems += filter(None, [misnamed(path, room, text)])
                for name in INCLUDE.findall(text):
                    target = room_of_include(name, path, inner, src)
                    if target is None:
                        continue
                    if target[0] not in known[room]:
                        problems.append("%s: %s must not know %s (%s)" % (path, room, target[0], name))
                    elif target[1] and target[0] not in private[room]:
                        problems.append("%s: %s is private to %s" % (path, name, target[0]))
    lines.pop("nodes", None)
    text, differences = with_sizes(page, lines)
    if write:
        open(page, "w").write(text)
    else:
        problems += differences
    print("\n".join(problems) or "%d rooms know what they may" % len(known))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
