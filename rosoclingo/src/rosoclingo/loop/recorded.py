"""Recorded outcomes of searches, which a replay takes instead of searching."""

from __future__ import annotations

from typing import Optional

from rosoclingo.loop.journal import Ended, SearchEnded


class RecordedSearches:
    """Recorded outcomes of time-dependent searches; this class has none, as a new run.

    A replay's inbox has them. Thread-safe.
    """

    @property
    def knows_searches(self) -> bool:
        """Whether all such outcomes are recorded, so that time ends no search."""
        return False

    def search_due(self, *ways: Ended, number: int = 0) -> Optional[SearchEnded]:
        """Returns how the next of these searches ends, and removes it.

        Args:
            ways: In which of these ways.
            number: How many answer sets have asked for something before, in the same search.

        Returns:
            None if the next one ends otherwise, or if there is none before the next decision.
        """
        return None

    def is_search_due(self, *, improves: bool) -> bool:
        """Whether an outcome is recorded before the next decision; removes nothing.

        Args:
            improves: Whether the next one is to be for a better plan, or for a plan.
        """
        return False
