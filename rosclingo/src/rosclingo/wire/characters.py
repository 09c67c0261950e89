r"""Checks texts for characters that XML cannot carry to a solver node.

This needs no XML itself, so that who only checks a text needs no parser.

>>> carried("a\0b"), check_text("go(c3)")
('a�b', 'go(c3)')
"""

from __future__ import annotations

import re

from rosclingo.errors import XmlError

# The others are many more, for which re would take 3 ms of each process.
_ILLEGAL = re.compile("[\0-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")


def carried(text: str) -> str:
    """Returns a text with a replacement character for each one that XML cannot carry."""
    return _ILLEGAL.sub("\ufffd", text)


def check_text(text: str) -> str:
    """Returns a text that XML can carry.

    Raises:
        XmlError: It has a control character, or another that XML has no way to write.
    """
    match = _ILLEGAL.search(text)
    if match:
        raise XmlError(f"XML cannot carry the character {match.group()!r}; remove it")
    return text
