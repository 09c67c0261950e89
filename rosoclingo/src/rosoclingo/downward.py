"""Finds Fast Downward, an optional dependency, which the Python package up-fast-downward has."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Optional

DOWNWARD_PACKAGE = "up-fast-downward"


def find_fast_downward() -> Optional[Path]:
    """Returns Fast Downward's folder, with its driver and its programs; None if there is none."""
    spec = find_spec(
        DOWNWARD_PACKAGE.replace("-", "_")
    )  # an import would need unified-planning, too
    return None if spec is None or spec.origin is None else Path(spec.origin).parent / "downward"
