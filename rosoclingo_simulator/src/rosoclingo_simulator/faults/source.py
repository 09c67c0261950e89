"""The text of a file of faults, and its values, each with the way to it for errors."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import yaml

from rosclingo import strict_yaml
from rosoclingo_simulator.errors import FaultError

_Step = Union[str, int]


@dataclass(frozen=True)
class FaultSource:
    """Where faults were read.

    Attributes:
        name: Of the file, or of the parameter.
        text: The YAML text, which has lines; None for values that somebody has parsed.
    """

    name: str
    text: Optional[str] = None

    def place(self, path: Sequence[_Step]) -> str:
        """Returns the file, and the line of the value to which keys and indices lead."""
        if self.text is None:
            return self.name
        node = _composed(self.text)
        line = 0
        for step in path:
            found = _child(node, step)
            if found is None:
                break
            key, node = found
            line = key.start_mark.line
        return f"{self.name}, line {line + 1}"


@functools.lru_cache(maxsize=1)  # each fault has its place
def _composed(text: str) -> Any:
    return strict_yaml.compose(text)


def _child(node: Any, step: _Step) -> Optional[Tuple[Any, Any]]:
    """Returns the node of a key or an item, and that of its value; None if there is none."""
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if key.value == str(step):
                return key, value
    if isinstance(node, yaml.SequenceNode) and isinstance(step, int):
        return node.value[step], node.value[step]
    return None


@dataclass(frozen=True)
class FaultValue:
    """A value of the file. Its methods check it, and raise a FaultError that says where it is.

    Attributes:
        source: Where it was read.
        value: What YAML says.
        path: The keys and indices that lead to it.
        about: What it belongs to, for errors, such as ``fault 2 (slip)``.
    """

    source: FaultSource
    value: Any
    path: Tuple[_Step, ...] = ()
    about: str = ""

    @property
    def where(self) -> str:
        """The place, for errors."""
        place = self.source.place(self.path)
        return f"{place}: {self.about}" if self.about else place

    def wrong(self, reason: object) -> FaultError:
        """Returns the error that says why the value is wrong."""
        key = self.path[-1] if self.path and isinstance(self.path[-1], str) else ""
        return FaultError(
            f"{self.where}: {key:.80}: {reason}" if key else f"{self.where}: {reason}"
        )

    def entries(self, *known: str) -> Dict[str, FaultValue]:
        """Returns the entries of a mapping that has these keys, or some of them."""
        if not isinstance(self.value, dict):
            raise self.wrong(f"expected names with values (NAME: VALUE), not {self.value!r:.80}")
        for key in self.value:
            if key not in known:
                wrong = self._child(str(key), None)
                raise FaultError(
                    f"{wrong.where}: there is no entry {key!r:.80}; there are {', '.join(known)}"
                )
        return {key: self._child(key, value) for key, value in self.value.items()}

    def items(self) -> List[FaultValue]:
        """Returns the items of a list."""
        if not isinstance(self.value, list):
            raise self.wrong(f"expected a list, not {self.value!r:.80}")
        return [self._child(index, value) for index, value in enumerate(self.value)]

    def called(self, about: str) -> FaultValue:
        """Returns the same value as a part of something else."""
        return FaultValue(self.source, self.value, self.path, about)

    def number(self, least: float = -math.inf, most: float = math.inf) -> float:
        """Returns a finite number within bounds."""
        value = self.value
        good = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not (good and math.isfinite(value) and least <= value <= most):
            begin = f" from {least:g}" if least > -math.inf else ""
            end = f" to {most:g}" if most < math.inf else ""
            raise self.wrong(f"expected a number{begin}{end}, not {value!r:.80}")
        return float(value)

    def positive(self) -> float:
        """Returns a number greater than 0."""
        number = self.number(0.0)
        if number == 0:
            raise self.wrong("expected a number greater than 0, not 0")
        return number

    def integer(self, least: int) -> int:
        """Returns an integer from some number on."""
        number = self.number(least)
        if not number.is_integer():
            raise self.wrong(f"expected an integer, not {self.value!r:.80}")
        return int(number)

    def flag(self) -> bool:
        """Returns true or false."""
        if not isinstance(self.value, bool):
            raise self.wrong(f"expected true or false, not {self.value!r:.80}")
        return self.value

    def text(self) -> str:
        """Returns a text."""
        if not isinstance(self.value, str) or not self.value:
            raise self.wrong(f"expected a name, not {self.value!r:.80}")
        return self.value

    def choice(self, *words: str) -> str:
        """Returns one of several words."""
        if self.value not in words:
            raise self.wrong(f"expected {' or '.join(words)}, not {self.value!r:.80}")
        return str(self.value)

    def _child(self, step: _Step, value: Any) -> FaultValue:
        return FaultValue(self.source, value, (*self.path, step), self.about)


def load_faults(file: Path) -> FaultValue:
    """Parses a file.

    Raises:
        FaultError: It cannot be read, or is not YAML.
    """
    try:
        text = file.read_text(encoding="utf-8")
        return FaultValue(FaultSource(str(file), text), strict_yaml.load(text))
    except OSError as err:
        raise FaultError(f"{file}: {err.strerror}; check the path (~faults)") from err
    except UnicodeDecodeError as err:
        raise FaultError(f"{file} is not UTF-8 text: {err}; save it as UTF-8") from err
    except yaml.YAMLError as err:
        raise FaultError(f"{file} is not YAML: {err}") from err
