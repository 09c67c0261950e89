"""A controller that survives the loss of its solver."""

from __future__ import annotations

from typing import Optional

import clingo

from rosoclingo.loop.mode.controller import Decider, Info
from rosoclingo.store.commands import Back, again


class LastingController:
    """Restores the controller in another solver when one was lost, and retries the call."""

    def __init__(self, decider: Decider, back: Back) -> None:
        """Wraps a controller.

        Args:
            decider: Decides.
            back: Has its solver be there again after an error.
        """
        self._decider = decider
        self._back = back

    @property
    def dynamic(self) -> bool:
        """Whether the mode takes messages and goals."""
        return self._decider.dynamic

    @property
    def last_horizon(self) -> Optional[float]:
        """The last horizon that it may ask for."""
        return self._decider.last_horizon

    def snapshot(self) -> str:
        """Returns all that it keeps from one decision to the next."""
        return self._decider.snapshot()

    def restore(self, saved: str) -> None:
        """Begins anew, and goes on from a snapshot."""
        again(lambda: self._decider.restore(saved), self._back, lambda: None)

    def prepare(self) -> None:
        """Begins anew."""
        again(self._decider.prepare, self._back, lambda: None)

    def decide(self, info: Info) -> clingo.Symbol:
        """Returns the next command."""
        return again(lambda: self._decider.decide(info), self._back, self._go_on)

    def look_ahead(self, info: Info) -> None:
        """May precompute the next decision in the background."""
        self._decider.look_ahead(info)

    def describe(self, info: Info) -> str:
        """Describes the inputs of the last decision."""
        return self._decider.describe(info)

    def check(self) -> None:
        """Checks that the solver is there, and restores another one if not."""
        again(self._decider.check, self._back, self._go_on)

    def _go_on(self) -> None:
        # A decision that has failed has changed nothing of it.
        self._decider.restore(self._decider.snapshot())
