"""Makes clingo's solvers, and collects their messages."""

from __future__ import annotations

from typing import Any, List, Sequence, cast

import clingo

from rosclingo.errors import OptionsError
from rosclingo.solver.patches import decode_all_messages

decode_all_messages()


def new_control(
    options: Sequence[str], messages: ClingoMessages, *, has_heuristics: bool = False
) -> clingo.Control:
    """Makes a solver.

    Args:
        options: Those of the command line.
        messages: Collects clingo's messages.
        has_heuristics: Whether its program has ``#heuristic`` statements, as encodings for planning
            have. Those have many small cardinality constraints, and rewriting these takes longer
            than it saves, so it is off unless the command line says something else.

    Raises:
        OptionsError: clingo refuses an option.
    """
    says_more = any(option.startswith(("--trans-ext", "--config")) for option in options)
    added = [] if says_more or not has_heuristics else ["--trans-ext=no"]
    try:
        return clingo.Control([*options, *added], logger=messages)
    except RuntimeError as err:
        detail = messages.text() or str(err)
        raise OptionsError(f"clingo refuses the options {' '.join(options)}: {detail}") from err


def use_heuristics(control: clingo.Control, options: Sequence[str]) -> None:
    """Makes a solver use the ``#heuristic`` statements of its program.

    clingo ignores them otherwise.

    Args:
        control: The solver.
        options: Those that it was made with; if they name a heuristic, that one stays.
    """
    if not any(option.startswith("--heu") for option in options):
        cast(Any, control.configuration.solver).heuristic = "Domain"


class ClingoMessages:
    """Collects clingo's messages; an instance serves as its logger.

    Nothing may be raised from here: it would end the process.
    """

    def __init__(self) -> None:
        self._messages: List[str] = []

    def __call__(self, code: clingo.MessageCode, message: str) -> None:
        """Collects a message."""
        self._messages.append(message.strip())

    def text(self) -> str:
        """Returns the messages collected so far and forgets them."""
        text = "\n".join(self._messages)
        self._messages.clear()
        return text
