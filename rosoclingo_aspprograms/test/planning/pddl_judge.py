"""Validates plans by unified-planning, which has PDDL's semantics from elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import List, Optional, Sequence


def judged(domain: Path, problem: Path, plan: Sequence[str], lasts: Optional[int]) -> bool:
    """Returns whether unified-planning finds a plan valid.

    Args:
        domain: The file of the domain.
        problem: The file of the problem.
        plan: Its steps in PDDL's words, one after another.
        lasts: How long each takes; None if actions have no duration.
    """
    from unified_planning import shortcuts  # noqa: PLC0415 (it takes a second)
    from unified_planning.io import PDDLReader  # noqa: PLC0415

    shortcuts.get_environment().credits_stream = None
    task = PDDLReader().parse_problem(str(domain), str(problem))
    steps: List[str] = [f"({step})" for step in plan]
    if lasts is not None:
        steps = [f"{number * (lasts + 1)}.0: {s} [{lasts}.0]" for number, s in enumerate(steps)]
    parsed = PDDLReader().parse_plan_string(task, "\n".join(steps))
    with shortcuts.PlanValidator(problem_kind=task.kind, plan_kind=parsed.kind) as validator:
        return bool(validator.validate(task, parsed))
