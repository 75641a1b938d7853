#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks the form of the messages that the core answers with: refusals of estimators, findings of the record check, errors of
rig files, warnings. A message says what was seen with number and place, what it means, what to do, on one line: it begins in
lower case, has no full stop at its end, no exclamation mark, at most LONGEST characters. Its words are check_words.py's.

Usage: check_messages.py [--list]  exit code 1 where a message is not of that form; --list prints all, by file, to be read aloud
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LONGEST = 280
ROOMS = [folder for folder in sorted((ROOT / "src").iterdir()) if folder.name not in ("nodes", "tools", "ros")]
# What takes a message: exceptions and refusals, and fields that people read.
TAKERS = re.compile(r"\b(?:Refusal\s*\{|(?:CannotIdentify|InvalidParameter|BadData|CannotWrite|MissingInput|refuse|refused|fail|fail_at|"
                    r"complain|not_served|wrong|unusable|add_finding|warn)\s*\(|(?:message|reason|cannot_tell|why|why_not|note|signature)"
                    r"\s*\+?=[^=]|(?:warnings|notes|reasons|problems)\.(?:push_back|emplace_back)\s*\()")
LITERAL = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
NAMES = ("Coulomb", "The ")  # also what may stand at the beginning; The: of several sentences


def without_comments(text):
    """Comments become blanks of the same length; literals stay."""
    return re.sub(r'"(?:[^"\\\n]|\\.)*"|//[^\n]*', lambda m: m.group() if m.group()[0] == '"' else " " * len(m.group()), text)


def statement(text, begin):
    """From `begin` to the semicolon that ends it, brackets and literals considered."""
    depth = i = 0
    rest = text[begin:begin + 4000]
    while i < len(rest):
        literal = LITERAL.match(rest, i) if rest[i] == '"' else None
        if literal:
            i = literal.end()
            continue
        depth += (rest[i] in "([{") - (rest[i] in ")]}")
        if rest[i] == ";" and depth <= 0 or depth < 0:
            break
        i += 1
    return rest[:i]


def messages_of(file):
    """(line, message) of each; what stands between literals is {}."""
    text = without_comments(file.read_text())
    found = {}
    for taker in TAKERS.finditer(text):
        said = statement(text, taker.start())
        parts, last = [], None
        for literal in LITERAL.finditer(said):
            between = said[last:literal.start()] if last is not None else ""
            if last is not None and between.strip():
                alternative = re.fullmatch(r"\s*[:?]\s*|[^+]*[?:,;{}][^+]*", between)
                parts.append("\0" if alternative else "{}")
            parts.append(literal.group(1))
            last = literal.end()
        for message in "".join(parts).split("\0"):
            message = re.sub(r"\{:[^}]*\}", "{}", message).replace('\\"', '"')
            if message.count(" ") >= 3:  # shorter ones are names, units and keys
                found[message] = text.count("\n", 0, taker.start()) + 1
    return sorted((line, message) for message, line in found.items())


def problems_of(message):
    text = message.strip()
    if text[0].isupper() and not text.startswith(NAMES):
        yield "begins with a capital"
    if text.endswith(".") and not text.endswith("{}.") or "!" in text:
        yield "ends with a full stop, or exclaims"
    if len(text) > LONGEST:
        yield f"has {len(text)} characters, {LONGEST} are read at once"
    if "  " in text or "\\n" in text:
        yield "is not one line with single blanks"


def main():
    bad = count = 0
    for file in (f for room in ROOMS for f in sorted(room.rglob("*")) if f.suffix in (".cpp", ".h")):
        for line, message in messages_of(file):
            count += 1
            place = f"{file.relative_to(ROOT)}:{line}"
            if "--list" in sys.argv[1:]:
                print(f"{place}: {message}")
            for problem in problems_of(message):
                bad += 1
                print(f"{place}: {problem}: {message}", file=sys.stderr)
    print(f"{count} messages")
    return 1 if bad or count < 300 else 0  # fewer: they are written in another way than this finds


if __name__ == "__main__":
    sys.exit(main())
