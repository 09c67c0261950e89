"""Writes the pages of the API: one for each folder of Python modules, and lists of them.

They stand as a newcomer reads them, from the bottom up: folders in the order of the tables in
docs/architecture.md, section "Folders", and a module after those of its folder that it imports.
The pages go to ``docs/api/``, which git ignores, before Sphinx looks for documents.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any, Dict, Iterator, List, Set

from sphinx.application import Sphinx

_PACKAGE = re.compile(r"^\| \[(\w+)\]\(\w+/README\.md\)", re.MULTILINE)  # in the README's table
_FOLDER = re.compile(r"^\| `(\w[\w/]*)/` \|", re.MULTILINE)  # in those of architecture.md

_INDEX = """
All public modules of the packages, with what their docstrings say. A page has the modules of one
folder. They stand from the bottom up: a module comes after those that it imports. How the folders
hang together, and which of them need ROS, is said in :doc:`/docs/architecture`. Most programs begin
with one of these:

* :mod:`rosoclingo_interfaces.interface`: what does the actions of a robot
* :mod:`rosoclingo.commands`: commands of a mode of one's own
* :mod:`rosoclingo.in_process.system`: the planning loop in one process, without ROS
* :mod:`rosoclingo.why.explainer`: why there is no plan, or this action
* :mod:`rosoclingo.loop.journal`: what has happened in a run
* :mod:`rosclingo.ros.client`: clingo behind ROS; :mod:`rosclingo.solver.engine`: the same without

Messages, services and actions are described in :doc:`/docs/protocol`.
"""


def setup(app: Sphinx) -> Dict[str, Any]:
    """Has the pages written, as Sphinx calls it of each extension."""
    app.connect("builder-inited", _write_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _write_pages(app: Sphinx) -> None:
    """Leaves a page alone that is as it should be, since Sphinx reads again what is newer."""
    pages = api_pages(Path(app.srcdir))
    folder = Path(app.srcdir, "docs", "api")
    folder.mkdir(exist_ok=True)
    for file in folder.glob("*.rst"):
        if file.name not in pages:
            file.unlink()
    for name, text in pages.items():
        file = folder / name
        if not file.exists() or file.read_text() != text:
            file.write_text(text)


def api_pages(root: Path) -> Dict[str, str]:
    """Returns the pages of a repository by their names, such as ``rosclingo.wire.rst``."""
    packages = [
        name
        for name in _PACKAGE.findall((root / "README.md").read_text())
        if (root / name / "src" / name).is_dir()
    ]
    pages = {"index.rst": f"{_heading('API', '=')}{_INDEX}{_toctree(packages)}"}
    for package in packages:
        source = root / package / "src"
        for folder in folders(root, package):
            modules = modules_of(source, folder)
            parts = [f"{_heading(name, '-')}{_automodule(name)}" for name in modules]
            text = "".join([_heading(folder, "="), _automodule(folder), *parts])
            if folder == package:
                text += _toctree([name for name in folders(root, package) if name != package])
            pages[f"{folder}.rst"] = text
    return pages


def folders(root: Path, package: str) -> List[str]:
    """Returns the folders of a package with Python modules, such as ``rosclingo.wire``.

    Raises:
        ValueError: docs/architecture.md does not name one.
    """
    named = _FOLDER.findall((root / "docs" / "architecture.md").read_text())
    order = [name.replace("/", ".") for name in named if f"{name}/".startswith(f"{package}/")]
    source = root / package / "src"
    found = [_name(file.parent, source) for file in source.rglob("__init__.py")]
    missing = sorted(set(found) - {package, *order})
    if missing:
        raise ValueError(f"docs/architecture.md, section Folders: no row names {missing}")
    return [package, *(name for name in order if name in found and name != package)]


def modules_of(source: Path, folder: str) -> List[str]:
    """Returns the modules of a folder, each after those of this folder that it imports."""
    files = source.joinpath(*folder.split(".")).glob("[a-z]*.py")
    imported = {_name(file.with_suffix(""), source): list(_imports(file)) for file in sorted(files)}
    ordered: List[str] = []
    seen: Set[str] = set()

    def add(name: str) -> None:
        if name in imported and name not in seen:
            seen.add(name)
            for target in imported[name]:
                add(target)
            ordered.append(name)

    for name in imported:
        add(name)
    return ordered


def _imports(file: Path) -> Iterator[str]:
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield str(node.module)
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _name(path: Path, source: Path) -> str:
    return ".".join(path.relative_to(source).parts)


def _heading(text: str, line: str) -> str:
    return f"\n{text}\n{line * len(text)}\n"


def _automodule(name: str) -> str:
    return f"\n.. automodule:: {name}\n"


def _toctree(names: List[str]) -> str:
    return "\n.. toctree::\n   :maxdepth: 1\n\n" + "".join(f"   {name}\n" for name in names)
