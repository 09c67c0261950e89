; Robots bring boxes from room to room, through one door at a time, with batteries and room for two boxes.
(define (domain delivery)
  (:requirements :strips :typing :negative-preconditions :numeric-fluents :durative-actions)
  (:types robot room box - object)
  (:predicates (robot_at ?r - robot ?x - room) (box_at ?b - box ?x - room)
    (carries ?r - robot ?b - box) (connected ?x ?y - room) (station ?x - room) (door_free))
  (:functions (battery ?r - robot) (load ?r - robot) (distance ?x ?y - room))

  (:durative-action go
    :parameters (?r - robot ?x ?y - room)
    :duration (= ?duration (* 2 (distance ?x ?y)))
    :condition (and (at start (robot_at ?r ?x)) (at start (connected ?x ?y)) (at start (door_free))
      (at start (>= (battery ?r) (distance ?x ?y))))
    :effect (and (at start (not (robot_at ?r ?x))) (at end (robot_at ?r ?y))
      (at start (not (door_free))) (at end (door_free))
      (at end (decrease (battery ?r) (distance ?x ?y)))))

  (:durative-action charge
    :parameters (?r - robot ?x - room)
    :duration (= ?duration 5)
    :condition (and (over all (robot_at ?r ?x)) (at start (station ?x)))
    :effect (at end (assign (battery ?r) 10)))

  (:durative-action take
    :parameters (?r - robot ?b - box ?x - room)
    :duration (= ?duration 1)
    :condition (and (over all (robot_at ?r ?x)) (at start (box_at ?b ?x)) (at start (< (load ?r) 2)))
    :effect (and (at start (not (box_at ?b ?x))) (at end (carries ?r ?b))
      (at end (increase (load ?r) 1))))

  (:durative-action put
    :parameters (?r - robot ?b - box ?x - room)
    :duration (= ?duration 1)
    :condition (and (over all (robot_at ?r ?x)) (at start (carries ?r ?b)))
    :effect (and (at end (not (carries ?r ?b))) (at end (box_at ?b ?x))
      (at end (decrease (load ?r) 1)))))
