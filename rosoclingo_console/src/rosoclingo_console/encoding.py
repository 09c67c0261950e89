"""Requests and map of a planner's encoding, read without a run.

It is grounded in a process of its own, ``python -m rosoclingo_console.encoding``, which gives way
to all others: clingo cannot be interrupted, and may take any time. The process reads a command line
as JSON, and prints what it has found. Files with scripts are not read: they come from a topic, and
the scripts would run here.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import resource
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

from rosclingo.errors import RosclingoError
from rosclingo.solver.options import parse_options
from rosoclingo.check.alphabet import read_alphabet
from rosoclingo.drawing.errors import GraphError
from rosoclingo.drawing.graph import Graph, read_graph
from rosoclingo.launched.about import Launched
from rosoclingo.launched.folder import Folder
from rosoclingo.launched.unpack import unpack

_SECONDS = 60.0  # that it may take
_NICE = 19
_MOST_REQUESTS = 2000
_SCRIPT = "#script"


class EncodingError(RosclingoError):
    """An encoding of which nothing can be known; the message says why."""


@dataclass(frozen=True)
class KnownEncoding:
    """Requests and map of an encoding.

    Attributes:
        requests: The first of the requests that it knows, sorted.
        graph: Its map; None if it has none with positions.
    """

    requests: Tuple[str, ...] = ()
    graph: Optional[Graph] = None


def read_encoding(launched: Launched) -> KnownEncoding:
    """Reads the encoding of a planner that has said how it was started. Takes up to a minute.

    Raises:
        EncodingError: It has scripts, takes too long, or is no encoding.
        RosclingoError: What the planner has said makes no sense.
        OSError: The files cannot be written.
    """
    if any(_SCRIPT in text for text in launched.files.values()):
        raise EncodingError(f"the encoding of {launched.node} has scripts, which do not run here")
    folder = Folder()
    try:
        arguments, directory = unpack(launched, folder.path)
        return _run(launched.node, arguments, directory)
    finally:
        folder.remove()


def _run(node: str, arguments: Sequence[str], directory: Path) -> KnownEncoding:
    process = subprocess.Popen(  # noqa: S603 (ourselves)
        [sys.executable, "-m", __name__],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,  # Ctrl-C is for the console, which ends it
    )
    atexit.register(process.kill)
    task = json.dumps({"arguments": list(arguments), "directory": str(directory)})
    try:
        said, wrong = process.communicate(task, _SECONDS)
    except subprocess.TimeoutExpired as err:
        raise EncodingError(f"the encoding of {node} takes more than {_SECONDS:g} s") from err
    finally:
        process.kill()
        process.wait()
        atexit.unregister(process.kill)
    if process.returncode:
        raise EncodingError(f"the encoding of {node} is not understood: {wrong.strip()}")
    found: Dict[str, Any] = json.loads(said)
    return KnownEncoding(tuple(found["requests"]), _graph_of(found["graph"]))


def _graph_of(found: Optional[Dict[str, Any]]) -> Optional[Graph]:
    if found is None:
        return None
    places = {name: (float(x), float(y)) for name, (x, y) in found["places"].items()}
    return Graph(places, tuple((a, b) for a, b in found["edges"]), found["starts"])


def main() -> None:
    """Grounds the encoding that standard input names, and prints what it says."""
    os.nice(_NICE)
    # Who has started it may be killed, and then nobody ends it.
    resource.setrlimit(resource.RLIMIT_CPU, (int(_SECONDS), int(_SECONDS)))
    task = json.loads(sys.stdin.read())
    os.chdir(task["directory"])
    try:
        options = parse_options(task["arguments"])
        requests: List[str] = list(read_alphabet(options).requests[:_MOST_REQUESTS])
    except RosclingoError as err:
        sys.exit(str(err))
    graph = None
    with contextlib.suppress(GraphError):  # most encodings have no map
        graph = vars(read_graph(options.files, options.clingo, options.theory))
    print(json.dumps({"requests": requests, "graph": graph}))


if __name__ == "__main__":
    main()
