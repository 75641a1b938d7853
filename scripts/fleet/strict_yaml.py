# SPDX-License-Identifier: BSD-3-Clause
"""YAML whose errors name file, line and key; a key that is unknown or there twice is refused."""
import yaml

from .errors import bad_data, missing


class Map:
    """A map of keys; `finish` refuses those that nobody asked for."""

    def __init__(self, path, node):
        self._path, self._node, self._items, self._asked = path, node, {}, set()
        if not isinstance(node, yaml.MappingNode):
            raise bad_data("%s: must be a map of keys" % self.where())
        for key, value in node.value:
            name = key.value if isinstance(key, yaml.ScalarNode) else "?"
            if name in self._items:
                raise bad_data("%s:%d: %s: is there twice" % (path, key.start_mark.line + 1, name))
            self._items[name] = value

    @property
    def line(self):
        return self._node.start_mark.line + 1

    def where(self, name=None):
        node = self._items.get(name, self._node)
        return "%s:%d%s" % (self._path, node.start_mark.line + 1, ": " + name if name else "")

    def text(self, name, required=False):
        """Text of a key; None where it is not there."""
        self._asked.add(name)
        node = self._items.get(name)
        if node is None:
            if required:
                raise bad_data("%s: is missing" % self.where() if not name else "%s: %s: is missing" % (self.where(), name))
            return None
        if not isinstance(node, yaml.ScalarNode) or node.value == "":
            raise bad_data("%s: must be text" % self.where(name))
        return node.value

    def texts(self, name):
        """A list of texts; empty where the key is not there."""
        self._asked.add(name)
        node = self._items.get(name)
        if node is None:
            return []
        if not isinstance(node, yaml.SequenceNode) or not node.value or \
                not all(isinstance(item, yaml.ScalarNode) and item.value for item in node.value):
            raise bad_data("%s: must be a list of names" % self.where(name))
        return [item.value for item in node.value]

    def maps(self, name):
        self._asked.add(name)
        node = self._items.get(name)
        if not isinstance(node, yaml.SequenceNode) or not node.value:
            raise bad_data("%s: must be a list with an entry or more" % self.where(name) if node is not None
                           else "%s: %s: is missing" % (self.where(), name))
        return [Map(self._path, item) for item in node.value]

    def finish(self):
        for name in self._items:
            if name not in self._asked:
                raise bad_data("%s: is no key here; there are: %s" % (self.where(name), ", ".join(sorted(self._asked))))


def read(path):
    """The document of a file."""
    try:
        with open(path, encoding="utf-8") as stream:
            node = yaml.compose(stream, Loader=yaml.SafeLoader)
    except OSError as error:
        raise missing("%s: cannot be read: %s" % (path, error.strerror)) from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        mark = getattr(error, "problem_mark", None)
        raise bad_data("%s%s: no YAML: %s" % (path, ":%d" % (mark.line + 1) if mark else "",
                                              getattr(error, "problem", None) or error)) from None
    if node is None:
        raise bad_data("%s: is empty" % path)
    return Map(path, node)
