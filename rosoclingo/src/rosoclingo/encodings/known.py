"""Requests, messages and map of a planner's encoding, read without a run.

It is grounded in a process of its own, :mod:`.grounding`: clingo cannot be interrupted, and may
take any time. Files with scripts are not read: they come from a topic, and the scripts would run
here.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple

from rosclingo.errors import RosclingoError
from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.folder import Folder
from rosoclingo.encodings.graph import Graph
from rosoclingo.encodings.unpack import unpack
from rosoclingo.loop.values.phrases import NO_PHRASES, TermPhrases

_COMMAND = (sys.executable, "-m", "rosoclingo.encodings.grounding")
_SCRIPT = "#script"

SECONDS = 60
"""How long reading an encoding may take."""

MOST_KNOWN = 20_000
"""How many requests, and how many messages, are read at most."""


class EncodingError(RosclingoError):
    """An encoding of which nothing can be known; the message says why."""


@dataclass(frozen=True)
class KnownEncoding:
    """Requests, messages and map of an encoding.

    Attributes:
        requests: The first of the requests that it knows, sorted.
        graph: Its map; None if it has none with positions.
        messages: The first of the messages that it knows, as ``SOURCE:VALUE``, sorted; answers of
            actuators are none.
        answers: For each actuator, what it may answer.
        phrases: Its words for terms.
    """

    requests: Tuple[str, ...] = ()
    graph: Optional[Graph] = None
    messages: Tuple[str, ...] = ()
    answers: Mapping[str, Tuple[str, ...]] = field(default_factory=dict)
    phrases: TermPhrases = NO_PHRASES


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
        known = _run(launched.node, arguments, directory)
        return replace(known, phrases=TermPhrases.read(launched.files.values()))
    finally:
        folder.remove()


def _run(node: str, arguments: Sequence[str], directory: Path) -> KnownEncoding:
    task = json.dumps(
        {"arguments": list(arguments), "directory": str(directory), "starter": os.getpid()}
    )
    try:
        ended = subprocess.run(  # noqa: S603 (ourselves)
            _COMMAND,
            input=task,
            capture_output=True,
            text=True,
            timeout=SECONDS,
            check=False,
            cwd=os.sep,  # Python imports from it first, and it may be anybody's
            start_new_session=True,  # Ctrl-C is for whoever has started it, with whom it ends
        )
    except subprocess.TimeoutExpired as err:
        raise EncodingError(f"the encoding of {node} takes more than {SECONDS} s") from err
    if ended.returncode:
        raise EncodingError(f"the encoding of {node} is not understood: {ended.stderr.strip()}")
    found: Dict[str, Any] = json.loads(ended.stdout)
    return KnownEncoding(
        tuple(found["requests"]),
        _graph_of(found["graph"]),
        tuple(found["messages"]),
        {actuator: tuple(values) for actuator, values in found["answers"].items()},
    )


def _graph_of(found: Optional[Dict[str, Any]]) -> Optional[Graph]:
    if found is None:
        return None
    places = {name: (float(x), float(y)) for name, (x, y) in found["places"].items()}
    return Graph(places, tuple((a, b) for a, b in found["edges"]), found["starts"])
