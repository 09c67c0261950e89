#!/usr/bin/env python3
"""Solves the blocks world with a growing horizon; a client of a solver node, to read and to copy.

In three terminals, with the workspace sourced and E=$(rospack find rosclingo)/example:

    roscore
    rosrun rosclingo run.py -f $E/instance.lp -f $E/itoh.lp
    python $E/istart.py

It goes on for ever if there is no plan of any length; Ctrl-C ends it.
"""

import sys

from rosclingo.errors import RosclingoError
from rosclingo.ros.client import Client
from rosclingo.ros.init import init_node
from rosclingo.solver.terms import parse_term
from rosclingo.wire.commands import AssignExternal, Ground, Outcome, Part, Restart, Result, Truth


def plan(solver: Client) -> Outcome:
    """Lets the horizon grow until there is a plan."""
    horizon = 0
    solver.control(
        Restart(),  # undoes what other clients did
        Ground((Part("base"), Part("state", ("0",)), Part("query", ("0",)))),
        AssignExternal("query(0)", Truth.TRUE),
    )
    while True:
        print("solving with horizon", horizon, flush=True)
        outcome = solver.solve()
        if outcome.result is not Result.UNSAT:
            return outcome
        # One request does it all: what is no longer asked, the next step, and what is asked now.
        horizon += 1
        step = (str(horizon),)
        solver.control(
            AssignExternal(f"query({horizon - 1})", Truth.FALSE),
            Ground((Part("state", step), Part("transition", step), Part("query", step))),
            AssignExternal(f"query({horizon})", Truth.TRUE),
        )


def main() -> None:
    init_node("istart", anonymous=True)
    solver = Client("rosclingo")
    solver.wait()
    outcome = plan(solver)

    # The last argument of do(arm,pickup(4),1) is the step.
    actions = sorted(outcome.symbols, key=lambda atom: parse_term(atom).arguments[-1])
    print("##### result")
    print("result:", outcome.result.value)
    print("interrupted:", outcome.interrupted)
    print("answerset:", actions)
    print("#####")


if __name__ == "__main__":
    try:
        main()
    except RosclingoError as error:
        sys.exit(f"istart.py: {error}")
