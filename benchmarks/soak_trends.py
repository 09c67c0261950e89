"""Judges whether memory is level and latency flat, by robust lines through samples. Needs no ROS.

A line is that of Theil and Sen: its slope is the median of the slopes of all pairs of samples, so
that some that are far off, such as those of a busy moment, change nothing.
"""

from __future__ import annotations

import statistics
from itertools import combinations
from typing import Dict, List, NamedTuple, Sequence, Tuple

JUDGED_HOURS = 0.5  # of simulated time, that samples have to span to be judged
MOST_MEBIBYTES = 16.0  # that a process may grow by in the whole run, by its line
MOST_RISE, MOST_SECONDS = 0.5, 0.1  # that a latency may rise by: of its median, and at least
MOST_BUSIER = 0.2  # of its median, that the machine may get busier by

_SECONDS_AN_HOUR = 3600.0
_LEAST_SAMPLES = 20  # that are judged
_MOST_SAMPLES = 300  # of which the pairs are taken
_YOUNG_SECONDS = 600.0  # of simulated time, in which a process that has begun may still grow


class Sample(NamedTuple):
    """A value at a time.

    Attributes:
        seconds: When, in simulated time.
        value: In the unit of what was measured.
        life: The process it is of; samples of two processes are not compared.
    """

    seconds: float
    value: float
    life: int = 0


class Trend(NamedTuple):
    """The line through samples.

    Attributes:
        name: What was measured.
        unit: Its unit.
        number: How many samples there are.
        median: Of their values.
        largest: Of their values.
        slope: In the unit per simulated hour; 0 if there are too few samples for a line.
        rise: By how much the line rises from the beginning of the run to its end.
        limit: What it may rise by; 0 if there are too few samples to judge.
    """

    name: str
    unit: str
    number: int
    median: float
    largest: float
    slope: float
    rise: float
    limit: float

    @property
    def is_exceeded(self) -> bool:
        """True if it rises by more than it may."""
        return self.limit > 0 and self.rise > self.limit

    def __str__(self) -> str:
        return (
            f"{self.name} rises by {self.rise:.3g} {self.unit} in the run, "
            f"{self.slope:.3g} {self.unit} an hour; {self.limit:.3g} {self.unit} are allowed"
        )


def memory_trends(samples: Dict[str, List[Sample]], hours: float) -> List[Trend]:
    """Returns the lines through the memory of processes.

    Of each process, the first ten simulated minutes do not count. Two lines are drawn: one over all
    processes of a node, for what each takes more than the one before, and one within their lives,
    as a leak shows itself, which rises from the beginning of the longest life to its end. The one
    that rises by more counts.

    Args:
        samples: In MiB, by the names of the nodes.
        hours: The length of the run, in simulated time.
    """
    trends = []
    for name, taken in sorted(samples.items()):
        began: Dict[int, float] = {}
        for one in taken:
            began.setdefault(one.life, one.seconds)
        ages = [one.seconds - began[one.life] for one in taken]
        grown = [one for one, age in zip(taken, ages) if age >= _YOUNG_SECONDS]
        longest = max(ages, default=0.0) / _SECONDS_AN_HOUR
        over_all = _slope([one._replace(life=0) for one in grown])
        lines = ((over_all * hours, over_all), (_slope(grown) * longest, _slope(grown)))
        rise, slope = max(lines)
        limit = MOST_MEBIBYTES if _is_judged(grown) else 0.0
        median, largest = _figures(taken)
        trends.append(Trend(name, "MiB", len(taken), median, largest, slope, rise, limit))
    return trends


def latency_trends(
    samples: Dict[str, List[Sample]], hours: float, busy: str = "", processor: str = ""
) -> List[Trend]:
    """Returns the lines through latencies, in seconds.

    Args:
        samples: By their names.
        hours: The length of the run, in simulated time.
        busy: The name of the samples of how busy the machine is otherwise. If it gets busier, what
            takes wall time is not judged.
        processor: The name of those that are processor time.
    """
    load = samples.get(busy, [])
    is_quiet = _slope(load) * hours <= MOST_BUSIER * _figures(load)[0] or not load
    trends = []
    for name, taken in sorted(samples.items()):
        slope = _slope(taken)
        median, largest = _figures(taken)
        is_judged = name != busy and (is_quiet or name == processor) and _is_judged(taken)
        limit = max(MOST_SECONDS, MOST_RISE * median) if is_judged else 0.0
        unit = "x" if name == busy else "s"
        rise = slope * hours
        trends.append(Trend(name, unit, len(taken), median, largest, slope, rise, limit))
    return trends


def _figures(samples: Sequence[Sample]) -> Tuple[float, float]:
    """Returns median and maximum."""
    values = [one.value for one in samples] or [0.0]
    return statistics.median(values), max(values)


def _is_judged(samples: Sequence[Sample]) -> bool:
    return (
        len(samples) >= _LEAST_SAMPLES
        and samples[-1].seconds - samples[0].seconds >= JUDGED_HOURS * _SECONDS_AN_HOUR
    )


def _slope(samples: Sequence[Sample]) -> float:
    """Returns the slope of the line of Theil and Sen, for an hour; 0 if there is none."""
    few = samples[:: 1 + len(samples) // _MOST_SAMPLES]
    slopes = [
        (two.value - one.value) / (two.seconds - one.seconds) * _SECONDS_AN_HOUR
        for one, two in combinations(few, 2)
        if one.life == two.life and two.seconds > one.seconds
    ]
    return statistics.median(slopes) if slopes else 0.0
