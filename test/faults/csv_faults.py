# SPDX-License-Identifier: BSD-3-Clause
"""Damaged CSV records. A generator takes (random, clean) and returns (what, bytes, must be refused, message parts)."""
import gzip

from case import BAD, CANNOT_TELL, Case, RIGHT
from clean import judge_diagnosis

SEPARATORS = [";", "\t", " ", "|", ":"]
NO_NUMBERS = ["abc", "0.05 N m", "1e", "0x1F", "--1", "12abc", "1.2.3", "'0.05'", "1 2", "٣"]
TOO_LARGE = ["1e999", "-1e400"]
NOT_MEASURED = ["", "nan", "inf", "-Inf", "null"]


def text_of(header, rows):
    return "\n".join([",".join(header)] + [",".join(row) for row in rows]) + "\n"


def copy_of(clean):
    return list(clean.header), [list(row) for row in clean.rows]


def line(index):
    return r"record\.csv:%d\b" % (index + 2)  # the header is line 1


def wrong_separator(rng, clean):
    separator = rng.choice(SEPARATORS)
    lines = clean.record.decode().splitlines()
    if rng.random() < 0.5:
        return "%r instead of all commas" % separator, "\n".join(
            each.replace(",", separator) for each in lines).encode(), True, []
    index = rng.randrange(len(clean.rows))
    lines[index + 1] = lines[index + 1].replace(",", separator)
    return "%r instead of commas in row %d" % (separator, index), "\n".join(lines).encode(), True, [line(index)]


def decimal_comma(rng, clean):
    separator = rng.choice([";", ","])
    body = clean.record.decode().replace(",", "\0").replace(".", ",").replace("\0", separator)
    return "decimal commas between %r" % separator, body.encode(), True, []


def missing_column(rng, clean):
    header, rows = copy_of(clean)
    place = rng.randrange(len(header))
    name = header.pop(place)
    for row in rows:
        row.pop(place)
    return "no column " + name, text_of(header, rows).encode(), name == "time", []


def wrong_column_name(rng, clean):
    header, rows = copy_of(clean)
    place = rng.randrange(len(header))
    wrong = rng.choice([header[place].upper(), header[place] + "2", "", "0.1", header[place - 1]])
    before, header[place] = header[place], wrong
    return "column %s named %r" % (before, wrong), text_of(header, rows).encode(), True, [r"record\.csv:1\b"]


def swapped_columns(rng, clean):
    header, rows = copy_of(clean)
    a, b = rng.sample(range(1, len(header)), 2)
    header[a], header[b] = header[b], header[a]
    return "names of %s and %s swapped" % (header[b], header[a]), text_of(header, rows).encode(), False, []


def fields_missing_or_extra(rng, clean):
    header, rows = copy_of(clean)
    index = rng.randrange(len(rows))
    if rng.random() < 0.5:
        rows[index].pop(rng.randrange(len(header)))
    else:
        rows[index].insert(rng.randrange(len(header)), "0.0")
    return "%d fields in row %d" % (len(rows[index]), index), text_of(header, rows).encode(), True, [line(index)]


def with_field(rng, clean, choices):
    header, rows = copy_of(clean)
    index, place = rng.randrange(len(rows)), rng.randrange(len(header))
    rows[index][place] = rng.choice(choices)
    what = "%s = %r in row %d" % (header[place], rows[index][place], index)
    return what, text_of(header, rows).encode(), True, [line(index), header[place]]


def text_in_numbers(rng, clean):
    return with_field(rng, clean, NO_NUMBERS)


def too_large(rng, clean):
    return with_field(rng, clean, TOO_LARGE)


def not_measured(rng, clean):
    """A row counts without the value, but not without its time."""
    what, body, _, parts = with_field(rng, clean, NOT_MEASURED)
    of_time = parts[1] == "time"
    return what, body, of_time, parts if of_time else []


def huge_line(rng, clean):
    header, rows = copy_of(clean)
    size = rng.choice([1 << 17, 1 << 21, 1 << 23])
    if rng.random() < 0.3:
        header[-1] = "x" * size
        return "a header of %d bytes" % size, text_of(header, rows).encode(), True, [r"record\.csv:1\b"]
    index = rng.randrange(len(rows))
    rows[index][1] = rng.choice(["1", " ", ",", "é"]) * size
    return "a field of %d bytes in row %d" % (size, index), text_of(header, rows).encode(), True, [line(index)]


