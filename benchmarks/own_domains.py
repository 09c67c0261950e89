"""Tasks in domains of a user's own, as encodings for actions.lp: kitchens, airports, warehouses...

Each is written as one file, with its goals. The same name and size give the same task each time.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Tuple

from mailbot import ROOT

_LIBRARY = ROOT / "rosoclingo_aspprograms" / "lib" / "actions.lp"

# given(R,A,(V,X)): action A of R needs that V is X. then(R,A,(V,X)): afterwards V is X.
_KITCHEN = """
robot(cook(C)) :- cook(C).
initially(hand(C),empty) :- cook(C).
initially(state(D),raw) :- dish(D).
initially(plate(S),free) :- plate(S).
initially(pot(P),clean) :- pot(P).
initially(board,free).

% A cook takes a dish to the only board and chops it there.
action(cook(C),(take(D);chop(D))) :- cook(C), dish(D).
given(cook(C),take(D),((hand(C),empty);(state(D),raw);(board,free))) :- cook(C), dish(D).
then(cook(C),take(D),((hand(C),D);(state(D),taken);(board,D))) :- cook(C), dish(D).
given(cook(C),chop(D),((hand(C),D);(state(D),taken))) :- cook(C), dish(D).
then(cook(C),chop(D),((state(D),chopped);(board,free))) :- cook(C), dish(D).

% Then it is boiled in a pot, on a plate, and any cook serves it. The pot has to be washed.
use(boil(D,P,S),D,P,S) :- dish(D), pot(P), plate(S).
use(serve(D,P,S),D,P,S) :- dish(D), pot(P), plate(S).
action(cook(C),A) :- cook(C), use(A,D,P,S).
given(cook(C),A,((hand(C),D);(state(D),chopped);(pot(P),clean);(plate(S),free))) :-
    cook(C), use(A,D,P,S), A = boil(D,P,S).
then(cook(C),A,((hand(C),empty);(state(D),on(P));(pot(P),D);(plate(S),P))) :-
    cook(C), use(A,D,P,S), A = boil(D,P,S).
given(cook(C),A,((hand(C),empty);(state(D),on(P));(plate(S),P))) :-
    cook(C), use(A,D,P,S), A = serve(D,P,S).
then(cook(C),A,((state(D),served);(pot(P),dirty);(plate(S),free))) :-
    cook(C), use(A,D,P,S), A = serve(D,P,S).
action(cook(C),wash(P)) :- cook(C), pot(P).
given(cook(C),wash(P),((hand(C),empty);(pot(P),dirty))) :- cook(C), pot(P).
sets(cook(C),wash(P),pot(P),clean) :- cook(C), pot(P).

needs(R,A,V,X) :- given(R,A,(V,X)).
sets(R,A,V,X) :- then(R,A,(V,X)).
request(want(D)) :- dish(D).
wants(want(D),state(D),served) :- dish(D).
"""

_TUGS = """
way(V,W) :- next(V,W).
moves(tug(T)) :- tug(T).
initially(hitch(T),none) :- tug(T).
initially(towed(P),no) :- plane(P).
initially(in(S),P) :- initially(pos(P),S).
initially(in(S),free) :- segment(S), not full(S).
full(S) :- initially(pos(P),S), plane(P).

% A tug that is hooked to a plane leaves the service roads; each segment has room for one plane.
action(tug(T),(attach(P,S);detach(P,S))) :- tug(T), plane(P), segment(S).
given(tug(T),attach(P,S),((at(tug(T)),S);(pos(P),S);(hitch(T),none);(towed(P),no))) :-
    tug(T), plane(P), segment(S).
then(tug(T),attach(P,S),((at(tug(T)),hooked(S));(hitch(T),P);(towed(P),T))) :-
    tug(T), plane(P), segment(S).
given(tug(T),detach(P,S),((at(tug(T)),hooked(S));(hitch(T),P))) :- tug(T), plane(P), segment(S).
then(tug(T),detach(P,S),((at(tug(T)),S);(hitch(T),none);(towed(P),no))) :-
    tug(T), plane(P), segment(S).
