#!/usr/bin/env python3
"""Solves the blocks world in one shot; a client of a solver node, to read and to copy.

In three terminals, with the workspace sourced and E=$(rospack find rosclingo)/example:

    roscore
    rosrun rosclingo run.py -f $E/instance.lp -f $E/toh.lp
    python $E/start.py
"""

import sys

from rosclingo.errors import RosclingoError
from rosclingo.ros.client import Client
from rosclingo.ros.init import init_node
from rosclingo.solver.terms import parse_term
from rosclingo.wire.commands import Ground, Part, Restart


def main() -> None:
    init_node("start", anonymous=True)
    solver = Client("rosclingo")
    solver.wait()

    # A restart undoes what other clients did. The node has its files then, but has grounded
    # nothing: what to ground is the client's to say.
    solver.control(Restart(), Ground((Part("base"),)))
    outcome = solver.solve()

    # The last argument of do(arm,pickup(4),1) is the step.
    plan = sorted(outcome.symbols, key=lambda atom: parse_term(atom).arguments[-1])
    print("##### result")
    print("result:", outcome.result.value)
    print("interrupted:", outcome.interrupted)
    print("answerset:", plan)
    print("#####")


if __name__ == "__main__":
    try:
        main()
    except RosclingoError as error:
        sys.exit(f"start.py: {error}")
