# SPDX-License-Identifier: BSD-3-Clause
"""The records of a folder or of a list, one after the other: never all of them in memory."""
import os
from dataclasses import dataclass

from .errors import bad_data, missing

ENDINGS = (".csv", ".bag", ".mcap", ".db3")


@dataclass(frozen=True)
class Found:
    name: str   # as the map and the page know it: below the folder, or as in the list
    path: str   # absolute
    size: int   # bytes; None where there is no such file
    mtime: int  # ns


def _found(name, path):
    try:
        status = os.stat(path)
    except OSError:
        return Found(name, path, None, None)
    return Found(name, path, status.st_size, status.st_mtime_ns)


def _of_folder(folder, left_out):
    def refuse(error):
        raise missing("%s: cannot be read: %s" % (error.filename, error.strerror))
    for parent, folders, files in os.walk(folder, onerror=refuse):
        folders[:] = sorted(f for f in folders if not f.startswith(".")
                            and os.path.realpath(os.path.join(parent, f)) != left_out)
        for file in sorted(files):
            if file.lower().endswith(ENDINGS) and not file.startswith("."):
                path = os.path.join(parent, file)
                yield _found(os.path.relpath(path, folder), os.path.abspath(path))


def _of_list(path):
    folder = os.path.dirname(os.path.abspath(path))
    with open(path, encoding="utf-8", errors="surrogateescape") as stream:
        for number, line in enumerate(stream, 1):
            name = line.strip()
            if not name or name.startswith("#"):
                continue
            if "\0" in name:
                raise bad_data("%s:%d: holds bytes that are no name of a file" % (path, number))
            if not name.lower().endswith(ENDINGS):
                raise bad_data("%s:%d: '%s': a record ends in one of %s" % (path, number, name[:200], ", ".join(ENDINGS)))
            yield _found(os.path.normpath(name), os.path.normpath(os.path.join(folder, name)))


def find(source, out):
    """Records of FOLDER, without those below `out`, or of LIST. Throws FleetError where there is none of the two."""
    if os.path.isdir(source):
        return _of_folder(source, os.path.realpath(out))
    if not os.path.isfile(source):
        raise missing("%s: there is no such folder or list" % source)
    if source.lower().endswith(ENDINGS):
        raise bad_data("%s: is a record; give its folder, or a text file with the path of a record per line" % source)
    return _of_list(source)
