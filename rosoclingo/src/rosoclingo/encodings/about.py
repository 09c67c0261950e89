"""The decoder of ``~about``: a node's command line, files and parameters as one typed value.

>>> text = '{"program": "rosclingo run.py", "arguments": ["-f", "a.lp", "-c", "n=2"]}'
>>> planner = Launched.decode("/planner", text)
>>> planner.program, planner.arguments
('rosclingo run.py', ('-f', 'a.lp', '-c', 'n=2'))
>>> Launched.decode("/p", '{"files": 3}')
Traceback (most recent call last):
rosoclingo.errors.LaunchedError: /p/about does not say how the node was started: files is no object

The encoder is :func:`rosclingo.solver.about.about`, which solver nodes need, too.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from typing import Any, Dict, Mapping, Optional, Tuple

from rosoclingo.errors import LaunchedError

SOLVER_NODE = "rosclingo run.py"
LOOP_NODE = "rosoclingo run.py"
SINGLE_NODE = "rosoclingo run-1.0.py"
"""The programs of a planning system, as ``~about`` names them."""

_KINDS: Mapping[type, str] = {dict: "object", list: "list", str: "text"}


@dataclass(frozen=True)
class Launched:
    """A node's program, command line, files and parameters at its start.

    All but the first two are empty if ``~about`` does not have them.

    Attributes:
        node: Its resolved name, such as ``/planner``.
        program: Package and executable, such as ``rosclingo run.py``.
        arguments: Its command line, without ROS remappings.
        files: The texts of the files that it had loaded, by their real paths.
        versions: Versions of clingo and Python.
        solvers: Of ``rosoclingo run.py``, the names of the nodes which are ``controller`` and
            ``planner``.
        parameters: Of a node with the planning loop, those by which it decides, such as
            ``abort_unreachable``, with values of JSON.
        paths: The real paths of those files of the command line, by how that names them.
        includes: For each file, the real paths of what it includes, by how it names that.
        directory: Its working directory.
        actuators: Of an interface, those whose actions it does, none for all; None of other nodes.
        messages: The ids of what an interface sends besides answers.
    """

    node: str
    program: str
    arguments: Tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    solvers: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    paths: Mapping[str, str] = field(default_factory=dict)
    includes: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    directory: str = ""
    actuators: Optional[Tuple[str, ...]] = None
    messages: Tuple[str, ...] = ()

    @classmethod
    def decode(cls, node: str, text: str) -> Launched:
        """Decodes a node's ``~about``.

        Args:
            node: Its resolved name.
            text: The JSON object.

        Raises:
            LaunchedError: It is none, or has an entry of a wrong type.
        """
        try:
            said = _typed("all of it", json.loads(text), dict)

            def entry(name: str, kind: type, of: Optional[type] = None) -> Any:
                return _typed(name, said.get(name, kind()), kind, of)

            files = entry("files", dict, dict)
            return cls(
                node,
                _typed("program", said.get("program"), str),
                tuple(entry("arguments", list, str)),
                {path: _typed(path, file.get("text", ""), str) for path, file in files.items()},
                entry("versions", dict, str),
                entry("solvers", dict, str),
                entry("parameters", dict),
                entry("paths", dict, str),
                {
                    path: _typed(path, file.get("includes", {}), dict, str)
                    for path, file in files.items()
                },
                entry("directory", str),
                tuple(entry("actuators", list, str)) if "actuators" in said else None,
                tuple(entry("messages", list, str)),
            )
        except (ValueError, TypeError, RecursionError) as err:
            reason = f"{node}/about does not say how the node was started: {err}"
            raise LaunchedError(reason) from err

    def digests(self) -> Dict[str, str]:
        """Returns SHA-256 digests of the files, in hexadecimal, by their paths."""
        return {
            path: hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
            for path, text in self.files.items()
        }


def _typed(name: str, value: object, kind: type, of: Optional[type] = None) -> Any:
    """Returns a value of JSON, whose entries are of another type, if that is given.

    Raises:
        TypeError: It or one of them is of another type.
    """
    if not isinstance(value, kind):
        raise TypeError(f"{name} is no {_KINDS[kind]}")
    found: Any = value
    if of is not None:
        for key, entry in found.items() if kind is dict else enumerate(found):
            _typed(f"{name}: {key}", entry, of)
    return found
