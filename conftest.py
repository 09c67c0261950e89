"""Skips the costly tests of another part, times searches in process, and finds the compiled search.

See test/parts.py.
"""

from __future__ import annotations

import importlib
import os
import pkgutil
import time
from pathlib import Path
from types import SimpleNamespace
from typing import List, Set

import pytest
from parts import NUMBER, is_part, parts

PART = os.environ.get("PART", "")

left_out: Set[str] = set()


def pytest_configure() -> None:
    """Refuses a part that there is not, and prefers compiled modules."""
    _find_compiled_search()
    if PART and not is_part(PART):
        raise pytest.UsageError(
            f"PART={PART} in the environment: expected a number from 1 to {NUMBER}; "
            "without it all tests run"
        )


def _find_compiled_search() -> None:
    """Lets tests in process use the modules that a build has compiled, if no source is newer."""
    try:
        engine = importlib.import_module("rosoclingo.engine")
    except ImportError:  # tests that do not have our packages
        return
    built = Path(__file__).parent / "devel/lib/python3/dist-packages/rosoclingo/engine"
    compiled = {file.name.partition(".")[0]: file for file in built.glob("*.so")}
    sources = Path(engine.__path__[-1])
    is_current = all(
        (sources / f"{name}.py").stat().st_mtime < file.stat().st_mtime
        for name, file in compiled.items()
    )
    if compiled and is_current and str(built) not in engine.__path__:
        engine.__path__.insert(0, str(built))


@pytest.hookimpl(tryfirst=True)  # before -k and -m leave variants out
def pytest_collection_modifyitems(items: List[pytest.Item]) -> None:
    """Notes the costly tests of the other parts."""
    if PART:
        costly = [item.nodeid for item in items if item.get_closest_marker("costly")]
        left_out.update(name for name, part in parts(costly).items() if part != int(PART))


@pytest.hookimpl(tryfirst=True)  # before fixtures are made
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skips those tests, from here, so that one line of the summary tells all of them."""
    if item.nodeid in left_out:
        pytest.skip(f"costly, and not in part {PART} of {NUMBER}: scripts/test --full runs all")


@pytest.fixture(autouse=True)
def _searches_have_processor_time(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Limits the searches of a planning test by processor time, which a busy machine has, too."""
    if request.path.parent.name != "planning":
        return
    package = importlib.import_module("rosoclingo.loop.planner")
    clock = SimpleNamespace(monotonic=time.process_time, sleep=time.sleep)
    for found in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
        module = importlib.import_module(found.name)
        if hasattr(module, "time"):
            monkeypatch.setattr(module, "time", clock)
