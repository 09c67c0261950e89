"""Each costly test is in one of six parts, and a run has one part."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Dict, List, Set

import pytest
from parts import NUMBER, is_part, parts

ROOT = Path(__file__).resolve().parents[1]

NUMBERS = range(1, NUMBER + 1)

TESTS = """
import pytest

pytestmark = pytest.mark.costly

@pytest.mark.parametrize("number", range(7))
def test_variants(number):
    pass

def test_one(): pass
def test_two(): pass
def test_three(): pass
"""


def run_pytest(folder: Path, part: str, *options: str) -> subprocess.CompletedProcess[str]:
    """Runs a file of costly tests, and one that is cheap, as the repository's files are run."""
    for name in ("conftest.py", "pyproject.toml", "test/parts.py"):
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    (folder / "test_costly.py").write_text(TESTS)
    (folder / "test_cheap.py").write_text("def test_cheap(): pass\n")
    # Other plugins take longer to load than these tests.
    environment = {**os.environ, "PART": part, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-rA", "-p", "no:cacheprovider", *options],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip


def passed(run: subprocess.CompletedProcess[str]) -> Set[str]:
    assert run.returncode == 0, run.stdout + run.stderr
    return set(re.findall(r"^PASSED (\S+)", run.stdout, re.MULTILINE))


def test_the_parts_are_all_tests_and_share_none(tmp_path: Path) -> None:
    """Only cheap tests are in each; and a part does not depend on what -k selects."""
    found = [passed(run_pytest(tmp_path, str(part))) for part in NUMBERS]
    assert set.intersection(*found) == {"test_cheap.py::test_cheap"}
    everything = run_pytest(tmp_path, "")
    assert "skipped" not in everything.stdout
    assert set.union(*found) == passed(everything)
    assert sum(map(len, found)) == len(passed(everything)) + NUMBER - 1
    for part, tests in zip(NUMBERS, found):
        assert any("test_variants" in test for test in tests), f"part {part} has no variant"
    chosen = passed(run_pytest(tmp_path, "1", "-k", "3 or 4"))
    assert chosen == {test for test in found[0] if re.search("[34]", test)}


def test_what_is_left_out_is_said(tmp_path: Path) -> None:
    """In one line, by several processes, too, of which each collects the tests."""
    run = run_pytest(tmp_path, "2", "-p", "xdist", "-n", "1")
    (line,) = re.findall(r"^SKIPPED .*", run.stdout, re.MULTILINE)
    number = 11 - len(passed(run))
    assert number > 0
    assert line.startswith(f"SKIPPED [{number}] conftest.py:")
    assert line.endswith("costly, and not in part 2 of 6: scripts/test --full runs all")


def test_a_part_that_there_is_not(tmp_path: Path) -> None:
    assert [is_part(text) for text in ("1", "6", "0", "7", "01", "1.0", "first", "²")] == [
        *(True, True),
        *[False] * 6,
    ]
    run = run_pytest(tmp_path, "7")
    assert run.returncode == pytest.ExitCode.USAGE_ERROR
    assert "PART=7 in the environment: expected a number from 1 to 6" in run.stderr


def names(file: str, *tests: str, variants: int = 1) -> List[str]:
    return [f"test/{file}.py::{test}[{one}]" for test in tests for one in range(variants)]


def test_a_name_says_the_part() -> None:
    """Neither other files, nor the process, which has a random hash, change it."""
    one = parts(names("test_b", "test_b", variants=4))
    more = parts([*names("test_a", "test_a", variants=5), *names("test_b", "test_b", variants=4)])
    assert one.items() <= more.items()
    assert parts(["test/test_x.py::test_b"]) == {"test/test_x.py::test_b": 3}


def test_the_tests_of_a_file_take_turns() -> None:
    """So do those of two functions."""
    found = list(parts(names("test_x", "test_a", "test_b", variants=NUMBER - 1)).values())
    assert sorted(found[:NUMBER]) == list(NUMBERS)
    assert found[NUMBER:] == found[: NUMBER - 2]


def test_no_part_has_nearly_all() -> None:
    sizes: Dict[int, int] = dict.fromkeys(NUMBERS, 0)
    for part in parts([f"test/test_{number}.py::test_x" for number in range(300)]).values():
        sizes[part] += 1
    assert min(sizes.values()) > 300 / NUMBER / 1.5
