"""What an atom's text tells without clingo, so that a bag can be read where there is none."""

from __future__ import annotations

import re
from typing import Optional

_LAST_ARGUMENT = re.compile(r"[,(](-?\d{1,10})\)\Z")  # clingo's numbers have no more digits


def last_argument(atom: str) -> Optional[int]:
    """Returns the step that is the last argument of an atom, as clingo prints it."""
    match = _LAST_ARGUMENT.search(atom)
    return int(match.group(1)) if match else None
