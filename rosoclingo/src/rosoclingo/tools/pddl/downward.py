"""Locates Fast Downward, an optional dependency, in the Python package up-fast-downward.

Versions 0.5 and 1.0 of that package are tested; their folders differ in where the translator is.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Optional

DOWNWARD_PACKAGE = "up-fast-downward"
REINSTALL = f"run pip install --force-reinstall {DOWNWARD_PACKAGE}==1.0.0"
"""The remedy for a package that is damaged, or that has another layout."""


def find_fast_downward() -> Optional[Path]:
    """Returns Fast Downward's folder, with its driver and its programs; None if there is none."""
    spec = find_spec(
        DOWNWARD_PACKAGE.replace("-", "_")
    )  # an import would need unified-planning, too
    return None if spec is None or spec.origin is None else Path(spec.origin).parent / "downward"


def installed_version() -> str:
    """Returns the version of the package that is installed, "" if that is unknown."""
    from importlib import metadata  # noqa: PLC0415 (it takes 10 ms, and only errors need it)

    try:
        return metadata.version(DOWNWARD_PACKAGE)
    except metadata.PackageNotFoundError:
        return ""
