# SPDX-License-Identifier: BSD-3-Clause
"""What the plot scripts share: command line, errors with exit codes, reading and writing files whole.

Exit codes of all of them: 0 done, 64 usage, 65 not the data, 66 data missing, 70 matplotlib missing, 73 cannot write.
"""
import argparse
import base64
import csv
import io
import json
import os
import sys
import tempfile

NAME = os.path.basename(sys.argv[0])
PAGE_FIGURE = (5.6, 3.3)  # inches; the pages set two beside each other where they are wide enough


class Parser(argparse.ArgumentParser):
    """Ends with 64 where the command line is wrong."""

    def __init__(self, description):
        super().__init__(prog=NAME, description=description)

    def error(self, message):
        self.exit(64, "%s: %s; see --help\n" % (self.prog, message))


def fail(code, message):
    sys.stderr.write("%s: %s\n" % (NAME, message))
    sys.exit(code)


def load_json(path, what):
    """A file of schema_version 1; `what` names it for the error."""
    try:
        with open(path, encoding="utf-8") as stream:
            data = json.load(stream)
        if data["schema_version"] != 1:
            raise ValueError("schema_version is not 1")
        return data
    except OSError as error:
        fail(66, error)
    except (KeyError, TypeError, ValueError) as error:
        fail(65, "%s: not %s: %r" % (path, what, error))


def load_yaml(path, what):
    import yaml
    try:
        with open(path) as stream:
            data = yaml.load(stream, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
        if data["schema_version"] != 2:
            raise ValueError("schema_version is not 2")
        return data
    except OSError as error:
        fail(66, error)
    except (yaml.YAMLError, KeyError, TypeError, ValueError) as error:
        fail(65, "%s: not %s: %r" % (path, what, error))


def load_columns(path, what):
    """The columns of a CSV by name, all numbers."""
    try:
        with open(path, newline="", encoding="utf-8") as stream:
            rows = csv.reader(stream)
            names = next(rows)
            return dict(zip(names, zip(*([float(cell) for cell in row] for row in rows))))
    except OSError as error:
        fail(66, error)
    except (StopIteration, ValueError) as error:
        fail(65, "%s: not %s: %r" % (path, what, error))


def pyplot():
    """matplotlib without a screen."""
    try:
        import matplotlib
        matplotlib.use("Agg")
        import matplotlib.pyplot
        return matplotlib.pyplot
    except ImportError as error:
        fail(70, "%s (Debian: python3-matplotlib)" % error)


def page_pyplot():
    """The same, in the style of the pages."""
    plt = pyplot()
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
                         "grid.color": "#e6e6e6", "axes.axisbelow": True, "legend.frameon": False,
                         "axes.titlesize": 9, "axes.formatter.limits": (-3, 4), "axes.formatter.use_mathtext": True,
                         "agg.path.chunksize": 10000})
    return plt


def picture(figure, caption):
    """As an entry of a section's figures."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=130)
    pyplot().close(figure)
    return {"caption": caption, "png": base64.b64encode(stream.getvalue()).decode()}


def section(heading, pictures):
    return {"heading": heading, "figures": list(pictures)}


def save_sections(sections, path):
    """The figures of a page, as the page's template wants them (src/report/templates/figures.html)."""
    import matplotlib
    drawn_with = "Drawn with matplotlib %s, Python %s." % (matplotlib.__version__, sys.version.split()[0])
    save_text(json.dumps({"schema_version": 1, "sections": sections, "drawn_with": drawn_with}), path)


def write_whole(path, write):
    """`write` fills the file whose path it is given; `path` then holds all of it, or is as before."""
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(dir=os.path.dirname(path) or ".", suffix=os.path.splitext(path)[1])
        os.close(handle)
        write(temporary)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        os.replace(temporary, path)
        temporary = None
    except OSError as error:
        fail(73, "%s: cannot be written: %s" % (path, error))
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)


def save(figure, path, dpi=100):
    write_whole(path, lambda temporary: figure.savefig(temporary, dpi=dpi))


def save_text(text, path):
    def write(temporary):
        with open(temporary, "w", encoding="utf-8") as stream:
            stream.write(text)
    write_whole(path, write)


def run(main):
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
