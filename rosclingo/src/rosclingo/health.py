"""Health of a node's parts, as it is reported on ``/diagnostics``; decided without ROS.

>>> Health("loop", HealthLevel.WARN, "paused by an operator", (("step", "3"),)).level.name
'WARN'
>>> number(1.23456), number(None)
('1.235', 'unknown')
"""

from __future__ import annotations

import enum
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Optional, Tuple

PERIOD_SECONDS = 1.0
"""How often nodes report their health, by default."""

SLOW_SECONDS = 30.0
"""After how long a request, a search or a decision that goes on is slow, by default."""

_STATM = Path("/proc/self/statm")
_BYTES_PER_MEGABYTE = 1e6


class HealthLevel(enum.IntEnum):
    """Levels, with the numbers of ``diagnostic_msgs/DiagnosticStatus``.

    There is no level for what is stale: the reader of ``/diagnostics`` finds that.
    """

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True)
class Health:
    """The health of one part of a node.

    Attributes:
        name: The part, such as ``loop``.
        level: How it is.
        message: Why, in a line.
        values: Numbers and words, by what they are.
    """

    name: str
    level: HealthLevel
    message: str
    values: Tuple[Tuple[str, str], ...] = ()


def number(value: Optional[float]) -> str:
    """Returns a number as text, such as of seconds, with three decimals; None is unknown."""
    return "unknown" if value is None else f"{value:.3f}"


def since(time: Optional[float], now: float) -> Optional[float]:
    """Returns how many seconds ago a time was, at least 0; None if it is not known."""
    return None if time is None else max(0.0, now - time)


def resident_megabytes(statm: Path = _STATM) -> Optional[float]:
    """Returns the resident memory of this process in MB; None where there is no ``/proc``."""
    try:
        pages = int(statm.read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return None
    return pages * os.sysconf("SC_PAGE_SIZE") / _BYTES_PER_MEGABYTE
