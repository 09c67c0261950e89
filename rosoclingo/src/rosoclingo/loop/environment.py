"""The world that the loop speaks to."""

from __future__ import annotations

import time
from typing import Sequence

from rosoclingo.loop.atoms import Action
from rosoclingo.loop.journal import Record


class Environment:
    """The world that the loop speaks to; a node overrides the methods."""

    def now(self) -> float:
        """Returns the time by which actuators answer, in seconds; it never goes back."""
        return time.monotonic()

    def publish(self, actuator: str, action: str) -> None:
        """Sends an action, or with the id ``solver`` a whole plan."""

    def show_plan(self, step: int, horizon: int, actions: Sequence[Action]) -> None:
        """Shows what is planned, from the current step on."""

    def note(self, record: Record) -> None:
        """Adds an event to the journal; may be called from any thread."""

    def info(self, text: str) -> None:
        """Logs what is worth to know, for commands of one's own."""

    def warn(self, text: str) -> None:
        """Logs what was dropped or looks wrong."""
