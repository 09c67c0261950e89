"""Announces terms when a condition on a topic's messages begins or ends to hold. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional, Tuple, Union

from rosoclingo_interfaces.errors import EntryError
from rosoclingo_interfaces.observation.closed_way import ClosedWay
from rosoclingo_interfaces.observation.conditions import (
    CovarianceCondition,
    EqualsCondition,
    PatternCondition,
    RangeCondition,
    SilenceCondition,
    ValueCondition,
)
from rosoclingo_interfaces.observation.fields import Slots
from rosoclingo_interfaces.observation.places import NearestWaypoint
from rosoclingo_interfaces.observation.teller import Teller
from rosoclingo_interfaces.observation.yaml_entry import YamlEntry

Condition = Union[
    RangeCondition, PatternCondition, EqualsCondition, ValueCondition, CovarianceCondition,
    SilenceCondition, NearestWaypoint, ClosedWay,
]  # fmt: skip


@dataclass
class Observer:
    """An entry of the file of observers. Not thread-safe.

    Attributes:
        entry: Where it is in the file, for errors.
        topic: What it listens to; empty if it takes a pose from transforms only.
        type: The type of the messages, if the file says it.
        source: The id with which terms are told.
        condition: What has to hold.
        teller: When which term is told.
        terms: All terms that it can tell; empty if they depend on a value.
    """

    entry: YamlEntry
    topic: str
    type: str
    source: str
    condition: Condition
    teller: Teller
    terms: Tuple[str, ...]
    _heard: Optional[float] = None  # when something came last

    @property
    def name(self) -> str:
        """Its topic and its line, for messages."""
        return f"{self.topic or 'tf'} (line {self.entry.line})"

    @property
    def needs_type(self) -> bool:
        """True if the type of its messages has to be known."""
        return bool(self.topic) and not isinstance(self.condition, SilenceCondition)

    def check(self, message: str, slots: Slots) -> None:
        """Checks the condition against the type of the topic's messages.

        Raises:
            EntryError: They do not fit; the message names the line.
        """
        try:
            self.condition.check(message, slots)
        except EntryError as err:
            raise self.entry.wrong(err, "field") from err

    def hear(self, message: Any, now: float) -> None:
        """Takes a message; None for new transforms.

        Args:
            message: As ROS has it.
            now: The time in seconds.

        Raises:
            ReadingError: It does not say whether the condition holds.
        """
        if isinstance(self.condition, SilenceCondition):
            self._heard = now or None  # a simulator's clock that has not begun is 0
        else:
            self.teller.read(self.condition.read(message, self.teller.reading), now)

    def tick(self, now: float) -> Optional[str]:
        """Returns the term that is due to be announced, if there is one.

        Raises:
            TermError: A waypoint's name makes no term.
        """
        if isinstance(self.condition, SilenceCondition):
            if self._heard is None or now < self._heard:  # it begins, or the clock begins anew
                self._heard = now
            self.teller.read(self.condition.read(now - self._heard, None), now)
        return self.teller.due(now)
