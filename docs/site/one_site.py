"""Makes one site of documents that are written to be read on disk, too.

The project's README becomes the first page, with all others at its side, in the order of the tables
in docs/README.md. A graph in Mermaid's language, which pages of repositories draw in the browser,
becomes a picture by Graphviz, so that the site needs no other site.
"""

from __future__ import annotations

import html
import re
import shutil
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.ext.graphviz import graphviz
from sphinx.util.docutils import SphinxDirective

_LINK = re.compile(r"^\| \[[^\]]+\]\(([\w./]+)\.md\) \|", re.MULTILINE)
_NODE = r"(\w+)(?:\[([^\]]+)\])?"
_ARROW = re.compile(rf"\s*{_NODE} --> {_NODE}\s*")
_GRAPH = """\
digraph {{
  graph [bgcolor=transparent, ranksep=0.35, nodesep=0.25]
  node [shape=box, style="rounded,filled", color="#56738f", fillcolor="#eef3f8", fontname=Helvetica, fontsize=11]
  edge [color="#56738f", arrowsize=0.7]
  {lines}
}}
"""  # noqa: E501


def setup(app: Sphinx) -> Dict[str, Any]:
    """Has the documents joined, as Sphinx calls it of each extension."""
    app.connect("source-read", _add_contents)
    app.connect("build-finished", _write_index)
    app.add_directive("mermaid", MermaidGraph)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _add_contents(app: Sphinx, name: str, source: List[str]) -> None:
    if name == app.config.root_doc:
        source[0] += contents(Path(app.srcdir))


def contents(root: Path) -> str:
    """Returns the contents that stand at the side of each page, in MyST's Markdown."""
    linked = _LINK.findall((root / "docs" / "README.md").read_text())
    names = [name[3:] if name.startswith("../") else f"docs/{name}" for name in linked]
    packages = [name for name in names if name.endswith("/README")]
    changes = [name.rpartition("/")[0] for name in packages]
    parts = {
        "Documents": ["docs/README", *(name for name in names if "README" not in name)],
        "Packages": packages,
        "API": ["docs/api/index"],
        "Changes": [
            f"{name} <{name}/CHANGELOG>"
            for name in changes
            if (root / name / "CHANGELOG.rst").exists()
        ],
    }
    return "".join(
        f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n" + "\n".join(listed) + "\n```\n"
        for caption, listed in parts.items()
    )


def _write_index(app: Sphinx, failure: Optional[Exception]) -> None:
    """Gives the first page the name that a web server looks for, besides its own."""
    if failure is None and app.builder.name == "html":
        shutil.copy(Path(app.outdir, f"{app.config.root_doc}.html"), Path(app.outdir, "index.html"))


class MermaidGraph(SphinxDirective):
    """Draws boxes and arrows, from the top down."""

    has_content = True

    def run(self) -> List[nodes.Node]:
        """Returns the graph for Graphviz; ``ExtensionError`` if a line has anything else."""
        node = graphviz()
        node["code"] = graph_of(list(self.content))
        node["options"] = {"docname": self.env.docname}
        node["alt"] = "\n".join(self.content)
        return [node]


def graph_of(lines: Sequence[str]) -> str:
    """Returns a graph in Graphviz's language.

    Args:
        lines: The graph in Mermaid's: ``graph TD``, and an arrow in each line, such as
            ``a[some<br>text] --> b``. A box that no line gives a text shows its name.

    Raises:
        ExtensionError: A line has something else.
    """
    if lines[0].strip() != "graph TD":
        raise ExtensionError(f"'{lines[0]}' begins no graph that the site can draw: use graph TD")
    drawn: List[str] = []
    for line in lines[1:]:
        found = _ARROW.fullmatch(line)
        if not found:
            raise ExtensionError(f"'{line}' is no arrow of a graph such as: a[some text] --> b")
        source, source_text, target, target_text = found.groups()
        for name, text in ((source, source_text), (target, target_text)):
            if text:
                label = "<br/>".join(html.escape(part) for part in text.split("<br>"))
                drawn.append(f"{name} [label=<{label}>]")
        drawn.append(f"{source} -> {target}")
    return _GRAPH.format(lines="\n  ".join(drawn))
