"""Planning tasks in PDDL, one for each feature; small, so that a search of all states ends."""

from __future__ import annotations

from typing import Dict, Tuple

_BLOCKS = """(define (domain blocks)
(:requirements :typing :derived-predicates :adl)
(:types block)
(:predicates (on ?x ?y - block) (ontable ?x - block) (holding ?x - block) (above ?x ?y - block)
  (clear ?x - block) (handempty))
(:derived (above ?x ?y - block)
  (or (on ?x ?y) (exists (?z - block) (and (on ?x ?z) (above ?z ?y)))))
(:derived (clear ?x - block)
  (and (not (holding ?x)) (forall (?y - block) (not (on ?y ?x)))))
(:derived (handempty) (forall (?x - block) (not (holding ?x))))
(:action pick-up :parameters (?x - block)
  :precondition (and (clear ?x) (ontable ?x) (handempty))
  :effect (and (holding ?x) (not (ontable ?x))))
(:action put-down :parameters (?x - block)
  :precondition (holding ?x) :effect (and (not (holding ?x)) (ontable ?x)))
(:action stack :parameters (?x ?y - block)
  :precondition (and (holding ?x) (clear ?y)) :effect (and (on ?x ?y) (not (holding ?x))))
(:action unstack :parameters (?x ?y - block)
  :precondition (and (on ?x ?y) (clear ?x) (handempty))
  :effect (and (holding ?x) (not (on ?x ?y)))))
"""
_BLOCKS_PROBLEM = """(define (problem p) (:domain blocks) (:objects a b c d - block)
(:init (ontable a) (on b a) (on c b) (ontable d))
(:goal (and (above a d) (above d c) (not (above b d)))))
"""

# Power supply: a switch that is closed leads on; a fault in what is fed is upstream's trouble.
_GRID = """(define (domain grid)
(:requirements :typing :derived-predicates :negative-preconditions)
(:types node switch)
(:predicates (source ?n - node) (wire ?s - switch ?a ?b - node) (closed ?s - switch)
  (broken ?n - node) (fed ?n - node) (joined ?a ?b - node) (danger) (known ?s - switch))
(:derived (joined ?a ?b - node)
  (exists (?s - switch) (and (closed ?s) (or (wire ?s ?a ?b) (wire ?s ?b ?a)))))
(:derived (fed ?n - node)
  (or (source ?n) (exists (?m - node) (and (fed ?m) (joined ?m ?n)))))
(:derived (danger) (exists (?n - node) (and (broken ?n) (fed ?n))))
(:action close :parameters (?s - switch)
  :precondition (and (not (closed ?s)) (not (danger))) :effect (closed ?s))
(:action open :parameters (?s - switch)
  :precondition (closed ?s) :effect (not (closed ?s))))
"""
_GRID_PROBLEM = """(define (problem p) (:domain grid)
(:objects g1 g2 n1 n2 n3 n4 - node s1 s2 s3 s4 s5 - switch)
(:init (source g1) (source g2) (wire s1 g1 n1) (wire s2 n1 n2) (wire s3 n2 n3) (wire s4 n3 n4)
  (wire s5 g2 n4) (broken n2) (closed s1) (closed s2) (closed s3))
(:goal (and (fed n1) (fed n3) (fed n4) (not (danger)) (not (fed n2)))))
"""

_ORDERS = """(define (domain orders)
(:requirements :adl :typing)
(:types order product)
(:predicates (includes ?o - order ?p - product) (made ?p - product) (started ?o - order)
  (shipped ?o - order) (stack-free) (waiting ?o - order))
(:action start :parameters (?o - order) :precondition (and (waiting ?o) (stack-free))
  :effect (and (started ?o) (not (waiting ?o)) (not (stack-free))))
(:action make :parameters (?p - product)
  :precondition (and (not (made ?p))
    (forall (?o - order) (imply (includes ?o ?p) (started ?o)))
    (exists (?o - order) (includes ?o ?p)))
  :effect (made ?p))
(:action more :parameters () :precondition (not (stack-free)) :effect (stack-free))
(:action ship :parameters (?o - order)
  :precondition (and (started ?o) (forall (?p - product) (imply (includes ?o ?p) (made ?p))))
  :effect (and (shipped ?o) (not (started ?o)) (stack-free))))
"""
_ORDERS_PROBLEM = """(define (problem p) (:domain orders)
(:objects o1 o2 o3 - order a b c - product)
(:init (stack-free) (waiting o1) (waiting o2) (waiting o3) (includes o1 a) (includes o1 b)
  (includes o2 b) (includes o3 c))
(:goal (and (forall (?o - order) (shipped ?o)) (exists (?p - product) (and (made ?p)
  (not (includes o1 ?p)))))))
"""

