"""What the documents point to is there, and it is seen when something is not."""

from __future__ import annotations

from pathlib import Path

import pytest
from links import anchors, broken


def test_nothing_is_broken() -> None:
    assert not broken()


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A repository with a package, a script and a document."""
    package = tmp_path / "rosoclingo_x"
    for name in ("nodes/run.py", "launch/a.launch", "src/rosoclingo_x/part.py", "map/a.lp"):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).touch()
    (package / "package.xml").touch()
    for name in ("scripts/test", "docs/page.md"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).touch()
    (tmp_path / "docs/page.md").write_text(
        "# A page\n\n## `run.py`: what it does\n\n## Twice\n## Twice\n"
    )
    return tmp_path


GOOD = [
    "[a](docs/page.md#runpy-what-it-does), [b](#here), [c](https://x.org/y)",
    "![a picture\nof it](docs/page.md#twice-1)",
    "    rostopic pub -1 /a rosoclingo_x/SomeType '{a: b}'",
    "    rosrun rosoclingo_x run.py _a:=b\n    roslaunch rosoclingo_x a.launch",
    "with `M=$(rospack find rosoclingo_x)/map`\n\n    rosrun other run.py $M/a.lp $M/a mine/b.lp",
    "    scripts/test units\n    python3 -m rosoclingo_x.part file",
    "```python\nfrom rosoclingo_x.part import a\nfrom rosoclingo_x.msg import B\n```",
    "`nodes/run.py`, `a.lp`, `my_file.py`, `FILE.lp`, `[a](b)`",
    "word " * 23 + "words",
]


@pytest.mark.parametrize("text", GOOD)
def test_what_is_there(root: Path, text: str) -> None:
    (root / "README.md").write_text(f"# Here\n\n{text}\n")
    assert broken(root) == []


def test_a_topic_that_begins_like_the_repository(root: Path) -> None:
    (root / "README.md").write_text(f"    rostopic echo {root}/result\n")
    assert broken(root) == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[a](docs/pages.md)", "docs/pages.md leads to no file"),
        ("![a\nb](doc/a.png)", "doc/a.png leads to no file"),
        ("[a](docs/page.md#run)", "docs/page.md#run leads to no heading"),
        ("[a](docs/page.md#twice-2)", "leads to no heading"),
        ("[a](#there)", "#there leads to no heading"),
        ("    rosrun rosoclingo_x runs.py", "rosoclingo_x has no nodes/runs.py"),
        ("    rosrun rosoclingo_y run.py", "rosoclingo_y has no nodes/run.py"),
        ("    roslaunch rosoclingo_x b.launch a:=b", "rosoclingo_x has no launch/b.launch"),
        ("    M=$(rospack find rosoclingo_x)/map\n    rosrun a b $M/b.lp", "there is no"),
        ("    cd $(rospack find rosoclingo_y)", "there is no"),
        ("type `scripts/tests units`", "there is no scripts/tests"),
        ("    python3 -m rosoclingo_x.parts", "no module rosoclingo_x.parts"),
        ("```python\nfrom rosoclingo_x.parts import a\n```", "no module rosoclingo_x.parts"),
        ("```xml\n<a b='$(find rosoclingo_x)/b.lp'/>\n```", "there is no"),
        ("`nodes/walk.py`", "there is no file nodes/walk.py"),
        ("word " * 24 + "s", "line 3 has 121 characters"),
    ],
)
def test_what_is_not(root: Path, text: str, said: str) -> None:
    (root / "README.md").write_text(f"# Here\n\n{text}\n")
    (found,) = broken(root)
    assert found.startswith("README.md: ")
    assert said in found


@pytest.mark.parametrize(
    ("cited", "said"),
    [
        ('docs/page.md, section "Twice"', ""),
        ('docs/page.md,\n# section "Twice"', ""),
        ('docs/page.md, section "Thrice"', 'docs/page.md has no section "Thrice"'),
        ("LAW.md", "it cites LAW.md, which there is not"),
    ],
)
def test_what_code_cites(root: Path, cited: str, said: str) -> None:
    (root / "rosoclingo_x/src/rosoclingo_x/part.py").write_text(f"# See {cited}.\n")
    name = "rosoclingo_x/src/rosoclingo_x/part.py"
    assert broken(root) == ([f"{name}: {said}"] if said else [])


def test_anchors(root: Path) -> None:
    assert anchors(root / "docs/page.md") == ["a-page", "runpy-what-it-does", "twice", "twice-1"]
