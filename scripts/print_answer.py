#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Prints true and estimated backlash from a saved answer of the service `diagnose` (demo.sh).

usage: print_answer.py ANSWER.yaml TRUE_BACKLASH_METRES; exit code 1 where the answer is no success.
"""
import math
import sys

import yaml


def main():
    with open(sys.argv[1]) as stream:
        answer = next(document for document in yaml.safe_load_all(stream) if document)
    print("true backlash        %6.1f um" % (1e6 * float(sys.argv[2])))
    for e in answer["estimates"]:
        value, low, high = (float(e[key]) for key in ("backlash", "lower", "upper"))
        if math.isnan(value):
            print("%-19s  %s: %s" % (e["method"], e["status_name"], e["message"]))
        else:
            print("%-19s  %6.1f um   95 %% interval %.1f to %.1f um" % (e["method"], 1e6 * value, 1e6 * low, 1e6 * high))
    v = answer["verdict"]
    if len(v["members"]) > 1:
        print("together             %6.1f um   95 %% interval %.1f to %.1f um"
              % tuple(1e6 * float(v[key]) for key in ("backlash", "lower", "upper")))
    print("verdict              %s" % v["message"])
    return 0 if answer["success"] else 1


if __name__ == "__main__":
    sys.exit(main())
