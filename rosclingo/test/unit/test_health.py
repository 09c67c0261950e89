"""The health of a solver: docs/protocol.md, section "Diagnostics"."""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Dict

import pytest

from rosclingo.health import Health, HealthLevel, resident_megabytes
from rosclingo.solver.activity import (
    GROUNDING,
    IDLE,
    SOLVING,
    FailedRequest,
    SolverActivity,
    solver_health,
)
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Add, GetExternals, Ground, Part, Restart

TIMEOUT = 180.0  # seconds; no more than a bound for what never comes
BASE = Ground((Part("base"),))
HARD = "1 { at(P,H) : H=1..11 } 1 :- P=1..12. :- at(P,H), at(Q,H), P < Q."
SLOW = 30.0


def health_of(activity: SolverActivity, seconds: float = 0.0, **more: Any) -> Health:
    """Returns what is said some seconds after the solver has begun what it does."""
    more.setdefault("slow_seconds", SLOW)
    return solver_health(activity, activity.doing[1] + seconds, **more)


def values(health: Health) -> Dict[str, str]:
    return dict(health.values)


def test_a_solver_at_rest() -> None:
    health = health_of(SolverActivity(), 3600.0)
    assert (health.name, health.level, health.message) == ("solver", HealthLevel.OK, IDLE)
    assert values(health)["in this state (s)"] == "3600.000"
    assert values(health)["atoms"] == "unknown"
    assert values(health)["last search (s)"] == "unknown"
    assert "requests in the queue" not in values(health)
    assert "last error" not in values(health)


@pytest.mark.parametrize("what", [GROUNDING, SOLVING, "load"])
def test_what_goes_on_for_long_is_slow(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # A fixed clock: for some times t, floats round t + 30.0 - t to more than 30.0.
    clock = SimpleNamespace(monotonic=lambda: 64.0)
    monkeypatch.setattr("rosclingo.solver.activity.time", clock)
    activity = SolverActivity()
    activity.begin(what)
    in_time, late = health_of(activity, SLOW), health_of(activity, SLOW + 12.0)
    assert (in_time.level, in_time.message) == (HealthLevel.OK, f"{what} for 30.0 s")
    assert late.level is HealthLevel.WARN
    assert late.message == f"{what} for 42.0 s, longer than ~slow_seconds (30 s)"
    assert values(late)["state"] == what
    never = health_of(activity, 1e6, slow_seconds=0.0)
    assert never.level is HealthLevel.OK


def test_requests_that_wait_and_one_that_has_failed() -> None:
    activity = SolverActivity()
    failed = FailedRequest("<ground>: there is no program step/1", activity.doing[1] + 1.0)
    health = health_of(activity, 5.0, waiting=2, failed=failed)
    assert health.level is HealthLevel.OK  # its client was told
    assert values(health)["requests in the queue"] == "2"
    assert values(health)["last error"] == failed.message
    assert values(health)["since the last error (s)"] == "4.000"


def test_commands_and_searches_of_an_engine() -> None:
    engine = Engine(Options())
    activity = engine.activity
    seen = []

    def look(_: object = None) -> bool:
        seen.append(activity.doing[0])
        return False

    assert engine.run([Add("base", (), "{ a(1..9) }."), BASE]).failure is None
    assert activity.doing[0] == IDLE
    assert activity.atoms == 9
    assert (activity.searches, activity.search_seconds) == (0, None)
    engine.run([Add("cost", (), "#minimize { 1,X : a(X) }."), Ground((Part("cost"),))])
    engine.solve((), improved=look)
    assert seen
    assert set(seen) == {SOLVING}
    assert activity.searches == 1
    assert activity.search_seconds is not None
    engine.run([Restart()])
    assert activity.atoms is None


def test_a_search_is_seen_from_another_thread() -> None:
    """As long as it goes on, with its time."""
    engine = Engine(Options())
    engine.run([Add("base", (), HARD), BASE])
    stops = threading.Event()
    search = threading.Thread(target=lambda: engine.solve((), stops.is_set), daemon=True)
    search.start()
    end = time.monotonic() + TIMEOUT
    health = health_of(engine.activity)
    while not (values(health)["state"] == SOLVING and health.level is HealthLevel.WARN):
        assert time.monotonic() < end, health
        time.sleep(0.01)
        health = solver_health(engine.activity, time.monotonic(), slow_seconds=0.05)
    assert float(values(health)["in this state (s)"]) > 0.05
    stops.set()
    search.join(TIMEOUT)
    assert engine.activity.doing[0] == IDLE


def test_after_an_error_of_clingos_until_a_restart() -> None:
    engine = Engine(Options())

    def fail(_: object) -> None:
        raise RuntimeError("out of memory")

    engine._runners[GetExternals] = fail
    assert engine.run([GetExternals()]).failure is not None
    health = health_of(engine.activity)
    assert health.level is HealthLevel.ERROR
    assert "restart" in health.message
    assert "out of memory" in health.message
    engine.run([Restart()])
    assert health_of(engine.activity).level is HealthLevel.OK


def test_a_refused_request_is_no_error_of_clingos() -> None:
    engine = Engine(Options())
    assert engine.run([Ground((Part("nothing"),))]).failure is not None
    assert health_of(engine.activity).level is HealthLevel.OK
    with pytest.raises(ZeroDivisionError):  # of who asks
        engine.solve((), lambda: bool(1 // 0))
    assert engine.activity.doing[0] == IDLE


def test_memory(tmp_path: Path) -> None:
    own = resident_megabytes()
    assert own is None or 1.0 < own < 1e6
    statm = tmp_path / "statm"
    assert resident_megabytes(statm) is None
    statm.write_text("no numbers at all")
    assert resident_megabytes(statm) is None
    statm.write_text("5000 1000 100 1 0 300 0\n")
    assert resident_megabytes(statm) == 1000 * os.sysconf("SC_PAGE_SIZE") / 1e6
