# SPDX-License-Identifier: BSD-3-Clause
"""MAP.yaml: which rig file stands for which records, of which joint they are and when they were made."""
import os
import posixpath
from dataclasses import dataclass, field

from . import pattern, strict_yaml
from .errors import bad_data

FILES = ("rig", "limits", "baseline", "curve")  # options of the command that name a file
WORDS = ("topic", "joint_in_record")            # and those that do not
TIMES = ("stamps", "mtime", "name")


@dataclass(frozen=True)
class Assignment:
    """What the map says of one record."""
    joint: str
    time: str                                   # one of TIMES
    named_time: str                             # what {time} captured, or None
    options: tuple = field(default=())          # of (name, text): those above that are given
    healthy: tuple = field(default=())          # records of the healthy joint


class Entry:
    def __init__(self, yaml_map, folder):
        self.where = yaml_map.where()
        text = yaml_map.text("match", required=True)
        try:
            self._pattern = pattern.Pattern(text)
        except ValueError as error:
            raise bad_data("%s: '%s': %s" % (yaml_map.where("match"), text, error)) from None
        self._folder = folder
        self._options = {"rig": yaml_map.text("rig", required=True)}
        for name in FILES[1:] + WORDS:
            value = yaml_map.text(name)
            if value is not None:
                self._options[name] = value
        self._healthy = yaml_map.texts("healthy")
        self._joint = yaml_map.text("joint") or ("{joint}" if "joint" in self._pattern.names else None)
        self._time = yaml_map.text("time") or ("name" if "time" in self._pattern.names else "stamps")
        self._check(yaml_map)

    def _check(self, yaml_map):
        if self._time not in TIMES:
            raise bad_data("%s: '%s': must be one of %s" % (yaml_map.where("time"), self._time, ", ".join(TIMES)))
        if self._time == "name" and "time" not in self._pattern.names:
            raise bad_data("%s: 'name' needs {time} in match" % yaml_map.where("time"))
        known = self._pattern.names
        templates = [("joint", self._joint or "")] + list(self._options.items()) + [("healthy", h) for h in self._healthy]
        for name, template in templates:
            for place in pattern.places(template):
                if place not in known:
                    raise bad_data("%s: '{%s}': match captures no such part; it captures: %s"
                                   % (yaml_map.where(name), place, ", ".join(known) or "nothing"))
        yaml_map.finish()

    def assignment(self, name):
        """None where the record is of another entry."""
        captures = self._pattern.captures(name)
        if captures is None:
            return None

        def path(template):
            return os.path.normpath(os.path.join(self._folder, pattern.filled(template, captures)))
        options = [(option, path(text) if option in FILES else pattern.filled(text, captures))
                   for option, text in self._options.items()]
        joint = pattern.filled(self._joint, captures) if self._joint else posixpath.basename(posixpath.dirname(name))
        return Assignment(joint or "joint", self._time, captures.get("time"), tuple(options),
                          tuple(path(template) for template in self._healthy))


class RigMap:
    """Throws FleetError for a file that is no map."""

    def __init__(self, path):
        document = strict_yaml.read(path)
        version = document.text("schema_version", required=True)
        if version != "1":
            raise bad_data("%s: '%s': must be 1" % (document.where("schema_version"), version))
        folder = os.path.dirname(os.path.abspath(path))
        self.entries = [Entry(entry, folder) for entry in document.maps("records")]
        document.finish()

    def assignment(self, name):
        """What the map says of a record; None where it says nothing. An ambiguous map is refused."""
        found, where = None, None
        for entry in self.entries:
            assignment = entry.assignment(name)
            if assignment is None:
                continue
            if found is not None:
                raise bad_data("%s: matches %s, and so does %s: a record is of one entry" % (entry.where, name, where))
            found, where = assignment, entry.where
        return found
