"""The files of the page. They are read once: no request names a path."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, NamedTuple

from rosoclingo.drawing import SHARED_FILES

_FOLDERS = (Path(__file__).resolve().parent / "page", SHARED_FILES)
_KINDS = {
    ".css": "text/css",
    ".html": "text/html",
    ".js": "text/javascript",
    ".svg": "image/svg+xml",
}


class PageFile(NamedTuple):
    """A file of the page.

    Attributes:
        content: What is in it.
        kind: Its media type.
    """

    content: bytes
    kind: str


def read_files() -> Dict[str, PageFile]:
    """Returns the files by their names."""
    return {
        file.name: PageFile(file.read_bytes(), _KINDS[file.suffix])
        for folder in _FOLDERS
        for file in sorted(folder.iterdir())
        if file.suffix in _KINDS
    }
