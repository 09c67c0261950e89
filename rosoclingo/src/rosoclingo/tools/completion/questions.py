"""The words of ``why.py``: its options, and the values of those that name what a system has.

>>> list(question_words(["--goal"], "", lambda option: ["1", "visit(3)"]))
['1', 'visit(3)']
"""

from __future__ import annotations

from typing import Callable, Iterable, Sequence

GOAL, ACTION = "--goal", "--action"
_WITH_VALUE = (GOAL, ACTION, "--instead", "--if", "--happened")
_OPTIONS = (*_WITH_VALUE, "--json", "--help")


def question_words(
    words: Sequence[str], begun: str, values_of: Callable[[str], Sequence[str]]
) -> Iterable[str]:
    """Returns the words that may stand at the cursor.

    Args:
        words: The words of the command line before that at the cursor.
        begun: The beginning of the word at the cursor.
        values_of: Returns the values that an option can have.
    """
    name, equals, _ = begun.partition("=")
    option = name if equals else words[-1] if words else ""
    if option not in _WITH_VALUE:
        return _OPTIONS
    values = values_of(option) if option in (GOAL, ACTION) else []
    return [f"{option}={one}" for one in values] if equals else values