def harmless_layout(rng, clean):
    name = rng.choice(["no final newline", "BOM", "CRLF", "BOM and CRLF", "spaces", "empty lines at the end"])
    body = clean.record.decode()
    if name == "no final newline":
        body = body.rstrip("\n")
    if "CRLF" in name:
        body = body.replace("\n", "\r\n")
    if "BOM" in name:
        body = "\ufeff" + body
    if name == "spaces":
        body = body.replace(",", rng.choice([" , ", ",\t", ",  "]))
    if name.startswith("empty lines"):
        body += "\n" * rng.randint(1, 5)
    return name, body.encode(), False, []


def cr_only(rng, clean):
    return "CR as line end", clean.record.replace(b"\n", b"\r"), True, []


def unordered_times(rng, clean):
    header, rows = copy_of(clean)
    how = rng.choice(["swapped rows", "shuffled", "backwards", "restarted"])
    if how == "swapped rows":
        i = rng.randrange(len(rows) - 1)
        rows[i], rows[i + 1] = rows[i + 1], rows[i]
    elif how == "shuffled":
        rng.shuffle(rows)
    elif how == "backwards":
        rows.reverse()
    else:
        rows = rows + rows
    refused = how != "swapped rows"  # of those one comes late
    return how, text_of(header, rows).encode(), refused, [r"record\.csv:\d+", "time = "] if refused else []


def repeated_times(rng, clean):
    header, rows = copy_of(clean)
    count = rng.choice([1, 10, 300])
    for index in sorted(rng.sample(range(len(rows)), count), reverse=True):
        rows.insert(index, list(rows[index]))
    return "%d rows twice" % count, text_of(header, rows).encode(), False, []


def missing_rows(rng, clean):
    header, rows = copy_of(clean)
    start, count = rng.randrange(len(rows)), rng.choice([1, 20, 200, 600])
    del rows[start:start + count]
    return "rows %d to %d missing" % (start, start + count), text_of(header, rows).encode(), False, []


def few_rows(rng, clean):
    header, rows = copy_of(clean)
    count = rng.choice([1, 2, 3, 10, 99, 101, 210, 301])
    return "only %d rows" % count, text_of(header, rows[:count]).encode(), False, []


def no_data(rng, clean):
    body = rng.choice([b"", b"\n", b"\n\n\n", b"\xef\xbb\xbf", clean.record.splitlines()[0],
                       clean.record.splitlines()[0] + b"\n", b" ", b"\r\n"])
    return "only %r" % body[:30], body, True, []


def binary(rng, clean):
    kind = rng.choice(["random bytes", "gzip", "UTF-16", "header, then random bytes", "NUL bytes"])
    noise = bytes(rng.randrange(256) for _ in range(rng.choice([1, 100, 100_000])))
    body = {"random bytes": b"\x01" + noise, "gzip": gzip.compress(clean.record, mtime=0),
            "UTF-16": clean.record.decode().encode("utf-16"),
            "header, then random bytes": clean.record.splitlines()[0] + b"\n\x02" + noise,
            "NUL bytes": clean.record + bytes(1000)}[kind]
    return kind, body, True, []


def truncated(rng, clean):
    size = rng.randrange(len(clean.record))
    return "cut after %d bytes" % size, clean.record[:size], False, []


def flipped(body, rng, count):
    changed = bytearray(body)
    for _ in range(count):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def bits_flipped(rng, clean):
    count = rng.choice([1, 2, 8])
    return "%d bits flipped" % count, flipped(clean.record, rng, count), False, []


def outliers(rng, clean):
    header, rows = copy_of(clean)
    place, factor = rng.randrange(1, len(header)), rng.choice([-1, 10, 1e3, 1e9, 1e300])
    for index in rng.sample(range(len(rows)), rng.choice([1, 3])):
        rows[index][place] = repr(float(rows[index][place]) * factor)
    return "%s times %g in single rows" % (header[place], factor), text_of(header, rows).encode(), False, []


