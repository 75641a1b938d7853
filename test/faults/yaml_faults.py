# SPDX-License-Identifier: BSD-3-Clause
"""Damaged YAML: rig, curve, baseline, limits, search and loop files, all config/*.yaml."""
import re

from case import BAD, Case, RIGHT
from clean import finite_rows, judge_angle, judge_diagnosis
from csv_faults import judge_done

SCALAR = re.compile(r"^( *)(- )?([a-z_]+):( +)([^#\s'\"\[{|>&*][^#,]*?)( *(?:#.*)?)$")
TOKEN = re.compile(r"[A-Za-z_][\w.]*|[-+]?\d[\w.+-]*|[][{}:,#&*!|>'\"%@`-]|\n +")
NO_UNIT = {"schema_version", "seed", "seeds", "classes", "periods", "settling_periods", "points", "phases", "population"}


class Text:
    """A YAML text with the lines that hold one key and one plain value."""

    def __init__(self, body):
        self.lines = body.decode().splitlines()
        self.scalars = [i for i, line in enumerate(self.lines) if SCALAR.match(line)]
        self.numbers = [i for i in self.scalars if re.fullmatch(r"[-+0-9.eE]+", self.value(i))]

    def parts(self, i):
        return SCALAR.match(self.lines[i]).groups(default="")

    def key(self, i):
        return self.parts(i)[2]

    def value(self, i):
        return self.parts(i)[4]

    def with_value(self, i, value):
        indent, dash, key, space, _, comment = self.parts(i)
        return self.with_line(i, indent + dash + key + ":" + space + value + comment)

    def with_line(self, i, *lines):
        return ("\n".join(self.lines[:i] + list(lines) + self.lines[i + 1:]) + "\n").encode()


def place(name, i):
    return re.escape(name) + r":%d\b" % (i + 1)


def not_a_map(rng, name, body):
    kind, text = rng.choice([("empty", b""), ("only a comment", b"# nothing\n"), ("a list", b"- 1\n- 2\n"),
                             ("a scalar", b"42\n"), ("text", b"hello world\n"), ("null", b"~\n"), ("CSV", b"a,b\n1,2\n"),
                             ("two documents", body + b"---\n" + body), ("JSON list", b"[1, 2, 3]\n"),
                             ("an open bracket", b"{a: 1\n"), ("binary", bytes(range(256))), ("a tag", b"!!map {a: 1}\n"),
                             ("XML", b"<rig/>\n"), ("a list of maps", b"- {a: 1}\n")])
    return kind, text, True, []


def wrong_type(rng, name, body):
    text = Text(body)
    i = rng.choice(text.numbers)
    value = rng.choice(["abc", "[1, 2]", "{a: 1}", "'0.05'", '"1"', "", "~", "true", ".nan", ".inf", "1e999", "0x10",
                        "1_000", "1,5", "12:30", "0b1", "- 1"])
    return "%s: %s" % (text.key(i), value), text.with_value(i, value), True, [place(name, i)]


def unit_text(rng, name, body):
    text = Text(body)
    i = rng.choice(text.numbers)
    value = text.value(i) + rng.choice([" mm", "mm", " N m", "%", " um", " Hz", "e-3 m", " # m".replace(" #", "*")])
    return "%s: %s" % (text.key(i), value), text.with_value(i, value), True, [place(name, i), text.key(i)]


def value_off_by_1000(rng, name, body):
    text = Text(body)
    i = rng.choice([i for i in text.numbers if text.key(i) not in NO_UNIT] or text.numbers)
    value = repr(float(text.value(i)) * rng.choice([1e3, 1e-3]))
    return "%s: %s instead of %s" % (text.key(i), value, text.value(i)), text.with_value(i, value), False, []


def extreme_value(rng, name, body):
    text = Text(body)
    i = rng.choice(text.numbers)
    value = rng.choice(["0", "-1", "1e300", "1e-300", "-1e9", "99999999999999999999", "2147483648", "1e-20", "5e-324"])
    return "%s: %s instead of %s" % (text.key(i), value, text.value(i)), text.with_value(i, value), False, []


def unknown_key(rng, name, body):
    text = Text(body)
    i = rng.choice(text.scalars)
    indent, dash, key, space, value, comment = text.parts(i)
    wrong = rng.choice([key + "s", key[1:] or "x", key.upper(), "colour", key + "_"])
    line = indent + dash + wrong + ":" + space + value + comment
    if rng.random() < 0.5 and not dash:
        return "additional key " + wrong, text.with_line(i, text.lines[i], line), True, [re.escape(name) + r":\d+"]
    return "%s instead of %s" % (wrong, key), text.with_line(i, line), True, [re.escape(name) + r":\d+"]