action(tug(T),tow(P,S,W)) :- tug(T), plane(P), next(S,W).
given(tug(T),tow(P,S,W),((at(tug(T)),hooked(S));(pos(P),S);(hitch(T),P);(in(W),free))) :-
    tug(T), plane(P), next(S,W).
then(tug(T),tow(P,S,W),((at(tug(T)),hooked(W));(pos(P),W);(in(W),P);(in(S),free))) :-
    tug(T), plane(P), next(S,W).

needs(R,A,V,X) :- given(R,A,(V,X)).
sets(R,A,V,X) :- then(R,A,(V,X)).
request(park(P,S)) :- plane(P), segment(S).
wants(park(P,S),pos(P),S) :- plane(P), segment(S).
wants(park(P,S),towed(P),no) :- plane(P), segment(S).
"""

_ROBOTS = """
way(V,W) :- corridor(V,W).
way(W,V) :- corridor(V,W).
moves(R) :- robot(R).
initially(at(R),V) :- start(R,V).
number(battery(R),full) :- robot(R).
drains(R,battery(R),1) :- robot(R).
reserves(R,battery(R)) :- robot(R).
action(R,recharge(V)) :- robot(R), charger(V).
needs(R,recharge(V),at(R),V) :- robot(R), charger(V).
fills(R,recharge(V),battery(R)) :- robot(R), charger(V).
occupies(R,recharge(V),V) :- robot(R), charger(V).
number(room(R),2) :- robot(R).

#program present(k,t).
own(ID,thing(ID),V,k) :- job(ID,V,W,k).
wants(ID,thing(ID),W,k) :- job(ID,V,W,k).
action(R,(pick(ID);deliver(ID)),k) :- job(ID,V,W,k), robot(R).
given(R,pick(ID),((at(R),V);(thing(ID),V)),k) :- job(ID,V,W,k), robot(R).
sets(R,pick(ID),thing(ID),R,k) :- job(ID,V,W,k), robot(R).
uses(R,pick(ID),room(R),1,k) :- job(ID,V,W,k), robot(R).
given(R,deliver(ID),((at(R),W);(thing(ID),R)),k) :- job(ID,V,W,k), robot(R).
sets(R,deliver(ID),thing(ID),W,k) :- job(ID,V,W,k), robot(R).
gives(R,deliver(ID),room(R),1,k) :- job(ID,V,W,k), robot(R).
needs(R,A,V,X,k) :- given(R,A,(V,X),k).
"""

_WAREHOUSE = """
#const full=24.
#program base.
place(V) :- corridor(V,W).
place(W) :- corridor(V,W).
ride(V,W) :- lift(V,W).
ride(W,V) :- lift(V,W).
action(R,ride(V,W)) :- robot(R), ride(V,W).
needs(R,ride(V,W),at(R),V) :- robot(R), ride(V,W).
sets(R,ride(V,W),at(R),W) :- robot(R), ride(V,W).
occupies(R,ride(V,W),lift) :- robot(R), ride(V,W).
request(bring(V,W)) :- place(V), place(W), V != W.
#program present(k,t).
job(ID,V,W,k) :- asked(ID,bring(V,W),k).
"""

_RESTAURANT = """
#const full=80.
#program base.
request((dish(T);clear(T))) :- table(T).
#program present(k,t).
job(ID,kitchen,T,k) :- asked(ID,dish(T),k).
job(ID,T,sink,k) :- asked(ID,clear(T),k).
"""


@dataclass(frozen=True)
class OwnTask:
    """A task.

    Attributes:
        name: The domain and the size.
        texts: The encoding, without the library.
        goals: The requests.
    """

    name: str
    texts: Tuple[str, ...]
    goals: List[str]

    def write(self, folder: Path) -> List[str]:
        """Writes the encoding into a folder, and returns the planner's files."""
        file = folder / f"{self.name.replace(' ', '_')}.lp"
        file.write_text("#program base.\n" + "\n".join(self.texts))
        return [str(_LIBRARY), str(file)]


