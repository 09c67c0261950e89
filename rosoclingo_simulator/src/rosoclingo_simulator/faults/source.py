"""The text of a file of faults, and its values, each with its line for errors."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Dict, List, Optional, Union

import yaml

from rosclingo import strict_yaml
from rosoclingo_simulator.errors import FaultError


@dataclass(frozen=True)
class FaultValue:
    """A value of the file. Its methods check it, and raise a FaultError that says where it is.

    Attributes:
        source: The file, or the parameter.
        value: What YAML says.
        node: What PyYAML has composed of it; None if it was not composed.
        line: Where its key or it begins, from 1 on; None for a value that was parsed before.
        key: Its key in a mapping; empty if it has none.
        about: What it belongs to, for errors, such as ``fault 2 (slip)``.
    """

    source: str
    value: Any
    node: Optional[yaml.Node] = None
    line: Optional[int] = None
    key: str = ""
    about: str = ""

    @property
    def where(self) -> str:
        """The place, for errors."""
        place = self.source if self.line is None else f"{self.source}, line {self.line}"
        return f"{place}: {self.about}" if self.about else place

    def wrong(self, reason: object) -> FaultError:
        """Returns the error that says why the value is wrong."""
        key = f"{self.key:.80}: " if self.key else ""
        return FaultError(f"{self.where}: {key}{reason}")

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
        return replace(self, about=about)

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
        """Returns a text that is not empty."""
        if not isinstance(self.value, str) or not self.value:
            raise self.wrong(f"expected a name, not {self.value!r:.80}")
        return self.value

    def choice(self, *words: str) -> str:
        """Returns one of several words."""
        if self.value not in words:
            raise self.wrong(f"expected {' or '.join(words)}, not {self.value!r:.80}")
        return str(self.value)

    def _child(self, step: Union[str, int], value: Any) -> FaultValue:
        """Returns an entry or an item; an entry that is merged into a mapping has its line."""
        key = node = None
        if isinstance(self.node, yaml.MappingNode):
            pairs = (pair for pair in self.node.value if pair[0].value == step)
            key, node = next(pairs, (None, None))
        elif isinstance(self.node, yaml.SequenceNode):
            key = node = self.node.value[step]
        line = self.line if key is None else key.start_mark.line + 1
        name = step if isinstance(step, str) else ""
        return FaultValue(self.source, value, node, line, name, self.about)


def load_faults(file: Path) -> FaultValue:
    """Parses a file.

    Raises:
        FaultError: It cannot be read, or is not YAML.
    """
    try:
        text = file.read_text(encoding="utf-8")
        return FaultValue(str(file), strict_yaml.load(text), strict_yaml.compose(text), line=1)
    except OSError as err:
        raise FaultError(f"{file}: {err.strerror}; check the path (~faults)") from err
    except UnicodeDecodeError as err:
        raise FaultError(f"{file} is not UTF-8 text: {err}; save it as UTF-8") from err
    except yaml.YAMLError as err:
        raise FaultError(f"{file} is not YAML: {err}") from err
