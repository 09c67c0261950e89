"""Explains plans: why there is none, why a goal waits, why this action and not that, what if.

A :class:`.situation.Situation` is what the planner was told, and what the loop knows beside.
It is taken from the loop, or from the planner's control log, and can be sent to another process.
There, a :class:`.explainer.Explainer` answers by a planner of its own, a *copy*, that is told the
same or less: nothing here touches the planner that plans.

What was told is a list of *facts* (:mod:`.facts`), each of which can be left out: a goal, a cancel
request, an announcement, a failure, what was saved at a reset. What the robots did is left out from
its end on, because each action rests on those before it. A *reason* (:mod:`.reason`) is a set of
facts with which alone there is no plan either, while there is one without any of them.

There are two kinds of copies (:mod:`.planner_copy`):

- :class:`.copy_by_assumptions.AssumingCopy`: where events are externals, one grounding serves all
  questions. A search assumes which of the facts are true, and clingo says which of them exclude a
  plan.
- :class:`.copy_by_regrounding.RebuildingCopy`: where an event is told by grounding, it cannot be
  assumed: what is grounded later (such as the rounds of a shortest way) rests on what is decided by
  then. So the copy begins anew for each set of facts, and is told these in the steps in which they
  happened.
"""
