"""What the loop adds to each encoding of a planner, to see what it needs of it."""

from __future__ import annotations

from rosclingo.wire import commands as wire

HAS = "rosoclingo_has"
"""A term that is shown with an answer set in which there is an atom, be that shown or not."""

SEEN = {"do": 3, "status": 3}
"""What rosoclingo has to see of an answer set, with the number of arguments."""

_SHOWS = " ".join(
    f"#defined {name}/{arity}. #show {HAS}({name}) : {name}({'_,' * (arity - 1)}t)."
    for name, arity in SEEN.items()
)
EMPTY_PARTS = (
    wire.Add("state", ("t",), ""),
    wire.Add("transition", ("t",), ""),
    wire.Add("query", ("t",), _SHOWS),
)
"""What lets an encoding leave out a part that it does not need, and tells what it hides."""

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
"""How an external begins that is declared for each slot: so a solver node shows the slots."""

SLOTS = wire.Add(SLOT_PART, (), f"#defined rslot/1. #external {SLOT}ID) : rslot(ID).")
"""The part :data:`SLOT_PART`, which declares them."""
