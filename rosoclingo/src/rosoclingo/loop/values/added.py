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

PAUSES_PART = "rosoclingo_pauses"
"""The part, with an argument for the step, that can limit in which steps there are actions."""

STILL = "rosoclingo_still"
"""The external of a step that forbids actions in it if it is true."""

UNBROKEN = "rosoclingo_unbroken"
"""The external of a step that forbids actions after a step without any if it is true."""

PAUSES = wire.Add(
    PAUSES_PART,
    ("t",),
    "#defined do/3. rosoclingo_acts(t) :- do(_,_,t). #defined rosoclingo_acts/1."
    f" #external {STILL}(t). :- {STILL}(t), rosoclingo_acts(t)."
    f" #external {UNBROKEN}(t). :- {UNBROKEN}(t), rosoclingo_acts(t), not rosoclingo_acts(t-1).",
)
"""The part ``PAUSES_PART``, which an encoding gets when horizons take turns."""

AVOIDS = "rosoclingo_avoids"
"""The external that forbids an action in some steps, with a number for an argument; and its part,
whose other arguments are the actuator, the action and one of the steps."""

AVOIDS_PART = wire.Add(
    AVOIDS,
    ("n", "r", "a", "t"),
    f"#defined do/3. #external {AVOIDS}(n). :- {AVOIDS}(n), do(r,a,t).",
)
"""The part ``AVOIDS``, which an encoding gets when an action is held whose goal is cancelled."""

SLOT_PART = "rosoclingo_slot"
SLOT = f"{SLOT_PART}("
"""Prefix of the external that is declared for each slot, so that a solver node lists the slots."""

SLOTS = wire.Add(SLOT_PART, (), f"#defined rslot/1. #external {SLOT}ID) : rslot(ID).")
"""The part ``SLOT_PART``, which declares them."""
