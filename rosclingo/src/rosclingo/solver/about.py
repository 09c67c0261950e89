"""Describes how a node was started, so that it can be started again elsewhere. Needs no ROS."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from types import MappingProxyType
from typing import Any, Dict, Mapping, Sequence

import clingo

from rosclingo.solver import options


def about(
    program: str,
    arguments: Sequence[str],
    files: Mapping[str, str],
    *,
    named: Sequence[str] = (),
    includes: Mapping[str, Mapping[str, str]] = MappingProxyType({}),
    **more: Any,
) -> str:
    """Describes a node.

    Args:
        program: Package and executable, such as ``rosclingo run.py``.
        arguments: Its command line, without program name and ROS remappings.
        files: What was in each file that it has loaded, by its real path.
        named: The real paths of those of the command line, in its order.
        includes: For each of the files, the real paths of what it includes, by how it names that.
        more: Further entries, whose values JSON can hold.

    Returns:
        A JSON object with ``program``, ``arguments``, ``files`` (for each path ``sha256`` and
        ``text``, and ``includes``) and ``versions`` (of clingo and Python); with files also
        ``paths`` (of those of the command line, by how that names them) and ``directory``, the
        working directory.
    """
    origin: Dict[str, Any] = {}
    if named:
        names = [value for option, value in options.arguments(arguments) if option == "-f"]
        origin = {"paths": dict(zip(names, named)), "directory": os.getcwd()}
    described = {
        "program": program,
        "arguments": list(arguments),
        "files": {
            path: {
                "sha256": hashlib.sha256(text.encode("utf-8")).hexdigest(),
                "text": text,
                "includes": dict(includes.get(path, {})),
            }
            for path, text in files.items()
        },
        "versions": {"clingo": clingo.__version__, "python": platform.python_version()},
        **origin,
        **more,
    }
    return json.dumps(described, sort_keys=True)