def duplicate_key(rng, name, body):
    text = Text(body)
    i = rng.choice([i for i in text.scalars if not text.parts(i)[1]])
    return "%s twice" % text.key(i), text.with_line(i, text.lines[i], text.lines[i]), True, [place(name, i + 1)]


def missing_line(rng, name, body):
    text = Text(body)
    i = rng.choice(text.scalars)
    return "without '%s'" % text.lines[i].strip(), text.with_line(i), False, []


def anchors(rng, name, body):
    text = Text(body)
    i = rng.choice(text.numbers)
    kind = rng.choice(["cycle", "own cycle", "unknown alias", "billion laughs", "merge key", "alias of a number"])
    if kind == "cycle":
        changed = text.with_value(i, "&a [*a]")
    elif kind == "own cycle":
        changed = text.with_value(i, "&a {b: *a}")
    elif kind == "unknown alias":
        changed = text.with_value(i, "*nothing")
    elif kind == "merge key":
        changed = body + b"<<: {a: 1}\n"
    elif kind == "billion laughs":
        lines = ["l0: &l0 [lol, lol]"] + ["l%d: &l%d [%s]" % (n, n, ", ".join(["*l%d" % (n - 1)] * 9)) for n in range(1, 40)]
        changed = body + "\n".join(lines).encode() + b"\n"
    else:  # allowed, and says the same
        value = text.value(i)
        return kind, text.with_value(i, "&a " + value), False, []
    return kind, changed, True, [re.escape(name) + r":\d+"]


def deep_nesting(rng, name, body):
    depth = rng.choice([100, 10_000, 1_000_000])
    kind = rng.choice(["[", "{a: ", "- ", "indent", "a: \n ", "? "])
    if kind == "indent":
        depth = min(depth, 1000)
        nest = "".join(" " * n + "a:\n" for n in range(1, depth))
    else:
        nest = " " + kind * depth
    return "%d times %r" % (depth, kind), body + b"deep:\n" + nest.encode() + b"\n", True, []