_TRUCK = """(define (domain truck)
(:requirements :adl :typing :numeric-fluents :derived-predicates)
(:types place)
(:predicates (at ?p - place) (road ?a ?b - place) (pump ?p - place) (low) (rich) (honked))
(:functions (fuel) (coins) (toll ?p - place))
(:derived (low) (< (fuel) 2))
(:derived (rich) (or (>= (coins) 3) (and (at bank) (not (low)))))
(:constants bank - place)
(:action drive :parameters (?a ?b - place)
  :precondition (and (at ?a) (road ?a ?b) (>= (fuel) 1) (>= (coins) (toll ?b)))
  :effect (and (at ?b) (not (at ?a)) (decrease (fuel) 1) (decrease (coins) (toll ?b))))
(:action fill :parameters (?p - place) :precondition (and (at ?p) (pump ?p) (low))
  :effect (assign (fuel) 4))
(:action earn :parameters () :precondition (and (at bank) (< (coins) 3))
  :effect (increase (coins) 1))
(:action honk :parameters () :precondition (and (rich) (not (low))) :effect (honked)))
"""
_TRUCK_PROBLEM = """(define (problem p) (:domain truck) (:objects x y - place)
(:init (at x) (road x y) (road y x) (road y bank) (road bank y) (pump y) (= (fuel) 3) (= (coins) 1)
  (= (toll x) 0) (= (toll y) 0) (= (toll bank) 1))
(:goal GOAL))
"""

_PARCELS = """(define (domain parcels)
(:requirements :adl :typing)
(:types place - object box bag - thing thing - object)
(:predicates (at ?x - (either box bag) ?p - place) (robot-at ?p - place)
  (held ?x - (either box bag)) (full ?b - bag) (lit ?p - place))
(:constants home - place)
(:action go :parameters (?a ?b - place) :precondition (and (robot-at ?a) (not (= ?a ?b)))
  :effect (and (not (robot-at ?a)) (robot-at ?b)
    (forall (?x - (either box bag)) (when (and (at ?x ?a) (held ?x))
      (and (at ?x ?b) (not (at ?x ?a)))))
    (when (or (exists (?x - box) (at ?x ?b)) (= ?b home)) (lit ?b))))
(:action grasp :parameters (?x - (either box bag) ?p - place)
  :precondition (and (robot-at ?p) (at ?x ?p) (forall (?y - (either box bag)) (not (held ?y))))
  :effect (held ?x))
(:action drop :parameters (?x - (either box bag)) :precondition (held ?x) :effect (not (held ?x)))
(:action stuff :parameters (?b - bag ?x - box ?p - place)
  :precondition (and (at ?b ?p) (at ?x ?p) (robot-at ?p) (not (full ?b)))
  :effect (full ?b)))
"""
_PARCELS_PROBLEM = """(define (problem p) (:domain parcels)
(:objects a b - place x1 x2 - box g1 - bag)
(:init (robot-at home) (at x1 a) (at x2 b) (at g1 home))
(:goal (and (not (robot-at home)) (not (at x1 a)) (or (full g1) (held x2)) (lit home)
  (imply (lit a) (at x1 home)) (not (held x2)))))
"""

_SPREAD = """(define (domain spread)
(:requirements :adl :typing)
(:types tile colour)
(:predicates (is ?t - tile ?c - colour) (next ?a ?b - tile) (checked) (won))
(:action paint :parameters (?t - tile ?old ?new - colour)
  :precondition (and (is ?t ?old) (not (= ?old ?new)) (not (checked)))
  :effect (and (not (is ?t ?old)) (is ?t ?new)))
(:action check :parameters ()
  :precondition (and (not (checked)) (forall (?a ?b - tile) (imply (next ?a ?b)
    (exists (?c ?d - colour) (and (is ?a ?c) (is ?b ?d) (not (= ?c ?d)))))))
  :effect (checked)))
"""


