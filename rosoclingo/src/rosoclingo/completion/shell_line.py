r"""Parser of a line of bash up to the cursor, and quoting of what is inserted there.

>>> typed = parse_shell_line("why.py --if goal:bri", " \"'=:")
>>> typed.words, typed.begun
(('why.py', '--if'), 'goal:bri')
>>> typed.insertions(["goal:bring(1,3)", "cancel:1"])
["'bring(1,3)'"]
>>> parse_shell_line("why.py --goal 'say(\"$", " \"'=:").insertions(['say("$(id)")'])
['say("$(id)")']
"""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from typing import Iterable, List, Tuple

_BLANKS = " \t\n"
_ESCAPED = '$`"\\'  # what a backslash is for between double quotes
_BETWEEN_DOUBLE = str.maketrans({**{one: f"\\{one}" for one in _ESCAPED}, "!": "\"'!'\""})


@dataclass(frozen=True)
class ShellLine:
    """A command line while it is typed.

    Attributes:
        words: The complete words, without their quotes.
        begun: The word at the cursor, without its quotes; it may be empty.
        kept: How many characters of that readline leaves as they are, and does not replace.
        quote: The quote that is open; empty if none is.
    """

    words: Tuple[str, ...]
    begun: str
    kept: int
    quote: str

    def insertions(self, candidates: Iterable[str]) -> List[str]:
        """Returns what readline is to insert for those words that the one at the cursor begins.

        They stand for themselves, whatever is in them. Those that a terminal would not show as
        they are, such as with control characters, are left out.
        """
        return [
            self._quoted(word[self.kept :])
            for word in candidates
            if word.startswith(self.begun) and word.isprintable()
        ]

    def _quoted(self, text: str) -> str:
        if self.quote == "'":
            return text.replace("'", "'\\''")
        return text.translate(_BETWEEN_DOUBLE) if self.quote else shlex.quote(text)


def parse_shell_line(line: str, breaks: str) -> ShellLine:
    """Parses a line up to the cursor.

    Args:
        line: A simple command, as bash has it in ``COMP_LINE``.
        breaks: The characters after which readline begins a word, ``COMP_WORDBREAKS``.
    """
    words: List[str] = []
    begun, kept, quote, is_word = "", 0, "", False
    characters = iter(line)
    for one in characters:
        if quote:
            if one == quote:
                quote, kept = "", len(begun)
            elif one == "\\" and quote == '"':
                following = next(characters, "")
                begun += following if following and following in _ESCAPED else one + following
            else:
                begun += one
        elif one in _BLANKS:
            if is_word:
                words.append(begun)
            begun, kept, is_word = "", 0, False
            continue
        elif one in "'\"":
            quote, kept = one, len(begun)
        elif one == "\\":
            begun += next(characters, "")
        else:
            begun += one
            if one in breaks:
                kept = len(begun)
        is_word = True
    return ShellLine(tuple(words), begun, kept, quote)