def wrong_unit(rng, clean):
    header, rows = copy_of(clean)
    place = rng.randrange(len(header))
    factor = rng.choice([1e3, 1e-3, 1e6] if header[place] != "motor_position" else [57.29578, 1e3, 1e-3])
    for row in rows:
        row[place] = repr(float(row[place]) * factor)
    return "%s times %g throughout" % (header[place], factor), text_of(header, rows).encode(), False, []


def dead_channel(rng, clean):
    header, rows = copy_of(clean)
    place, value = rng.randrange(1, len(header)), rng.choice(["0", "0.05", "-1e3"])
    start = rng.choice([0, len(rows) // 2])
    for row in rows[start:]:
        row[place] = value
    return "%s stands at %s from row %d" % (header[place], value, start), text_of(header, rows).encode(), False, []


GENERATORS = [wrong_separator, decimal_comma, missing_column, wrong_column_name, swapped_columns,
              fields_missing_or_extra, text_in_numbers, too_large, not_measured, huge_line, harmless_layout, cr_only,
              unordered_times, repeated_times, missing_rows, few_rows, no_data, binary, truncated, bits_flipped,
              outliers, wrong_unit, dead_channel]
ANSWERED = {harmless_layout, repeated_times}  # nothing is lost: the answer is the clean one


def lenient_rows(body):
    """The rows of a text by column, as Python reads them: an oracle that shares nothing with the reader under test."""
    header, *lines = body.decode("utf-8-sig", "replace").replace("\r", "").splitlines()
    names = [name.strip() for name in header.split(",")]
    rows = set()
    for line in lines:
        try:
            row = dict(zip(names, (float(field) for field in line.split(","))))
        except ValueError:
            continue
        row["time"] = round(row.get("time", 0), 9)  # s; a record's times end with the nanosecond
        rows.add(tuple(sorted(row.items())))
    return rows


def judge_conversion(body):
    """What was converted is what the text says, row by row."""
    def judge(folder, code, err):
        with open(folder + "/out.csv", "rb") as stream:
            out = lenient_rows(stream.read())
        strange = out - lenient_rows(body)
        if strange or not out:
            return BAD, "rows that are not in the input: %s" % sorted(strange)[:2]
        return RIGHT, ""
    return judge


def judge_answered(folder, code, err):
    verdict, why = judge_diagnosis(folder, code, err)
    return (verdict, why) if verdict == RIGHT else (BAD, "nothing was missing, but: " + why)


def judge_done(folder, code, err):
    """No oracle of the campaign's knows this answer; it has ended in an orderly way."""
    if code == 3:
        return (CANNOT_TELL, err.strip()[-300:]) if err.strip() else (BAD, "cannot tell, but not why")
    return RIGHT, ""


def case(rng, clean, generate):
    use = rng.random()
    if use > 0.85:
        clean = clean.servo()
    what, body, refuse, says = generate(rng, clean)
    files = {"record.csv": body, "rig.yaml": clean.rig, "curve.yaml": clean.curve}
    kind = "csv: " + generate.__name__.replace("_", " ")
    if use < 0.65:
        judge = judge_answered if generate in ANSWERED else judge_diagnosis
        command = ["diagnose_record", "record.csv", "--rig", "rig.yaml", "--curve", "curve.yaml", "--json", "out.json"]
        outputs = ["out.json"]
    elif use < 0.85:
        command, judge, outputs = ["convert_record", "record.csv", "out.csv"], judge_conversion(body), ["out.csv"]
    elif use < 0.92:
        command, judge, outputs = ["compare_models", "record.csv", "rig.yaml", "--json", "out.json"], judge_done, [
            "out.json"]
    else:
        command, judge, outputs = ["identify", "record.csv", "--rig", "rig.yaml", "--out", "out.yaml", "--json",
                                   "out.json"], judge_done, ["out.yaml", "out.json"]
    return Case(kind, what, files, "record.csv", command, outputs, judge, refuse, says)


def classes(clean):
    return {"csv: " + g.__name__.replace("_", " "): (lambda rng, g=g: case(rng, clean, g)) for g in GENERATORS}
