"""Grounds an encoding, in a process of its own.

:mod:`rosoclingo.encodings.known` starts it by ``python -m``. It reads a command
line as JSON, prints what it has found, and gives way to all other processes.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import resource
import signal
import sys

from rosclingo.errors import RosclingoError
from rosclingo.solver.options import parse_options
from rosoclingo.encodings.alphabet import read_alphabet
from rosoclingo.encodings.graph import GraphError, read_graph
from rosoclingo.encodings.known import MOST_KNOWN, SECONDS
from rosoclingo.loop.values.ids import type_event

_NICE = 19
_PR_SET_PDEATHSIG = 1  # of Linux's prctl


def main() -> None:
    """Grounds the encoding that standard input names, and prints what it says."""
    os.nice(_NICE)
    # Who has started it may be killed: the kernel ends it then, or the limit.
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
    task = json.loads(sys.stdin.read())
    if os.getppid() != task["starter"]:
        sys.exit("who has started it has ended")
    os.chdir(task["directory"])
    try:
        options = parse_options(task["arguments"])
        alphabet = read_alphabet(options)
    except RosclingoError as err:
        sys.exit(str(err))
    graph = None
    with contextlib.suppress(GraphError):  # most encodings have no map
        graph = vars(read_graph(options.files, options.clingo, options.theory))
    messages = [type_event(*pair) for pair in alphabet.messages[:MOST_KNOWN]]
    found = {
        "requests": alphabet.requests[:MOST_KNOWN],
        "messages": messages,
        "graph": graph,
        "answers": alphabet.answers,
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
