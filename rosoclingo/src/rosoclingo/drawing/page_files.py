"""The scripts and styles that the pages of console.py and report.py share. Needs nothing."""

from __future__ import annotations

from pathlib import Path

SHARED_FILES = Path(__file__).resolve().parent / "page"
"""The folder with these files: ES modules, which make elements and draw lanes of bars over time."""
