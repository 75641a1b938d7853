#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Counts the results of gtests and rostests from their XML files, because run_tests exits with 0 on failures.

Prints every failed test with its message and every skipped one with its reason; the last line is
"N passed, N failed, N skipped". Exit code 0 only if nothing failed and something passed.
"""
import argparse
import os
import re
import sys
import xml.etree.ElementTree as ElementTree

# unittest's skip does not reach rosunit's XML: it records a success. A Python rostest therefore prints this line
# when it skips (see test/support/skip.py), and rosunit keeps it under system-out.
SKIP_LINE = re.compile(r"^SKIPPED (\S+): (.*)$", re.MULTILINE)


class Summary:
    def __init__(self):
        self.passed, self.failed, self.skipped = 0, [], []

    def add_file(self, path):
        name = os.path.basename(path)
        try:
            root = ElementTree.parse(path).getroot()
        except (ElementTree.ParseError, OSError) as error:
            self.failed.append((name, "cannot be read: %s" % error))
            return
        suites = [suite for suite in root.iter("testsuite") if suite.find("testcase") is not None]
        if not suites:
            self.failed.append((name, "holds no test"))
        # rostest-*.xml only says whether the tests of a .test file ran; what they found is in rosunit-*.xml.
        count_passed = not name.startswith("rostest-")
        for suite in suites:
            skips = dict(SKIP_LINE.findall(suite.findtext("system-out") or ""))
            for case in suite.findall("testcase"):
                self.add_case(case, suite.get("name", name), skips, count_passed)

    def add_case(self, case, suite_name, skips, count_passed):
        group = case.get("classname", "").replace("__main__.", "")
        if group in ("", "Results"):  # catkin's own entry for a missing file: only the suite says which
            group = suite_name
        name = "%s.%s" % (group, case.get("name", "?"))
        problems = case.findall("failure") + case.findall("error")
        skipped = case.find("skipped")
        if problems:
            self.failed.append((name, "\n".join(text_of(problem) for problem in problems)))
        elif skipped is not None:
            self.skipped.append((name, text_of(skipped)))
        elif case.get("name") in skips:
            self.skipped.append((name, skips[case.get("name")]))
        elif case.get("status") == "notrun":
            self.skipped.append((name, "disabled"))
        elif count_passed:
            self.passed += 1


def text_of(element):
    """The message of a failure or skip. gtest gives it both as attribute and, longer, as text."""
    return max((element.get("message") or "").strip(), (element.text or "").strip(), key=len) or "no message"


def indented(text):
    return "\n".join("    " + line for line in text.splitlines())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("directory", help="folder that is searched for result files")
    parser.add_argument("--passed", action="append", default=[], metavar="NAME", help="a test without a file")
    parser.add_argument("--failed", action="append", default=[], metavar="NAME: MESSAGE")
    parser.add_argument("--skipped", action="append", default=[], metavar="NAME: REASON")
    arguments = parser.parse_args()

    summary = Summary()
    files = sorted(os.path.join(folder, name) for folder, _, names in os.walk(arguments.directory)
                   for name in names if name.endswith(".xml"))
    for path in files:
        summary.add_file(path)
    if not files:
        summary.failed.append((arguments.directory, "no result files: no test ran"))
    summary.passed += len(arguments.passed)
    for given, found in ((arguments.failed, summary.failed), (arguments.skipped, summary.skipped)):
        for text in given:
            name, _, message = text.partition(": ")
            found.append((name, message))

    for name, reason in summary.skipped:
        print("SKIPPED %s\n%s" % (name, indented(reason)))
    for name, message in summary.failed:
        print("FAILED %s\n%s" % (name, indented(message)))
    print("%d passed, %d failed, %d skipped" % (summary.passed, len(summary.failed), len(summary.skipped)))
    return 0 if summary.passed and not summary.failed else 1


if __name__ == "__main__":
    sys.exit(main())
