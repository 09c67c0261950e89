"""What a node was started with: enough to start it again elsewhere. Needs no ROS."""

from __future__ import annotations

import hashlib
import json
import platform
from typing import Any, Mapping, Sequence

import clingo


def about(program: str, arguments: Sequence[str], files: Mapping[str, str], **more: Any) -> str:
    """Describes a node.

    Args:
        program: Package and executable, such as ``rosclingo run.py``.
        arguments: Its command line, without program name and ROS remappings.
        files: What was in each file that it has loaded, by its path.
        more: Further entries, whose values JSON can hold.

    Returns:
        A JSON object with ``program``, ``arguments``, ``files`` (for each path ``sha256`` and
        ``text``) and ``versions`` (of clingo and Python).
    """
    described = {
        "program": program,
        "arguments": list(arguments),
        "files": {
            path: {"sha256": hashlib.sha256(text.encode("utf-8")).hexdigest(), "text": text}
            for path, text in files.items()
        },
        "versions": {"clingo": clingo.__version__, "python": platform.python_version()},
        **more,
    }
    return json.dumps(described, sort_keys=True)
