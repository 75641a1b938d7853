# SPDX-License-Identifier: BSD-3-Clause
"""What ends a run, with the exit code of the commands of this package."""

HEALTHY, WATCH, FAULT, INCONCLUSIVE = 0, 1, 2, 3
USAGE, BAD_DATA, MISSING_INPUT, INTERNAL, CANNOT_WRITE = 64, 65, 66, 70, 73
INTERRUPTED = 130


class FleetError(Exception):
    """Message and exit code."""

    def __init__(self, code, message):
        super().__init__(message)
        self.code = code


def usage(message):
    return FleetError(USAGE, message + "; see --help")


def bad_data(message):
    return FleetError(BAD_DATA, message)


def missing(message):
    return FleetError(MISSING_INPUT, message)


def internal(message):
    return FleetError(INTERNAL, message)


def cannot_write(path, reason):
    return FleetError(CANNOT_WRITE, "%s: cannot be written: %s" % (path, reason))
