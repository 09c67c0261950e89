"""Actions wait by the clock where a value would be kept for too long."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

import pytest
from episode import DYN_RESET, RECORDING, RESET, SINGLE
from test_actions import ACTIONS

from rosclingo.solver.options import Options
from rosoclingo.in_process.inputs import read_input
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop.journal import ActionPublished, StatusSet

# The waiter lays the table for 100 s; a dish takes 10 s to fry, and is hot for 20 s.
KITCHEN = """
#program base.
actuator(cook;waiter).
request((dish;look)).
action(guest,look).
sets(guest,look,seen,yes).
initially(seen,no).
wants(look,seen,yes).
duration(guest,look,30).

#program present(k,t).
own(ID,food(ID),raw,k) :- asked(ID,dish,k).
own(ID,table(ID),bare,k) :- asked(ID,dish,k).
wants(ID,food(ID),served,k) :- asked(ID,dish,k).
action(cook,fry(ID),k) :- asked(ID,dish,k).
needs(cook,fry(ID),food(ID),raw,k) :- asked(ID,dish,k).
sets(cook,fry(ID),food(ID),hot,k) :- asked(ID,dish,k).
duration(cook,fry(ID),10,k) :- asked(ID,dish,k).
at_most(food(ID),hot,20,k) :- asked(ID,dish,k).
action(waiter,(lay(ID);serve(ID)),k) :- asked(ID,dish,k).
sets(waiter,lay(ID),table(ID),laid,k) :- asked(ID,dish,k).
duration(waiter,lay(ID),100,k) :- asked(ID,dish,k).
needs(waiter,serve(ID),food(ID),hot,k) :- asked(ID,dish,k).
needs(waiter,serve(ID),table(ID),laid,k) :- asked(ID,dish,k).
sets(waiter,serve(ID),food(ID),served,k) :- asked(ID,dish,k).
duration(waiter,serve(ID),5,k) :- asked(ID,dish,k).
"""
WASHES = """
#program base.
initially(hands,clean).
says(spilt,hands,dirty).
action(waiter,wash).
sets(waiter,wash,hands,clean).
duration(waiter,wash,60).

#program present(k,t).
needs(waiter,serve(ID),hands,clean,k) :- asked(ID,dish,k).
"""
# A porter brings things to the hall.
PIE = """
#program base.
way(bar,hall). way(hall,bar). length(bar,hall,20).
moves(porter). initially(at(porter),bar).
request((pie;box)). wants(T,T,served) :- request(T), thing(T,X).
thing(pie,baked). thing(box,new).
initially(pie,raw). initially(box,new).
action(oven,bake). needs(oven,bake,pie,raw). sets(oven,bake,pie,baked).
duration(oven,bake,10). ready(pie,baked,100).
action(porter,(take(T);put(T))) :- thing(T,X).
needs(porter,take(T),at(porter),bar) :- thing(T,X).
needs(porter,take(T),T,X) :- thing(T,X).
sets(porter,take(T),T,taken) :- thing(T,X).
needs(porter,put(T),at(porter),hall) :- thing(T,X).
needs(porter,put(T),T,taken) :- thing(T,X).
sets(porter,put(T),T,served) :- thing(T,X).
"""
# A request like the other one.
HURRY = (
    KITCHEN[KITCHEN.index("#program present") :].replace("dish,k", "soon,k")
    + """