def kitchen(dishes: int) -> OwnTask:
    """Returns a kitchen with one board and two plates, and a cook for every four dishes."""
    facts = f"cook(1..{max(2, dishes // 4)}). dish(1..{dishes}). plate(1..2)."
    pots = f"pot(1..{max(2, dishes // 3)})."
    goals = [f"want({dish})" for dish in range(1, dishes + 1)]
    return OwnTask(f"kitchen {dishes}", (facts, pots, _KITCHEN), goals)


def tugs(planes: int) -> OwnTask:
    """Returns an airport where two tugs tow planes to other segments, past each other."""
    dice = random.Random(planes)
    segments = [(x, y) for x in range(max(4, planes)) for y in range(3)]
    stands = [segment for segment in segments if segment[1] != 1]
    starts, ends = dice.sample(stands, planes), dice.sample(stands, planes)
    facts = [f"plane(1..{planes}). tug(1..2)."]
    facts += [f"initially(at(tug({tug})),s(0,0))." for tug in (1, 2)]
    facts += [f"initially(pos({n}),s{stand})." for n, stand in enumerate(starts, 1)]
    facts += [f"segment(s{segment})." for segment in segments]
    facts.append("next(s(X,Y),s(V,W)) :- segment(s(X,Y)), segment(s(V,W)), |X-V|+|Y-W| = 1.")
    goals = [f"park({n},s({x},{y}))" for n, (x, y) in enumerate(ends, 1)]
    return OwnTask(f"tugs {planes}", (*facts, _TUGS), goals)


def warehouse(jobs: int) -> OwnTask:
    """Returns three floors with one lift, and a robot with a battery for every four jobs."""
    dice = random.Random(jobs)
    places = [(floor, x) for floor in range(3) for x in range(8)]
    facts = [f"robot(r(1..{max(1, jobs // 4)})). start(R,w(0,0)) :- robot(R)."]
    facts.append("corridor(w(F,X),w(F,X+1)) :- F = 0..2, X = 0..6.")
    facts.append("lift(w(F,0),w(F+1,0)) :- F = 0..1. charger(w(0,0);w(2,4)).")
    goals = [
        f"bring(w({a},{b}),w({c},{d}))"
        for (a, b), (c, d) in (dice.sample(places, 2) for _ in range(jobs))
    ]
    return OwnTask(f"warehouse {jobs}", (*facts, _ROBOTS, _WAREHOUSE), goals)


def restaurant(requests: int) -> OwnTask:
    """Returns a restaurant with tables along aisles, and a waiter for every three requests."""
    dice = random.Random(requests)
    aisles, tables = max(2, requests // 3), 2 * requests
    facts = [f"robot(r(1..{max(2, requests // 3)})). table(t(1..{tables})). charger(dock)."]
    facts.append("corridor(dock,hall). corridor(kitchen,hall). corridor(sink,kitchen).")
    facts.append("start(r(I),dock) :- robot(r(I)), I \\ 2 = 1.")
    facts.append("start(r(I),kitchen) :- robot(r(I)), I \\ 2 = 0.")
    facts.append("corridor(hall,a(1)).")
    facts += [f"corridor(a({dice.randrange(1, n)}),a({n}))." for n in range(2, aisles + 1)]
    facts += [f"corridor(a({1 + n % aisles}),t({n + 1}))." for n in range(tables)]
    goals = [
        f"{dice.choice(('dish', 'clear'))}(t({dice.randint(1, tables)}))" for _ in range(requests)
    ]
    return OwnTask(f"restaurant {requests}", (*facts, _ROBOTS, _RESTAURANT), goals)


DOMAINS: Dict[str, Callable[[int], OwnTask]] = {
    "kitchen": kitchen,
    "tugs": tugs,
    "warehouse": warehouse,
    "restaurant": restaurant,
}
"""Makes tasks of a size, by the name of the domain."""


def growing(name: str, size: int) -> Iterator[OwnTask]:
    """Yields tasks of a domain, each half as large again as the one before."""
    while True:
        size += max(1, size // 2)
        yield DOMAINS[name](size)
