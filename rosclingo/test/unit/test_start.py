"""Programs look for garbage again when they have started, whatever happens."""

from __future__ import annotations

import gc
import signal
import subprocess
import sys
import types
from typing import Iterator

import pytest

from rosclingo.start import starting


@pytest.fixture(autouse=True)
def _as_before() -> Iterator[None]:
    handler = signal.getsignal(signal.SIGINT)
    yield
    signal.signal(signal.SIGINT, handler)
    gc.unfreeze()
    gc.enable()


def test_imports_are_not_looked_through() -> None:
    with starting():
        assert not gc.isenabled()
        assert signal.getsignal(signal.SIGINT) is signal.SIG_DFL
    assert gc.isenabled()
    assert gc.get_freeze_count() > 0


def test_a_module_that_is_missing() -> None:
    with pytest.raises(ImportError), starting():
        import no_such_module  # noqa: F401, PLC0415
    assert gc.isenabled()


def test_numpy_is_for_who_needs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numpy", types.ModuleType("numpy"))
    monkeypatch.delitem(sys.modules, "numpy")
    with pytest.raises(ImportError), starting():
        import numpy  # noqa: F401, PLC0415
    assert "numpy" not in sys.modules
    module = types.ModuleType("numpy")
    with starting(numpy=True):
        sys.modules["numpy"] = module
    with starting():  # is there already
        import numpy as found  # noqa: PLC0415
    assert found is sys.modules["numpy"] is module


def test_the_parser_of_conditions_is_imported_when_it_is_needed() -> None:
    """In a process of its own, where nobody has imported catkin."""
    code = """
import sys
from rosclingo.start import starting
with starting():
    import catkin_pkg.package
assert "pyparsing" not in sys.modules
for _ in range(2):
    assert catkin_pkg.package.evaluate_condition("$A == 1", {"A": "1"})
    assert not catkin_pkg.package.evaluate_condition("$A == 1", {"A": "2"})
from catkin_pkg.condition import evaluate_condition
assert evaluate_condition.__module__ == "catkin_pkg.condition"
with starting():
    from catkin_pkg.condition import evaluate_condition as again
assert again is evaluate_condition
"""
    subprocess.run([sys.executable, "-c", code], check=True)
