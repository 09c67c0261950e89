"""Command lines with terms as values, whose other options are clingo's.

>>> parser = OptionParser(allow_abbrev=False)
>>> _ = parser.add_argument("--goal")
>>> parser.parse_known_args(["line.lp", "--goal", "-visit(2)", "-c", "steps=9"])
(Namespace(goal='-visit(2)'), ['line.lp', '-c', 'steps=9'])
"""

from __future__ import annotations

import argparse
import sys
from typing import Any, Dict, List, Optional, Sequence, Tuple

_MARK = "\0"  # before a value that begins with a dash, since a command line has no such character


class OptionParser(argparse.ArgumentParser):
    """A parser whose options take the next word as their value, also if it begins with a dash.

    A word that begins with two dashes, or is an option of the parser, is no value: one was
    forgotten. Options are long ones, and take a fixed number of values.
    """

    def split(self, words: Sequence[str]) -> Tuple[List[str], List[str]]:
        """Returns the parser's own options with their values, and all other words."""
        own: List[str] = []
        others: List[str] = []
        numbers = self._numbers_of_values()
        left = 0  # values that the last option still lacks
        for word in words:
            name, equals, _ = word.partition("=")
            if name in numbers:
                left = 0 if equals else numbers[name]
                own.append(word)
            elif left > 0 and not word.startswith("--"):
                left -= 1
                own.append(word)
            else:
                left = 0
                others.append(word)
        return own, others

    def parse_known_args(
        self, args: Optional[Sequence[str]] = None, namespace: Any = None
    ) -> Tuple[Any, List[str]]:
        """Reads the parser's own options, and returns all other words."""
        own, others = self.split(sys.argv[1:] if args is None else args)
        options = self._numbers_of_values()
        marked = [
            word
            if word.partition("=")[0] in options or not word.startswith("-")
            else f"{_MARK}{word}"
            for word in own
        ]
        read, extra = super().parse_known_args(marked, namespace)
        return read, [*extra, *others]

    def _numbers_of_values(self) -> Dict[str, int]:
        """Returns how many values each option takes."""
        return {
            name: action.nargs if isinstance(action.nargs, int) else 1
            for action in self._actions
            for name in action.option_strings
        }

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        """Takes the mark away, before the value is converted."""
        return super()._get_value(action, arg_string.lstrip(_MARK))
