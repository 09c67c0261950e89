"""Checks observers' terms against the messages that an encoding declares. Needs no ROS."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Collection, Iterable, Iterator

from rosclingo.solver.terms import quote
from rosoclingo.loop.values.ids import type_event
from rosoclingo_interfaces.observation.observer import Observer

_SHOWN = 3  # terms of one observer


def unknown_terms(observers: Iterable[Observer], messages: Collection[str]) -> Iterator[str]:
    """Yields a warning for each observer with a term that an encoding does not declare.

    Args:
        observers: All of them.
        messages: What the encoding knows, as ``info:blocked(c3,c4)``.
    """
    for observer in observers:
        said = [type_event(observer.source, term) for term in observer.terms]
        unknown = [one for one in said if one not in messages]
        if not unknown:
            continue
        near = get_close_matches(unknown[0], messages, n=1, cutoff=0.0)
        shown = ", ".join(map(quote, unknown[:_SHOWN])) + (", ..." if len(unknown) > _SHOWN else "")
        like = f"; the nearest that it knows is {quote(near[0])}" if near else "; it knows none"
        yield (
            f"{observer.entry.file}, line {observer.entry.line}: the planner's encoding does not "
            f"know {shown}, which is dropped when it is told{like}"
        )
