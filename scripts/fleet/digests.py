# SPDX-License-Identifier: BSD-3-Clause
"""Digests: what was computed of what. The key of a result is record, settings and version of the program."""
import hashlib
import json

_PART = 1 << 20  # bytes; larger parts let other threads run while a part is digested


def of_file(path):
    """Throws OSError."""
    digest = hashlib.sha256()
    with open(path, "rb", buffering=0) as stream:
        while part := stream.read(_PART):
            digest.update(part)
    return digest.hexdigest()


def of_words(words):
    return hashlib.sha256(json.dumps(words, ensure_ascii=True).encode()).hexdigest()


class Settings:
    """Digests of rig files and the like; each file is read once in a run."""

    def __init__(self, file_options):
        self._files, self._of_file = set(file_options), {}

    def _file(self, path):
        if path not in self._of_file:
            self._of_file[path] = of_file(path)
        return self._of_file[path]

    def digest(self, assignment):
        """Of what the map says of a record, by content. Throws OSError."""
        words = [[name, self._file(value) if name in self._files else value] for name, value in assignment.options]
        return of_words([words, [self._file(path) for path in assignment.healthy]])


def key(record_digest, settings_digest, version):
    return of_words([record_digest, settings_digest, version])