def huge(rng, name, body):
    kind = rng.choice(["value", "key", "comment", "list"])
    size = rng.choice([1 << 16, 1 << 21, 1 << 24])
    more = {"value": b"a: " + b"9" * size, "key": b"k" * size + b": 1", "comment": b"# " + b"c" * size,
            "list": b"a: [" + b"1, " * (size // 3) + b"1]"}[kind]
    return "a %s of %d bytes" % (kind, size), body + more + b"\n", kind != "comment", []


def tokens(rng, name, body):
    """A token of the file lost, twice, exchanged with its neighbour or replaced by another one of it."""
    text = body.decode()
    found = list(TOKEN.finditer(re.sub(r"#.*", lambda m: "#" * len(m.group()), text)))
    found = [m for m in found if m.group() != "#"]
    k = rng.randrange(len(found) - 1)
    a, b = found[k], found[k + 1]
    kind = rng.choice(["lost", "twice", "exchanged", "replaced"])
    if kind == "lost":
        changed = text[:a.start()] + text[a.end():]
    elif kind == "twice":
        changed = text[:a.end()] + " " + a.group() + text[a.end():]
    elif kind == "exchanged":
        changed = text[:a.start()] + b.group() + text[a.end():b.start()] + a.group() + text[b.end():]
    else:
        other = rng.choice(found).group()
        changed = text[:a.start()] + other + text[a.end():]
        kind = "replaced by %r" % other
    line = text.count("\n", 0, a.start()) + 1
    return "%r in line %d %s" % (a.group(), line, kind), changed.encode(), False, []


def bytes_changed(rng, name, body):
    changed = bytearray(body)
    count = rng.choice([1, 3, 20])
    for _ in range(count):
        changed[rng.randrange(len(changed))] = rng.randrange(256)
    return "%d bytes changed" % count, bytes(changed), False, []


def truncated(rng, name, body):
    size = rng.randrange(len(body))
    return "cut after %d bytes" % size, body[:size], False, []


def harmless_layout(rng, name, body):
    kind = rng.choice(["CRLF", "no final newline", "BOM", "trailing spaces", "final document mark"])
    changed = {"CRLF": body.replace(b"\n", b"\r\n"), "no final newline": body.rstrip(b"\n"),
               "BOM": b"\xef\xbb\xbf" + body, "trailing spaces": body.replace(b"\n", b"  \n"),
               "final document mark": body + b"...\n"}[kind]
    return kind, changed, False, []


GENERATORS = [not_a_map, wrong_type, unit_text, value_off_by_1000, extreme_value, unknown_key, duplicate_key,
              missing_line, anchors, deep_nesting, huge, tokens, bytes_changed, truncated, harmless_layout]
DIAGNOSE = ["diagnose_record", "record.csv", "--rig", "rig.yaml", "--curve", "curve.yaml", "--json", "out.json"]


def judge_simulation(folder, code, err):
    """Of a machine that the damaged file states: a whole record of finite numbers, however it moves."""
    rows = finite_rows(folder + "/out.csv")
    return (RIGHT, "%d rows" % rows) if rows else (BAD, "no rows, or numbers that are not finite")


def uses_of(rng, clean):
    """A file kind of the package: name, clean bytes, command, outputs, judge."""
    record = {"record.csv": clean.record, "rig.yaml": clean.rig, "curve.yaml": clean.curve}
    kind = rng.choice(["rig", "rig", "rig", "rig", "curve", "baseline", "limits", "search", "loop"])
    if kind == "rig":
        if rng.random() < 0.3:
            return "rig.yaml", clean.rig, record, DIAGNOSE, ["out.json"], judge_diagnosis
        name = rng.choice([n for n in clean.config if is_rig(clean.config[n])])
        if rng.random() < 0.2:
            return "rig.yaml", clean.config["sarkar_1997.yaml"], {}, [
                "build_curve", "rig.yaml", "--out", "out.yaml", "--points", 3, "--periods", 1, "--seeds", 2], [
                    "out.yaml"], judge_done
        return "rig.yaml", clean.config[name], {n: clean.config[n] for n in clean.config if not is_rig(clean.config[n])}, [
            "simulate", "rig.yaml", "--duration", "0.1", "--out", "out.csv"], ["out.csv"], judge_simulation
    if kind == "curve":
        return "curve.yaml", clean.curve, record, DIAGNOSE, ["out.json"], judge_diagnosis
    if kind == "baseline":
        return "base.yaml", clean.baseline, record, DIAGNOSE + ["--baseline", "base.yaml"], ["out.json"], judge_diagnosis
    if kind == "limits":
        return "limits.yaml", clean.limits, record, DIAGNOSE + ["--limits", "limits.yaml"], ["out.json"], judge_diagnosis
    if kind == "search":
        rig = clean.config["sarkar_1997.yaml"]
        return "search.yaml", clean.config["sarkar_1997_search.yaml"], {"sarkar_1997.yaml": rig, "found.yaml": rig}, [
            "search_parameters", "search.yaml", "--check", "found.yaml", "--json", "out.json"], ["out.json"], judge_done
    return "loop.yaml", clean.config["hysteresis_loop.yaml"], {"rig.yaml": clean.rig}, [
        "integrator_study", "rig.yaml", "--loop", "loop.yaml", "--json", "out.json"], ["out.json"], judge_done


def diagnosis_by_wrong_rig(rng, clean):
    """A wrong rig file under a right record, with the curve of the right one or with one built from the wrong one."""
    command = DIAGNOSE if rng.random() < 0.8 else DIAGNOSE[:4] + ["--json", "out.json"]
    others = {"record.csv": clean.record, "curve.yaml": clean.curve}
    return "rig.yaml", clean.rig, others, command, ["out.json"], judge_diagnosis


def judged_by_angle(what):
    """A record holds angles; metres are those of the base radius that the rig file states."""
    return "base_radius" in what


def is_rig(body):
    return b"\ngear_train:" in body


def case(rng, clean, generate):
    name, body, others, command, outputs, judge = uses_of(rng, clean)
    if generate is value_off_by_1000 and rng.random() < 0.5:
        name, body, others, command, outputs, judge = diagnosis_by_wrong_rig(rng, clean)
    what, changed, refuse, says = generate(rng, name, body)
    if judge is judge_diagnosis and judged_by_angle(what):
        judge = judge_angle
    files = dict(others)
    files[name] = changed
    return Case(name_of(generate), "%s: %s" % (name, what), files, name, command, outputs, judge, refuse, says)


def name_of(generate):
    return "yaml: " + generate.__name__.replace("_", " ")


def classes(clean):
    return {name_of(g): (lambda rng, g=g: case(rng, clean, g)) for g in GENERATORS}
