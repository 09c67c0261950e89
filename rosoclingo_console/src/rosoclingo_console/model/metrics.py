"""Counters of a run, and their text for Prometheus.

>>> print(exposition({"/r": [Sample("rosoclingo_up", 1)]}), end="")
# HELP rosoclingo_up Whether the console has a connection from the planning node.
# TYPE rosoclingo_up gauge
rosoclingo_up{system="/r"} 1
"""

from __future__ import annotations

from collections import defaultdict
from typing import DefaultDict, Dict, List, Mapping, NamedTuple, Sequence, Tuple

from rosoclingo.loop import journal


class Sample(NamedTuple):
    """A value of a metric.

    Attributes:
        name: That of the metric, of which :data:`METRICS` knows type and meaning.
        value: The value.
        labels: Names and values of further labels.
    """

    name: str
    value: float
    labels: Tuple[Tuple[str, str], ...] = ()


METRICS: Mapping[str, Tuple[str, str]] = {
    "rosoclingo_up": ("gauge", "Whether the console has a connection from the planning node."),
    "rosoclingo_paused": ("gauge", "Whether an operator has paused the run."),
    "rosoclingo_step": ("gauge", "The current step."),
    "rosoclingo_horizon": ("gauge", "The horizon that is planned for."),
    "rosoclingo_goals_open": ("gauge", "Goals that have not ended."),
    "rosoclingo_goals_waiting": ("gauge", "Open goals that have no slot."),
    "rosoclingo_actions_open": ("gauge", "Actions without an answer."),
    "rosoclingo_actions_held": ("gauge", "Actions that wait for an operator."),
    "rosoclingo_goals_total": ("counter", "Goals that have ended, by their last status."),
    "rosoclingo_answers_total": ("counter", "Answers of actuators, by their value."),
    "rosoclingo_events_total": ("counter", "Events of the journal, by their kind."),
    "rosoclingo_events_missed_total": ("counter", "Events that did not reach the console."),
    "rosoclingo_search_seconds": ("summary", "Wall time of the planner's searches."),
    "rosoclingo_command_seconds": ("summary", "Wall time of all commands but searches and waits."),
    "rosoclingo_console_pages": ("gauge", "Pages that are open."),
    "rosoclingo_console_slow_pages_total": ("counter", "Pages that were closed as too slow."),
}  # fmt: skip
"""The type of each metric, and what it means."""

OTHER = "other"
"""The label of what is not counted one by one."""


class Counters:
    """Counts the events of one run. Not thread-safe."""

    def __init__(self) -> None:
        self._events: Dict[str, int] = {}
        self._seconds: DefaultDict[str, List[float]] = defaultdict(lambda: [0.0, 0.0])

    def count(self, event: journal.Event) -> None:
        """Counts an event."""
        kind = "unknown" if isinstance(event, journal.Unknown) else journal.encode(event).kind
        self._events[kind] = self._events.get(kind, 0) + 1
        if isinstance(event, journal.CommandDone) and not event.waits:
            name = "rosoclingo_search_seconds" if event.is_search else "rosoclingo_command_seconds"
            both = self._seconds[name]
            both[0] += event.seconds
            both[1] += 1

    def samples(self) -> List[Sample]:
        """Returns what was counted."""
        found = counted("rosoclingo_events_total", "kind", self._events)
        for name, (seconds, count) in self._seconds.items():
            found += [Sample(f"{name}_sum", seconds), Sample(f"{name}_count", count)]
        return found


def counted(name: str, label: str, counts: Mapping[str, int]) -> List[Sample]:
    """Returns a sample for each value of a label."""
    return [Sample(name, count, ((label, value),)) for value, count in counts.items()]


def exposition(samples: Mapping[str, Sequence[Sample]]) -> str:
    """Returns the text that Prometheus reads, in its format 0.0.4.

    Args:
        samples: Those of each system, by its name; those of the console itself by an empty one.
    """
    lines: DefaultDict[str, List[str]] = defaultdict(list)
    for system, ones in samples.items():
        for one in ones:
            labels = [("system", system)] if system else []
            text = ",".join(f'{key}="{_escaped(word)}"' for key, word in [*labels, *one.labels])
            family = one.name
            for ending in ("_sum", "_count"):
                if family not in METRICS and family.endswith(ending):
                    family = family[: -len(ending)]
            within = f"{{{text}}}" if text else ""
            lines[family].append(f"{one.name}{within} {one.value:.15g}\n")
    return "".join(
        f"# HELP {name} {METRICS[name][1]}\n# TYPE {name} {METRICS[name][0]}\n{''.join(values)}"
        for name, values in sorted(lines.items())
    )


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
