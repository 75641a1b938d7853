#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks the words of code, messages and pages: none that scripts/words.txt forbids (doc/reference/words.md says what to write).

A word is also found as a part of a name (kNAME, name_of, NameLess). Exit code 1 where one is found.
Usage: check_words.py [PATH...]  without paths: the whole repository
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LIST = ROOT / "scripts/words.txt"
PLACES = ("README.md CONTRIBUTING.md CHANGELOG.rst CMakeLists.txt package.xml action benchmark cfg cmake config doc include launch "
          "msg scripts src srv test").split()
GAP = r"[\s_\-/*#\"']*"  # between the words of a phrase: also a line break of a comment or of a string
PART = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")  # of a name


def read_list():
    entries = {"word": set(), "name": set(), "phrase": [], "allow": [], "except": {LIST}}
    for number, line in enumerate(LIST.read_text().splitlines(), 1):
        kind, _, rest = line.split("#")[0].strip().partition(" ")
        if not kind:
            continue
        if kind not in entries or not rest:
            sys.exit(f"{LIST}:{number}: none of {', '.join(entries)} with what it is about: {line}")
        if kind in ("phrase", "allow"):
            words = [re.escape(word) for word in rest.split()]
            entries[kind].append(re.compile(r"(?<![A-Za-z])" * (kind == "phrase") + GAP.join(words) + r"(?![a-z])", re.IGNORECASE))
        elif kind == "except":
            entries[kind].add(ROOT / rest.strip())
        else:
            entries[kind].add(rest.strip())
    return entries


def files_of(places, left_out):
    for place in places:
        if not place.exists():
            sys.exit(f"{place}: no such file or folder")
        for file in sorted(place.rglob("*")) if place.is_dir() else [place]:
            if file.is_file() and file not in left_out and "__pycache__" not in file.parts:
                yield file


def blank(match):
    return re.sub(r"\S", " ", match.group())


def found_in(file, entries):
    """(line, what) of each forbidden word in the file; files that are no text hold none."""
    try:
        text = file.read_text()
    except UnicodeDecodeError:
        return []
    for allowed in entries["allow"]:
        text = allowed.sub(blank, text)
    hits = []
    for number, line in enumerate(text.splitlines(), 1):
        for name in re.findall(r"[A-Za-z_][A-Za-z_0-9]*", line):
            parts = {part.lower() for part in PART.findall(name)}
            hits += [(number, word) for word in sorted(parts & entries["word"])]
            if name in entries["name"]:
                hits.append((number, name))
    for phrase in entries["phrase"]:
        hits += [(text.count("\n", 0, m.start()) + 1, " ".join(m.group().split())) for m in phrase.finditer(text)]
    return sorted(hits)


def main():
    entries = read_list()
    read = bad = 0
    for file in files_of([Path(path).resolve() for path in sys.argv[1:]] or [ROOT / place for place in PLACES], entries["except"]):
        read += 1
        shown = file.relative_to(ROOT) if ROOT in file.parents else file
        for line, what in found_in(file, entries):
            bad += 1
            print(f"{shown}:{line}: '{what}': doc/reference/words.md says what to write instead")
    print(f"{read} files, {bad} forbidden words")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
