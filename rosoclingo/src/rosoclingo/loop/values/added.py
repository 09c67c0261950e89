"""Program parts that the loop adds to each encoding: empty defaults, and probes of its atoms."""

from __future__ import annotations

from rosclingo.wire import commands as wire

HAS = "rosoclingo_has"
"""A term that is shown with an answer set in which there is an atom, be that shown or not."""

SEEN = {"do": 3, "status": 3}
"""The predicates that an answer set has to show to rosoclingo, with their arities."""

_SHOWS = " ".join(
    f"#defined {name}/{arity}. #show {HAS}({name}) : {name}({'_,' * (arity - 1)}t)."
    for name, arity in SEEN.items()
)
EMPTY_PARTS = (
    wire.Add("state", ("t",), ""),
    wire.Add("transition", ("t",), ""),
    wire.Add("query", ("t",), _SHOWS),
)
"""Empty defaults for parts that an encoding lacks, and a probe that finds hidden predicates."""

STILL_PART = "rosoclingo_still"
"""The part, and the external in it, that forbids actions in a step if it is true."""

STILL = wire.Add(
    STILL_PART,
    ("t",),
    f"#defined do/3. #external {STILL_PART}(t). :- {STILL_PART}(t), do(_,_,t).",
)
"""The part :data:`STILL_PART`, which an encoding gets when a shorter plan is looked for."""

SLOT_PART = "rosoclingo_slot"
SLOT = f"{SLOT_PART}("
"""Prefix of the external that is declared for each slot, so that a solver node lists the slots."""

SLOTS = wire.Add(SLOT_PART, (), f"#defined rslot/1. #external {SLOT}ID) : rslot(ID).")
"""The part :data:`SLOT_PART`, which declares them."""
