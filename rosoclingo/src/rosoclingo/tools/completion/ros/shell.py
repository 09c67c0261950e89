"""Offers bash the words of ``rosrun rosoclingo why.py``: called at each TAB, and prints them."""

from __future__ import annotations

import sys
from typing import Sequence

from rosoclingo.tools.completion.questions import question_words
from rosoclingo.tools.completion.shell_line import parse_shell_line

_PROGRAM = "why.py"


def main() -> None:
    """Prints what may be inserted, a line each.

    The command line is what is typed up to the cursor, and ``COMP_WORDBREAKS``.
    """
    typed = parse_shell_line(*sys.argv[1:3])
    words = typed.words[typed.words.index(_PROGRAM) + 1 :]

    def values_of(option: str) -> Sequence[str]:
        # It takes some tenths of a second to import.
        from rosoclingo.tools.completion.ros.glance import values_of  # noqa: PLC0415

        return values_of(option, words)

    for one in typed.insertions(question_words(words, typed.begun, values_of)):
        print(one)
