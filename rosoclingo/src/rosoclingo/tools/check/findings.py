"""Findings, each with the command that reproduces it."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from typing import Tuple

Words = Tuple[str, ...]
"""The arguments of ``plan.py``, as a user types them."""


@dataclass(frozen=True)
class Finding:
    """A fault of an encoding, with the command that reproduces it.

    Attributes:
        check: The name of what was checked, as in docs/check.md.
        text: What is wrong, in a sentence.
        place: Where, as ``FILE:LINE``; empty if it is no place in a file.
        commands: The arguments of ``plan.py`` that show it; two if two runs contradict each other.
        is_hint: Whether it only may be wrong.
    """

    check: str
    text: str
    place: str = ""
    commands: Tuple[Words, ...] = ()
    is_hint: bool = False

    @property
    def key(self) -> Tuple[str, str, str]:
        """The identity of a finding, by which duplicates are dropped, whatever their runs."""
        return (self.check, self.place, "" if self.commands else self.text)

    def __str__(self) -> str:
        place = f"{self.place}: " if self.place else ""
        check = f"{self.check} (a hint)" if self.is_hint else self.check
        return "\n".join([f"{place}{check}: {self.text}", *map(typed, self.commands)])


def typed(words: Words) -> str:
    """Returns the command ``plan.py`` as it is typed."""
    return f"    plan.py {' '.join(map(shlex.quote, words))}"
