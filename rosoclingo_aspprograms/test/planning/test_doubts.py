"""Mistakes in encodings for actions.lp are named: by check.py, and where there is no plan."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_actions import ACTIONS

from rosclingo.solver.options import Options
from rosoclingo.encodings.alphabet import read_alphabet
from rosoclingo.loop.single.dialects import Dialect2
from rosoclingo.loop.situation import Situation
from rosoclingo.tools.check import model, static
from rosoclingo.why.explainer import Explainer

TASK = """
robot(r).
way((a;b),(a;b)).
moves(R) :- robot(R).
initially(at(R),a) :- robot(R).
initially(bell,works).
number(room(R),2) :- robot(R).
request(bring(V,W)) :- place(V), place(W), V != W.
action(R,ring) :- robot(R).
needs(R,ring,at(R),b) :- robot(R).
needs(R,ring,bell,works) :- robot(R).
sets(R,ring,bell,rung) :- robot(R).
#program present(k,t).
own(ID,thing(ID),V,k) :- asked(ID,bring(V,W),k).
wants(ID,thing(ID),W,k) :- asked(ID,bring(V,W),k).
action(R,pick(ID),k) :- asked(ID,bring(V,W),k), robot(R).
needs(R,pick(ID),at(R),V,k) :- asked(ID,bring(V,W),k), robot(R).
needs(R,pick(ID),thing(ID),V,k) :- asked(ID,bring(V,W),k), robot(R).
sets(R,pick(ID),thing(ID),R,k) :- asked(ID,bring(V,W),k), robot(R).
uses(R,pick(ID),room(R),1,k) :- asked(ID,bring(V,W),k), robot(R).
action(R,drop(ID),k) :- asked(ID,bring(V,W),k), robot(R).
needs(R,drop(ID),at(R),W,k) :- asked(ID,bring(V,W),k), robot(R).
needs(R,drop(ID),thing(ID),R,k) :- asked(ID,bring(V,W),k), robot(R).
needs(R,drop(ID),bell,rung,k) :- asked(ID,bring(V,W),k), robot(R).
sets(R,drop(ID),thing(ID),W,k) :- asked(ID,bring(V,W),k), robot(R).
gives(R,drop(ID),room(R),1,k) :- asked(ID,bring(V,W),k), robot(R).
"""

MISTAKES = {  # what is changed, what check.py says of which line, and why there is no plan
    "a variable without a value": (
        "needs(R,ring,bell,works)", "needs(R,ring,bel,works)", 11,
        "needs(r,ring,bel,works): bel has no value; initially(bel,X) would say one",
        "nothing makes bel works",
    ),
    "a value that nothing makes so": (
        "needs(R,ring,bell,works)", "needs(R,ring,bell,working)", 11,
        "needs(r,ring,bell,working): nothing ever makes bell working",
        "nothing makes bell working",
    ),
    "no number": (
        "uses(R,pick(ID),room(R)", "uses(R,pick(ID),rom(R)", 20,
        "uses(r,pick(1),rom(r),1): rom(r) is no number; number(rom(r),N) would say how large it "
        "can be", "Look at uses(r,pick(1),rom(r),1)",
    ),
    "too much of a number": (
        "uses(R,pick(ID),room(R),1", "uses(R,pick(ID),room(R),3", 20,
        "uses(r,pick(1),room(r),3): room(r) is 2 at most",
        "uses(r,pick(1),room(r),3): room(r) is 2 at most",
    ),
    "a number that is a name": (
        "number(room(R),2)", "number(room(R),two)", 7,
        "number(room(r),two): two is no whole number from 0 to 999999999",
        "uses(r,pick(1),room(r),1): room(r) is -1 at most",
    ),
    "too much in the beginning": (
        "number(room(R),2)", "initially(room(r),3). number(room(R),2)", 7,
        "initially(room(r),3): room(r) is 2 at most", "",
    ),
    "two values in the beginning": (
        "initially(bell,works)", "initially(bell,(works;broken))", 6,
        "initially(bell,broken): bell is said to be works, too, and can have one value only",
        "no answer set",
    ),
    "two values that are needed": (
        "needs(R,ring,bell,works)", "needs(R,ring,at(R),a)", 11,
        "needs(r,ring,at(r),a): at(r) is said to be b, too, and can have one value only",
        "Look at needs(r,ring,at(r),a)",
    ),
    "two values that are set": (
        "sets(R,ring,bell,rung)", "sets(R,ring,bell,(rung;off))", 12,
        "sets(r,ring,bell,off): bell is said to be rung, too, and can have one value only",
        "Look at sets(r,ring,bell,off)",
    ),
    "a request that wants nothing": (
        "wants(ID,thing(ID),W,k) :-", "wish_for(ID,thing(ID),W,k) :-", 8,
        "request(bring(a,b)): nothing says wants for it, so it is met at once", "",
    ),
    "a robot at no place of the map": (
        "initially(at(R),a)", "initially(at(R),c)", 5,
        "initially(at(r),c): no way leads from c", "no way leads r to a",
    ),
    "a robot that is nowhere": (
        "initially(at(R),a)", "somewhere(at(R),a)", 4,
        "moves(r): r is at no place; initially(at(r),V) would say one", "no way leads r to a",
    ),
    "an action that is none": (
        "action(R,pick(ID),k) :-", "act_of(R,pick(ID),k) :-", 17,
        "needs(r,pick(1),at(r),a): nothing says action(r,pick(1)), so it is not done",
        "nothing makes thing(1) r",
    ),
    "a number that is added to, and is none": (
        "gives(R,drop(ID),room(R)", "gives(R,drop(ID),rom(R)", 26,
        "gives(r,drop(1),rom(r),1): rom(r) is no number; number(rom(r),N) would say how large it "
        "can be", "",
    ),
    "a number that is filled, and is none": (
        "sets(R,ring,bell,rung)", "fills(R,ring,rom(R)) :- robot(R). sets(R,ring,bell,rung)", 12,
        "fills(r,ring,rom(r)): rom(r) is no number; number(rom(r),N) would say how large it can be",
        "",
    ),
    "a variable that nothing else has": (
        "sets(R,ring,bell,rung)", "sets(R,ring,(bell;bel),rung)", 12,
        "sets(r,ring,bel,rung): nothing else has the variable bel", "",
    ),
    "an action of a number that is none": (
        "sets(R,ring,bell,rung)", "uses(R,rign,room(R),1) :- robot(R). sets(R,ring,bell,rung)", 12,
        "uses(r,rign,room(r),1): nothing says action(r,rign), so it is not done", "",
    ),
    "a number that is filled and used": (
        "sets(R,ring,bell,rung)", "fills(R,ring,room(R)) :- robot(R). uses(R,ring,room(R),1) :- "
        "robot(R). sets(R,ring,bell,rung)", 12,
        "fills(r,ring,room(r)): the action changes room(r) otherwise, too, so it is never done", "",
    ),
    "a duration that is a name": (
        "sets(R,ring,bell,rung)", "duration(R,ring,long) :- robot(R). sets(R,ring,bell,rung)", 12,
        "duration(r,ring,long): long is no whole number from 0 to 999999999",
        "Look at duration(r,ring,long)",
    ),
    "a time for a value that is a name": (
        "sets(R,ring,bell,rung)", "at_most(bell,rung,short). sets(R,ring,bell,rung)", 12,
        "at_most(bell,rung,short): short is no whole number from 0 to 999999999", "",
    ),
    "an actuator that base does not know": (
        "#program present(k,t).", "#program present(k,t). action(arm,wave,k) :- asked(ID,G,k).",
        13, "action(arm,wave): its answers are not known; actuator(arm) in base would say so", "",
    ),
    "a request that has no time": (
        "initially(bell,works)", "earliest(ring,9). latest(ring,8). initially(bell,works)", 6,
        "latest(ring,8): earliest(ring,9) says that it is not met by then", "",
    ),
    "a time for a request that is a name": (
        "initially(bell,works)", "latest(ring,soon). initially(bell,works)", 6,
        "latest(ring,soon): soon is no whole number from 0 to 999999999", "",
    ),
    "an action that takes time, and is none": (
        "sets(R,ring,bell,rung)", "duration(R,rign,5) :- robot(R). sets(R,ring,bell,rung)", 12,
        "duration(r,rign,5): nothing says action(r,rign), so it is not done", "",
    ),
    "an unknown preference": (
        "initially(bell,works)", "prefers(speed). initially(bell,works)", 6,
        "prefers(speed): the search for plans prefers waits, makespan or cost", "",
    ),
    "two preferences": (
        "initially(bell,works)", "prefers(waits). prefers(cost,2). initially(bell,works)", 6,
        "prefers(cost): prefers(waits) is said, too, and one of them only counts", "",
    ),
    "an amount below 0": (
        "uses(R,pick(ID),room(R),1", "uses(R,pick(ID),room(R),-1", 20,
        "uses(r,pick(1),room(r),-1): -1 is no whole number from 0 to 999999999", "",
    ),
    "a way to nowhere": (
        "way((a;b),(a;b))", "way((a;b),(a;b)). place(far)", 0, "", "no way leads r to far",
    ),
}  # fmt: skip


def why(
    options: Options, event: str = "", *, request: str = "bring(a,b)", seconds: float = 20
) -> str:
    """Returns why a request waits, after another event."""
    told = [event] if event else []
    situation = Situation(
        (*told, f"event(1,{request},0)"), last=20, goals=(("1", request),), tells=True
    )
    return Explainer(options, situation, seconds=seconds).goal("1").text


def write(folder: Path, old: str = "", new: str = "") -> Options:
    assert old in TASK
    file = folder / "task.lp"
    task = TASK.replace(old, new) if old else TASK
    file.write_text(f'#include "{ACTIONS}". #program base.{task}')
    return Options((str(file),))


@pytest.mark.costly
@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named(mistake: str, tmp_path: Path) -> None:
    old, new, line, text, reason = MISTAKES[mistake]
    options = write(tmp_path, old, new)
    found = list(model.look(options, read_alphabet(options)))
    said = {(one.text, int(one.place.rpartition(":")[2] or 0)) for one in found}
    assert not text or (text, line) in said
    assert all(one.is_hint for one in found)
    if reason:
        request = "bring(a,far)" if "far" in reason else "bring(a,b)"
        assert reason in why(options, request=request, seconds=600)


@pytest.mark.costly
def test_without_mistakes_nothing_is_said(tmp_path: Path) -> None:
    options = write(tmp_path)
    assert list(model.look(options, read_alphabet(options))) == []


@pytest.mark.costly
def test_an_action_on_a_condition(tmp_path: Path) -> None:
    """What is an action only after a cancel is none before, and that is no mistake."""
    drop = "action(R,drop(ID),k) :-"
    back = "needs(R,back(ID),at(R),V,k) :- asked(ID,bring(V,W),k), robot(R)."
    options = write(
        tmp_path, drop, f"action(R,back(ID),k) :- canceled(ID,k), robot(R).\n{back}\n{drop}"
    )
    assert list(model.look(options, read_alphabet(options))) == []
    options = write(tmp_path, drop, f"{drop} canceled(ID,k),")
    assert "nothing makes thing(1) b" in why(options)


@pytest.mark.costly
def test_facts_have_words(tmp_path: Path) -> None:
    """The library says what a variable is; the encoding may say it better."""
    options = write(tmp_path, "request(", "says(bell(X),bell,X) :- X = (works;off).\nrequest(")
    saved = "event(save,is(bell,off),0)"
    assert "because info says bell(off)." in why(options, "event(info,bell(off),0)")
    assert "because bell is off." in why(options, saved)
    with open(options.files[0], "a", encoding="utf-8") as file:
        file.write('#program phrases. phrase("is(bell,off)", "the bell is broken").')
    assert "because the bell is broken." in why(options, saved)


@pytest.mark.costly
def test_a_name_of_the_librarys_own(tmp_path: Path) -> None:
    """A predicate that a library has for itself is not to be derived by others."""
    options = write(
        tmp_path, "own(ID,thing(ID)", "back(ID,V,W,k) :- asked(ID,bring(V,W),k).\nown(ID,thing(ID)"
    )
    found = static.look(options, Dialect2, read_alphabet(options))
    assert any(
        one.text.startswith("back/4 is a name of the library's own (") and one.is_hint
        for one in found
    )