#program base.
request(soon).
"""
)
COOKS_BY_ITSELF = "ready(food(ID),hot,40,k) :- asked(ID,dish,k)."
# One painter is on the site, and paints the door for 300 s. The other one has 80 s to get there.
PAINTERS = """
#program base.
moves((near;far)).
request((door;wall)).
way(street,site).
way(site,street).
length(street,site,80).
initially(at(near),site).
initially(at(far),street).
initially((door;wall),bare).
action((near;far),(paint(door);paint(wall))).
needs(R,paint(W),at(R),site) :- R = (near;far), W = (door;wall).
sets(R,paint(W),W,painted) :- R = (near;far), W = (door;wall).
duration((near;far),paint(door),300).
duration((near;far),paint(wall),20).
wants(W,W,painted) :- W = (door;wall).
"""
SECONDS = {"lay": 100.0, "fry": 10.0, "serve": 5.0, "look": 30.0, "wash": 60.0, "paint": 300.0,
           "go": 80.0}  # fmt: skip


class Kitchen(SimulatedSystem):
    """Notes in ``began`` when actions begin, in seconds."""

    def __init__(
        self, mode: str, folder: Path, more: str = "", options: Sequence[str] = (), **inputs: str
    ) -> None:
        file = folder / "kitchen.lp"
        file.write_text(f'#include "{ACTIONS}".{KITCHEN}{more}')
        lasts: Dict[str, float] = {**SECONDS}
        super().__init__(
            make_parts(mode, Options((str(file),), tuple(options))).loop,
            [read_input(f"goal:{goal}", step) for goal, step in inputs.items()],
            seconds=lambda actuator, action: lasts[action.partition("(")[0]],
            patience=0.0,
        )
        self.lasts = lasts

    @property
    def began(self) -> Dict[str, float]:
        """The first time of each action, by its name."""
        found: Dict[str, float] = {}
        for entry in self.journal:
            if isinstance(entry.event, ActionPublished):
                found.setdefault(entry.event.action.partition("(")[0], entry.seconds)
        return found

    def began_all(self, name: str) -> List[Tuple[str, float]]:
        """All actions of a name, and when each began."""
        return [
            (entry.event.action, entry.seconds)
            for entry in self.journal
            if isinstance(entry.event, ActionPublished) and entry.event.action.startswith(name)
        ]

    @property
    def ended_at(self) -> Dict[str, float]:
        """When the goals have ended, by their numbers."""
        return {
            entry.event.goal: entry.seconds
            for entry in self.journal
            if isinstance(entry.event, StatusSet) and entry.event.status.is_terminal
        }

    @property
    def ends(self) -> Any:
        """The statuses in which goals have ended."""
        events = [entry.event for entry in self.journal]
        return [
            event.status.value
            for event in events
            if isinstance(event, StatusSet) and event.status.is_terminal
        ]


@pytest.mark.parametrize("mode", [RECORDING, RESET, DYN_RESET, SINGLE])
def test_the_cook_waits_until_the_waiter_will_be_back_in_time(mode: str, tmp_path: Path) -> None:
    kitchen = Kitchen(mode, tmp_path, dish="0")
    assert kitchen.run() is None
    assert kitchen.ends == ["succeeded"]
    began = kitchen.began
    assert began["lay"] == 0
    assert 70 <= began["fry"] < 72
    assert began["serve"] == 100


def test_what_cooks_by_itself_is_put_on_that_much_earlier(tmp_path: Path) -> None:
    kitchen = Kitchen(DYN_RESET, tmp_path, COOKS_BY_ITSELF, dish="0")
    assert kitchen.run() is None
    assert kitchen.ends == ["succeeded"]
    assert 30 <= kitchen.began["fry"] < 32


def test_the_end_of_another_action_does_not_begin_the_wait_anew(tmp_path: Path) -> None:
    """The time that has gone by since an action began counts when the rest is timed anew."""
    kitchen = Kitchen(DYN_RESET, tmp_path, dish="0", look="0")
    assert kitchen.run() is None
    assert kitchen.ends == ["succeeded"] * 2
    assert kitchen.began["look"] == 0
    assert 70 <= kitchen.began["fry"] < 72


def test_a_request_that_comes_meanwhile_does_not_end_the_wait(tmp_path: Path) -> None:
    kitchen = Kitchen(DYN_RESET, tmp_path, dish="0", look="1")
    assert kitchen.run() is None
    assert kitchen.ends == ["succeeded"] * 2
    assert 70 <= kitchen.began["fry"] < 72


def test_a_waiter_who_is_late_lets_the_cook_act_after_the_expected_time(tmp_path: Path) -> None:
    kitchen = Kitchen(DYN_RESET, tmp_path, dish="0")
    kitchen.lasts["lay"] = 200.0
    assert kitchen.run() is None
    assert kitchen.ends == ["succeeded"]
    assert 70 <= kitchen.began["fry"] < 72
    assert kitchen.began["serve"] == 200


def test_what_is_under_way_does_not_wait(tmp_path: Path) -> None:
    """The dish is fried already when the waiter has to wash first, so it gets cold."""
    kitchen = Kitchen(DYN_RESET, tmp_path, WASHES, dish="0")
    kitchen.left.append(read_input("info:spilt", "2"))
    assert kitchen.run() is None
    assert kitchen.ends == ["succeeded"]
    assert 70 <= kitchen.began["fry"] < 72
    assert kitchen.began["wash"] == 100
    assert kitchen.began["serve"] == 160
    assert [action for _, action in kitchen.published].count("fry(1)") == 1


@pytest.mark.parametrize(("seconds", "painter"), [(30.0, "far"), (250.0, "near")])
def test_who_can_begin_first_acts(seconds: float, painter: str, tmp_path: Path) -> None:
    """The wall is asked for when one painter is busy for 270 s yet, or for 50 s."""
    site = Kitchen(DYN_RESET, tmp_path, PAINTERS, door="0", look="0", wall="2")
    site.lasts["look"] = seconds
    assert site.run() is None
    assert site.ends == ["succeeded"] * 3
    assert (painter, "paint(wall)") in site.published
    assert ("far", "go(site)") not in site.published or painter == "far"


def test_what_has_to_ripen_after_a_late_action_is_not_expected_now(tmp_path: Path) -> None:
    """The porter does not wait for the pie, which cools for 100 s after it was baked, to go once.

    The box is asked for after 30 s, when the pie ought to have been baked for 20 s.
    """
    site = Kitchen(DYN_RESET, tmp_path, PIE, pie="0", look="0", box="2")
    site.lasts.update(bake=60.0, take=1.0, put=1.0, go=20.0)  # 50 s longer than planned
    assert site.run() is None
    assert site.ends == ["succeeded"] * 3
    assert site.published.index(("porter", "put(box)")) < site.published.index(
        ("porter", "take(pie)")
    )


@pytest.mark.parametrize("mode", [RECORDING, RESET, DYN_RESET, SINGLE])
def test_a_request_is_not_met_before_it_is_wanted(mode: str, tmp_path: Path) -> None:
    """The waiter lays the table at once, and the dish is fried to be hot at the table."""
    kitchen = Kitchen(mode, tmp_path, "#program base. earliest(dish,200).", dish="0")
    assert kitchen.run() is None
    assert kitchen.ends == ["succeeded"]
    began = kitchen.began
    assert began["lay"] == 0
    expected = [line for line in kitchen.goals[0].lines if line.startswith("expected")]
    assert expected == ["expected in 200 s", "expected in 35 s", "expected in 5 s"]
    assert 195 <= began["serve"] < 197
    assert 165 <= began["fry"] <= 186


def test_the_search_knows_what_is_not_wanted_yet(tmp_path: Path) -> None:
    """With one waiter, the dish that is wanted now is served first, although it came later."""
    kitchen = Kitchen(DYN_RESET, tmp_path, f"{HURRY}earliest(dish,300).", dish="0", soon="0")
    assert kitchen.run() is None
    assert kitchen.ends == ["succeeded"] * 2
    assert [action for action, _ in kitchen.began_all("serve")] == ["serve(2)", "serve(1)"]
    assert kitchen.began_all("serve")[1][1] >= 295


@pytest.mark.parametrize("mode", [RECORDING, RESET, DYN_RESET, SINGLE])
def test_a_request_that_is_of_no_use_any_more_is_aborted(mode: str, tmp_path: Path) -> None:
    """No action for it has begun; for the other request, the waiter is under way."""
    kitchen = Kitchen(mode, tmp_path, f"{HURRY}latest(soon,50).", dish="0", soon="1")
    kitchen.lasts["lay"] = 400.0
    assert kitchen.run() is None
    assert sorted(kitchen.ends) == ["aborted", "succeeded"]
    assert 50 <= kitchen.ended_at["2"] <= 52
    assert [action for action, _ in kitchen.began_all("serve")] == ["serve(1)"]


def test_what_is_under_way_for_a_request_that_comes_too_late_ends(tmp_path: Path) -> None:
    kitchen = Kitchen(DYN_RESET, tmp_path, "#program base. latest(dish,50).", dish="0", look="0")
    assert kitchen.run() is None
    assert kitchen.ends == ["succeeded", "aborted"]
    assert kitchen.ended_at["1"] == 100
    assert "too_late" in kitchen.goals[0].lines
    assert "fry" not in kitchen.began


def test_a_request_in_time_is_met(tmp_path: Path) -> None:
    kitchen = Kitchen(DYN_RESET, tmp_path, "#program base. latest(dish,120).", dish="0")
    assert kitchen.run() is None
    assert kitchen.ends == ["succeeded"]


def test_a_cancel_before_the_time_is_up_is_a_cancel(tmp_path: Path) -> None:
    kitchen = Kitchen(DYN_RESET, tmp_path, "#program base. latest(dish,150).", dish="0", look="0")
    kitchen.left.append(read_input("cancel:1", "1"))
    assert kitchen.run() is None
    assert sorted(kitchen.ends) == ["canceled", "succeeded"]


@pytest.mark.parametrize("learns", [0, 1])
def test_durations_are_learned(learns: int, tmp_path: Path) -> None:
    """Laying takes 300 s, and not 100 s: the last dish is fried when the waiter is really there."""
    options = ("-c", f"learns={learns}", "-c", "slots=1")
    kitchen = Kitchen(DYN_RESET, tmp_path, options=options, dish="0")
    kitchen.left += [read_input("goal:dish", "1")] * 3
    kitchen.lasts["lay"] = 300.0
    assert kitchen.run() is None
    assert kitchen.ends == ["succeeded"] * 4
    laid = [begin + 300 for _, begin in kitchen.began_all("lay")]
    fried = [begin + 10 for _, begin in kitchen.began_all("fry")]
    waits = [round(end - begin) for begin, end in zip(fried, laid)]
    assert waits[0] > 200
    assert waits[3] < 110 if learns else waits[3] > 200, waits
