"""The site leaves out no document and no module; scripts/docs builds it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import List

import pytest
from readmes import documents

pytest.importorskip("sphinx", reason="scripts/setup --docs installs it")

from sphinx.errors import ExtensionError

from api_pages import api_pages, modules_of
from docstrings import UntypedDocstring
from one_site import contents, graph_of

ROOT = Path(__file__).resolve().parents[1]


def test_each_document_is_in_the_contents() -> None:
    listed = re.findall(r"^[\w/]+$", contents(ROOT), re.MULTILINE)
    assert {f"{name}.md" for name in listed} >= {*documents()} - {"README.md"}
    assert len(listed) == len(set(listed))


def test_each_module_is_on_a_page() -> None:
    pages = api_pages(ROOT)
    shown = re.findall(r"automodule:: (\S+)", "".join(pages.values()))
    files = [
        file.relative_to(source) for source in ROOT.glob("*/src") for file in source.rglob("*.py")
    ]
    modules = {".".join(file.with_suffix("").parts) for file in files if file.stem[:2] != "__"}
    assert modules < set(shown)
    assert len(shown) == len(set(shown))
    assert pages["index.rst"].index(" rosclingo\n") < pages["index.rst"].index(" rosoclingo\n")


def test_a_module_comes_after_what_it_imports(tmp_path: Path) -> None:
    folder = tmp_path / "some"
    folder.mkdir()
    for name, text in (
        ("alone", ""), ("bread", "from some import meal, yeast"), ("meal", "import some.corn"),
        ("corn", "import some.bread"), ("yeast", "import os"), ("_hidden", ""),
    ):  # fmt: skip
        (folder / f"{name}.py").write_text(text)
    order = [name.rpartition(".")[2] for name in modules_of(tmp_path, "some")]
    assert order == ["alone", "corn", "meal", "yeast", "bread"]


def test_a_folder_without_a_place_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "some/src/some/inner"
    folder.mkdir(parents=True)
    for package in (folder, folder.parent):
        (package / "__init__.py").write_text("")
    (tmp_path / "docs").mkdir()
    (tmp_path / "README.md").write_text(f"| [some]({Path('some', 'README.md')}) | a package |\n")
    tables = tmp_path / "docs/architecture.md"
    tables.write_text("| `some/` | all | nothing |\n")
    with pytest.raises(ValueError, match=r"no row names \['some.inner'\]"):
        api_pages(tmp_path)
    tables.write_text("| `some/inner/` | all | nothing |\n")
    assert sorted(api_pages(tmp_path)) == ["index.rst", "some.inner.rst", "some.rst"]


def test_what_is_returned_has_no_type() -> None:
    text = "Does it.\n\nReturns:\n    The id: a number.\n\nRaises:\n    ValueError: It has none."
    lines = UntypedDocstring(text).lines()
    assert ":returns: The id: a number." in lines
    assert ":raises ValueError: It has none." in lines


def test_a_graph_is_drawn() -> None:
    drawn = graph_of(["graph TD", "  a[one & two<br>three] --> b", "b --> c[four]"])
    assert "a [label=<one &amp; two<br/>three>]" in drawn
    assert "a -> b" in drawn
    assert "c [label=<four>]" in drawn


@pytest.mark.parametrize("lines", [["graph LR", "a --> b"], ["graph TD", "a -.-> b"]])
def test_what_cannot_be_drawn_is_named(lines: List[str]) -> None:
    with pytest.raises(ExtensionError, match="graph LR" if "LR" in lines[0] else "a -.-> b"):
        graph_of(lines)
