# SPDX-License-Identifier: BSD-3-Clause
"""Records of a test bench, with names and units of its own, clean and damaged. Generators as in csv_faults."""
import json
import math

from case import Case
from csv_faults import flipped, judge_answered
from clean import judge_diagnosis

# Channel, name, unit, SI value of one.
COLUMNS = [("time", "t", "ms", 1e-3), ("motor_torque", "Drive torque", "mNm", 1e-3),
           ("motor_position", "EncoderAngle", "deg", math.pi / 180), ("motor_velocity", "Speed", "rpm", math.pi / 30),
           ("sensor_torque", "Cell 1", "Ncm", 1e-2)]
OTHER_KIND = ["A", "mm", "s", "g", "raw"]
UNKNOWN = ["furlong", "NM", "degrees", "-", "", "m s", "'deg'", "\u00e9"]


class Bench:
    """The clean record as such a file; `layout` says how."""

    def __init__(self, rng, clean):
        self.known = [column for column in COLUMNS if column[0] in clean.header]
        self.separator, self.comma = rng.choice([(",", False), (";", False), (";", True), ("\t", False), ("\t", True)])
        self.units_in = rng.choice(["header", "row", "map"])
        self.comments = rng.choice(["", "# bench 4\n", "Bench 4; run 17\nDate,12 May\n\n"])
        places = [clean.header.index(column[0]) for column in self.known]
        self.rows = [[self.number(float(row[place]) / column[3]) for place, column in zip(places, self.known)]
                     for row in clean.rows]
        self.names = [name + (" [%s]" % unit if self.units_in == "header" else "") for _, name, unit, _ in self.known]
        self.units = [unit for _, _, unit, _ in self.known]

    def number(self, value):
        text = "%.17g" % value
        return text.replace(".", ",") if self.comma else text

    def text(self):
        lines = [self.separator.join(self.names + ["note"])]
        if self.units_in == "row":
            lines.append(self.separator.join(self.units + [""]))
        lines += [self.separator.join(row + ['"any%s thing"' % self.separator]) for row in self.rows]
        return self.comments + "\n".join(lines) + "\n"

    def map(self):
        lines = ["channels:"]
        for (channel, _, _, _), name, unit in zip(self.known, self.names, self.units):
            says = ", unit: %r" % unit if self.units_in == "map" else ""
            lines.append("  %s: {column: %s%s}" % (channel, json.dumps(name), says))
        return "\n".join(lines) + "\n"


def whole(rng, bench):
    body = bench.text()
    if rng.random() < 0.3:
        body = "\ufeff" + body.replace("\n", "\r\n")
    return "%r, comma %s, units in the %s" % (bench.separator, bench.comma, bench.units_in), body.encode(), False, []


def wrong_unit(rng, bench):
    place = rng.randrange(len(bench.names))
    if bench.units_in == "map":
        bench.units_in = "header"  # the map says no unit
        bench.names = ["%s [%s]" % (name, unit) for name, unit in zip(bench.names, bench.units)]
    wrong = rng.choice(OTHER_KIND if rng.random() < 0.5 else UNKNOWN)
    if wrong == "s" and place == 0:
        wrong = "A"
    bench.names[place] = bench.names[place].replace("[%s]" % bench.units[place], "[%s]" % wrong)
    bench.units[place] = wrong
    return "unit %r of %s" % (wrong, bench.names[place]), bench.text().encode(), True, [r"unit = '"]


def missing_column(rng, bench):
    place = rng.randrange(len(bench.names))
    mapped = bench.map()
    name, bench.names[place] = bench.names[place], rng.choice(["other", "", bench.names[place].upper() + "x"])
    bench.map = lambda: mapped
    return "no column " + name, bench.text().encode(), True, ["there are: "]


def two_marks(rng, bench):
    if bench.separator == ",":
        bench.separator = ";"
    for index in rng.sample(range(1, len(bench.rows)), 3):
        row = bench.rows[index]
        place = rng.choice([i for i, field in enumerate(row) if "." in field or "," in field] or [0])
        row[place] = row[place].translate(str.maketrans(".,", ",."))
        if "." not in row[place] and "," not in row[place]:
            row[place] += ",5" if not bench.comma else ".5"
    return "points and commas", bench.text().encode(), True, [r"record\.csv:\d+", "decimal"]


def text_in_numbers(rng, bench):
    index, place = rng.randrange(len(bench.rows)), rng.randrange(len(bench.names))
    wrong = rng.choice(["abc", "1 2", "0x1F", "1e999", "180\u00b0", "2 mA"])
    bench.rows[index][place] = wrong
    return "%r in row %d" % (wrong, index), bench.text().encode(), True, [r"record\.csv:\d+"]


def truncated(rng, bench):
    body = bench.text().encode()
    size = rng.randrange(len(body))
    return "cut after %d bytes" % size, body[:size], False, []


def bits_flipped(rng, bench):
    return "bits flipped", flipped(bench.text().encode(), rng, rng.choice([1, 8])), False, []


GENERATORS = [whole, wrong_unit, missing_column, two_marks, text_in_numbers, truncated, bits_flipped]


def case(rng, clean, generate):
    bench = Bench(rng, clean)
    what, body, refuse, says = generate(rng, bench)
    files = {"record.csv": body, "rig.yaml": clean.rig + bench.map().encode(), "curve.yaml": clean.curve}
    command = ["diagnose_record", "record.csv", "--rig", "rig.yaml", "--curve", "curve.yaml", "--json", "out.json"]
    judge = judge_answered if generate is whole else judge_diagnosis
    return Case("bench: " + generate.__name__.replace("_", " "), what, files, "record.csv", command, ["out.json"], judge,
                refuse, says)


def classes(clean):
    return {"bench: " + g.__name__.replace("_", " "): (lambda rng, g=g: case(rng, clean, g)) for g in GENERATORS}
