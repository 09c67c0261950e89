"""Turns docstrings in Google's style into what Sphinx reads.

Napoleon does it, but takes the words before a colon in what is returned, and in what describes an
attribute, for a type. Here types are in the code, and all of these words are prose.
"""

from __future__ import annotations

from typing import Any, Dict, List, Tuple

from sphinx.application import Sphinx
from sphinx.ext.napoleon import Config
from sphinx.ext.napoleon.docstring import GoogleDocstring

_CONFIG = Config(napoleon_use_ivar=True)


def setup(app: Sphinx) -> Dict[str, Any]:
    """Has docstrings converted, as Sphinx calls it of each extension."""
    app.connect("autodoc-process-docstring", _convert)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _convert(app: Sphinx, kind: str, name: str, value: Any, options: Any, lines: List[str]) -> None:
    kind = "function" if kind in ("attribute", "data", "property") else kind
    lines[:] = UntypedDocstring(lines, _CONFIG, app, kind, name, value, options).lines()


class UntypedDocstring(GoogleDocstring):
    """A docstring whose sections have no types."""

    def _consume_returns_section(
        self, preprocess_types: bool = False
    ) -> List[Tuple[str, str, List[str]]]:
        return [("", "", self._dedent(self._consume_to_next_section()))]
