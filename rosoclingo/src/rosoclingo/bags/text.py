"""Texts of bags, which may be anybody's: compared, and safe on a terminal. Needs no ROS."""

from __future__ import annotations

import sys


def one_line(text: str) -> str:
    """Returns a text with all that is not printable escaped, line ends and tabs too."""
    return "".join(map(_escaped, text))


def lines(text: str) -> str:
    """Returns a text with all that is not printable escaped, but for line ends and tabs."""
    return "".join(letter if letter in "\n\t" else _escaped(letter) for letter in text)


def compact(text: str) -> str:
    """Returns a term without spaces, which compares it with one that clingo prints."""
    return "".join(text.split())


def say(program: str, text: str) -> None:
    """Prints a message of a program on stderr, which may have texts of a bag."""
    print(lines(f"{program}: {text}"), file=sys.stderr)


def _escaped(letter: str) -> str:
    return letter if letter.isprintable() else letter.encode("unicode_escape").decode("ascii")
