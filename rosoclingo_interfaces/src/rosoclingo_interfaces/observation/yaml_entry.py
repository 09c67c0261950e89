"""YAML mappings whose errors name file and line. Needs no ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Collection, Dict, List, Tuple, Union

import yaml

from rosclingo import strict_yaml
from rosclingo.errors import shorten
from rosclingo.solver.terms import quote
from rosoclingo_interfaces.errors import EntryError

_LONGEST = 2_000  # characters of an error, which quotes names and values
_TAG = "tag:yaml.org,2002:"
_TRUTH_VALUES = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}


def read_entry(file: Path, what: str, needed: str) -> YamlEntry:
    """Returns the mapping that a YAML file is.

    Args:
        file: Where it is.
        what: What it is called in errors.
        needed: A key that it needs, for the same.

    Raises:
        EntryError: The file cannot be read, is no YAML, or is no mapping.
    """
    try:
        node = strict_yaml.compose(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as err:
        raise EntryError(f"cannot read {what} {file}: {err}") from err
    except yaml.MarkedYAMLError as err:
        line = "" if err.problem_mark is None else f", line {err.problem_mark.line + 1}"
        raise EntryError(f"{file}{line}: it is no YAML: {err.problem}") from err
    except yaml.YAMLError as err:
        raise EntryError(f"{file}: it is no YAML: {err}") from err
    if node is None:
        raise EntryError(f"{file}, line 1: the file is empty; it needs the key {needed}")
    return YamlEntry(file, node)


@dataclass(frozen=True)
class YamlEntry:
    """A mapping of a YAML file.

    Attributes:
        file: The file.
        node: What PyYAML has composed.
        name: Its key in the mapping around it, for errors.
    """

    file: Path
    node: yaml.Node
    name: str = ""
    _nodes: Dict[str, Tuple[yaml.Node, yaml.Node]] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        if not isinstance(self.node, yaml.MappingNode):
            what = f"{self.name}: " if self.name else ""
            raise self.wrong(f"{what}expected a mapping, such as {{key: value}}")
        for key, value in self.node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise self.wrong_at(key, "expected a name as the key")
            name = str(key.value)
            if name in self._nodes:
                raise self.wrong_at(key, f"{name} is there twice; remove one")
            self._nodes[name] = key, value

    @property
    def line(self) -> int:
        """The line where it begins, from 1 on."""
        return int(self.node.start_mark.line) + 1

    def wrong(self, reason: object, key: str = "") -> EntryError:
        """Returns the error about a key's value, or about the whole mapping."""
        return self.wrong_at(self._nodes[key][0] if key in self._nodes else self.node, reason)

    def __contains__(self, key: str) -> bool:
        return key in self._nodes

    @property
    def keys(self) -> List[str]:
        """The keys, in the order of the file."""
        return list(self._nodes)

    def is_scalar(self, key: str) -> bool:
        """Returns whether a key's value is neither a list nor a mapping."""
        return isinstance(self._nodes[key][1], yaml.ScalarNode)

    def value(self, key: str) -> yaml.Node:
        """Returns what PyYAML has composed of a key's value."""
        return self._nodes[key][1]

    def check_keys(self, known: Collection[str], needed: Collection[str] = ()) -> None:
        """Checks the names of the keys.

        Raises:
            EntryError: One is unknown, or a needed one is not there.
        """
        for key in self._nodes:
            if key not in known:
                raise self.wrong(f"unknown key {quote(key)}; there are {', '.join(known)}", key)
        for key in needed:
            if key not in self._nodes:
                where = f" of {self.name}" if self.name else ""
                raise self.wrong(f"the key {key}{where} is missing")

    def text(self, key: str, default: str = "") -> str:
        """Returns a text that is not empty, or the default if the key is not there.

        Raises:
            EntryError: It is something else.
        """
        if key not in self:
            return default
        node = self._nodes[key][1]
        if not isinstance(node, yaml.ScalarNode) or not node.value:
            raise self.wrong(f"{key}: expected a text", key)
        return str(node.value)

    def path(self, key: str) -> Path:
        """Returns the path of another file, which begins in the folder of this one.

        Raises:
            EntryError: It is something else, or in the home of a user that does not exist.
        """
        try:
            return self.file.parent / Path(self.text(key)).expanduser()
        except RuntimeError as err:
            raise self.wrong(f"{key}: {err} Write the whole path", key) from err

    def texts(self, key: str) -> List[str]:
        """Returns the texts of a list, or the one that stands in its place.

        Raises:
            EntryError: It is something else, or empty.
        """
        node = self._nodes[key][1]
        nodes = node.value if isinstance(node, yaml.SequenceNode) else [node]
        texts = [one.value for one in nodes if isinstance(one, yaml.ScalarNode) and one.value]
        if not nodes or len(texts) < len(nodes):
            raise self.wrong(f"{key}: expected a list of texts", key)
        return texts

    def literal(self, key: str) -> str:
        """Returns the text of a number, a truth value or a text, which may be empty in quotes.

        Raises:
            EntryError: It is something else.
        """
        node = self._nodes[key][1]
        if not isinstance(node, yaml.ScalarNode) or node.tag == f"{_TAG}null":
            raise self.wrong(f"{key}: expected a number or a text", key)
        return str(node.value)

    def flag(self, key: str) -> bool:
        """Returns a truth value; False if the key is not there.

        Raises:
            EntryError: It is something else.
        """
        value = self.scalar(key) if key in self else False
        if not isinstance(value, bool):
            raise self.wrong(f"{key}: expected true or false", key)
        return value

    def number(self, key: str, default: float = 0.0, unit: str = "") -> float:
        """Returns a finite number, which is not negative if it has a unit.

        Raises:
            EntryError: It is something else.
        """
        if key not in self:
            return default
        node = self._nodes[key][1]
        try:
            number = float(node.value) if isinstance(node, yaml.ScalarNode) else math.nan
        except ValueError:
            number = math.nan
        if not math.isfinite(number) or (unit and number < 0):
            what = f"a number of {unit} from 0 on" if unit else "a number"
            raise self.wrong(f"{key}: expected {what}", key)
        return number

    def scalar(self, key: str) -> Union[bool, int, str]:
        """Returns a truth value, an integer or a text; a text in quotes may be empty.

        Raises:
            EntryError: It is something else.
        """
        node = self._nodes[key][1]
        if not isinstance(node, yaml.ScalarNode):
            raise self.wrong(f"{key}: expected a text", key)
        text = str(node.value)
        if node.tag == f"{_TAG}bool" and text.lower() in _TRUTH_VALUES:
            return _TRUTH_VALUES[text.lower()]
        if node.tag == f"{_TAG}int":
            try:
                return int(text, 0)
            except ValueError as err:
                raise self.wrong(f"{key}: expected an integer such as 3", key) from err
        if node.tag != f"{_TAG}str":
            raise self.wrong(f"{key}: expected true, false, an integer or a text", key)
        return text

    def inner(self, key: str) -> YamlEntry:
        """Returns the mapping of a key.

        Raises:
            EntryError: It is something else.
        """
        return YamlEntry(self.file, self._nodes[key][1], key)

    def entries(self, key: str) -> List[YamlEntry]:
        """Returns the mappings of a list.

        Raises:
            EntryError: It is something else, or empty.
        """
        node = self._nodes[key][1]
        if not isinstance(node, yaml.SequenceNode) or not node.value:
            raise self.wrong(f"{key}: expected a list with one entry or more", key)
        return [YamlEntry(self.file, one) for one in node.value]

    def wrong_at(self, node: Any, reason: object) -> EntryError:
        """Returns the error about a part of the file that PyYAML has composed."""
        return EntryError(
            f"{self.file}, line {node.start_mark.line + 1}: {shorten(str(reason), _LONGEST)}"
        )
