# SPDX-License-Identifier: BSD-3-Clause
"""Patterns of names of records: * and ? within a folder, ** across folders, {name} captures."""
import re

_PART = re.compile(r"\*\*/|\*\*|\*|\?|\{[^{}]*\}|[^*?{}]+|[{}]")
_NAME = re.compile(r"[a-z_]+\Z")
_PLACE = re.compile(r"\{([^{}]*)\}")
_WILD = {"**/": "(?:.*/)?", "**": ".*", "*": "[^/]*", "?": "[^/]"}


class Pattern:
    """Throws ValueError for text that is no pattern."""

    def __init__(self, text):
        self.text = text
        self.names = []
        self._expression = re.compile("".join(self._piece(part) for part in _PART.findall(text)) + r"\Z", re.DOTALL)

    def _piece(self, part):
        if part in _WILD:
            return _WILD[part]
        if part in "{}":
            raise ValueError("a brace without its other one")
        if not part.startswith("{"):
            return re.escape(part)
        name = part[1:-1]
        if not _NAME.match(name):
            raise ValueError("'%s': a capture is small letters in braces, as in {joint}" % part)
        if name in self.names:
            return "(?P=%s)" % name
        self.names.append(name)
        return "(?P<%s>[^/]+)" % name

    def captures(self, name):
        """What the name of a record has in the places of the captures; None where the pattern is another one."""
        found = self._expression.match(name)
        return found.groupdict() if found else None


def places(template):
    """The captures that a template speaks of."""
    return _PLACE.findall(template)


def filled(template, captures):
    return _PLACE.sub(lambda place: captures[place.group(1)], template)
