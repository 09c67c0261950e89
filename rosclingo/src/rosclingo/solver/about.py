"""Describes how a node was started, so that it can be started again elsewhere. Needs no ROS."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from typing import TYPE_CHECKING, Any, Dict, Optional, Sequence

import clingo

from rosclingo.solver import options

if TYPE_CHECKING:
    from rosclingo.solver.programs import Program


def about(
    program: str, arguments: Sequence[str], loaded: Optional[Program] = None, **more: Any
) -> str:
    """Describes a node.

    Args:
        program: Package and executable, such as ``rosclingo run.py``.
        arguments: Its command line, without program name and ROS remappings.
        loaded: The files of the command line, as the solver has loaded them; None without any.
        more: Further entries, whose values JSON can hold.

    Returns:
        A JSON object with ``program``, ``arguments``, ``files`` (for each path ``sha256`` and
        ``text``, and ``includes``) and ``versions`` (of clingo and Python); with files also
        ``paths`` (of those of the command line, by how that names them) and ``directory``, the
        working directory.
    """
    files: Dict[str, Any] = {}
    if loaded is not None:
        for path, text in loaded.texts.items():
            digest = hashlib.sha256(text.encode("utf-8")).hexdigest()
            included = loaded.includes.get(path, {})
            files[path] = {"sha256": digest, "text": text, "includes": included}
    if loaded is not None and loaded.named:
        names = [value for option, value in options.arguments(arguments) if option == "-f"]
        more = {"paths": dict(zip(names, loaded.named)), "directory": os.getcwd(), **more}
    described = {
        "program": program,
        "arguments": list(arguments),
        "files": files,
        "versions": {"clingo": clingo.__version__, "python": platform.python_version()},
        **more,
    }
    return json.dumps(described, sort_keys=True)
