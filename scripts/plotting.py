# SPDX-License-Identifier: BSD-3-Clause
"""What the plot scripts share: command line, errors with exit codes, reading and writing files whole.

Exit codes of all of them: 0 done, 64 usage, 65 not the data, 66 data missing, 70 matplotlib missing, 73 cannot write.
"""
import argparse
import json
import os
import sys
import tempfile

NAME = os.path.basename(sys.argv[0])


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
        with open(path) as stream:
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
        if data["schema_version"] != 1:
            raise ValueError("schema_version is not 1")
        return data
    except OSError as error:
        fail(66, error)
    except (yaml.YAMLError, KeyError, TypeError, ValueError) as error:
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


def save(figure, path, dpi=100):
    """Whole or not at all."""
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(dir=os.path.dirname(path) or ".", suffix=os.path.splitext(path)[1])
        os.close(handle)
        figure.savefig(temporary, dpi=dpi)
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


def run(main):
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