def _spread(tiles: int, colours: int) -> str:
    names = [f"t{number}" for number in range(tiles)]
    nexts = " ".join(f"(next {a} {b})" for a, b in zip(names, names[1:]))
    first = " ".join(f"(is {name} c0)" for name in names)
    kinds = " ".join(f"c{number}" for number in range(colours))
    return (
        f"(define (problem p) (:domain spread) (:objects {' '.join(names)} - tile {kinds} - colour)"
        f"\n(:init {nexts} {first})\n(:goal (and (checked) (forall (?t - tile) (or "
        "(is ?t c0) (is ?t c1))) (not (is t0 c0)))))\n"
    )


_GUARD = """(define (domain guard)
(:requirements :adl :typing :derived-predicates)
(:types robot door room)
(:predicates (in ?r - robot ?x - room) (leads ?d - door ?a ?b - room) (shut ?d - door)
  (way ?a ?b - room) (alone ?r - robot) (seen ?r - robot ?x - room))
(:derived (way ?a ?b - room) (or
  (exists (?d - door) (and (leads ?d ?a ?b) (not (shut ?d))))
  (exists (?c - room) (and (way ?a ?c) (way ?c ?b)))))
(:derived (alone ?r - robot) (exists (?x - room) (and (in ?r ?x)
  (forall (?q - robot) (or (= ?q ?r) (not (in ?q ?x)))))))
(:action walk :parameters (?r - robot ?a ?b - room) :precondition (and (in ?r ?a) (way ?a ?b))
  :effect (and (in ?r ?b) (not (in ?r ?a)) (when (alone ?r) (seen ?r ?a))))
(:action shut :parameters (?r - robot ?d - door ?a ?b - room)
  :precondition (and (in ?r ?a) (leads ?d ?a ?b) (not (shut ?d))) :effect (shut ?d))
(:action open :parameters (?r - robot ?d - door ?a ?b - room)
  :precondition (and (in ?r ?a) (leads ?d ?a ?b) (shut ?d)) :effect (not (shut ?d))))
"""
_GUARD_PROBLEM = """(define (problem p) (:domain guard)
(:objects left right - robot d1 d2 - door a b c - room)
(:init (in left a) (in right a) (leads d1 a b) (leads d1 b a) (leads d2 b c) (leads d2 c b)
  (shut d1) (shut d2))
(:goal (and (in left c) (alone right) (not (way a c)) (seen right b) (not (way b a)))))
"""

_OVEN = """(define (domain oven)
(:requirements :durative-actions :typing :derived-predicates :adl)
(:types loaf)
(:predicates (hot) (gas) (spark) (ready) (baked ?l - loaf) (free))
(:derived (ready) (and (hot) (or (gas) (spark))))
(:durative-action heat :parameters () :duration (= ?duration 3)
  :condition (over all (or (gas) (spark))) :effect (at end (hot)))
(:durative-action connect :parameters () :duration (= ?duration 1) :condition (at start (not (gas)))
  :effect (at end (gas)))
(:durative-action bake :parameters (?l - loaf) :duration (= ?duration 5)
  :condition (and (over all (ready)) (at start (free)))
  :effect (and (at start (not (free))) (at end (free)) (at end (baked ?l)))))
"""
_OVEN_PROBLEM = """(define (problem p) (:domain oven) (:objects l1 l2 - loaf) (:init (free))
(:goal (and (baked l1) (baked l2))))
"""

TASKS: Dict[str, Tuple[str, str]] = {
    "derived, recursive and denied": (_BLOCKS, _BLOCKS_PROBLEM),
    "derived from derived": (_GRID, _GRID_PROBLEM),
    "forall, imply and exists in conditions": (_ORDERS, _ORDERS_PROBLEM),
    "or of numbers in the goal": (
        _TRUCK,
        _TRUCK_PROBLEM.replace("GOAL", "(or (>= (fuel) 9) (and (at bank) (>= (coins) 3)))"),
    ),
    "a number in the goal that is right at first": (
        _TRUCK,
        _TRUCK_PROBLEM.replace("GOAL", "(and (at bank) (>= (fuel) 1))"),
    ),
    "derived from numbers": (
        _TRUCK,
        _TRUCK_PROBLEM.replace("GOAL", "(and (honked) (low) (not (= (coins) 2)) (at x))"),
    ),
    "either, nested effects, denied goals": (_PARCELS, _PARCELS_PROBLEM),
    "far too many alternatives": (_SPREAD, _spread(8, 4)),
    "derived, with two robots": (_GUARD, _GUARD_PROBLEM),
    "derived, with durations": (_OVEN, _OVEN_PROBLEM),
}
"""The domain and the problem of each task; all have a plan."""
