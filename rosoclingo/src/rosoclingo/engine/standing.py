"""What a better plan keeps of the one that stands: what is begun, and who does what.

An actuator's next action in the plan that stands, with the way to it, is begun: a better plan has
the same ones first, in any case. Other actions may be given to other actuators, if the plan gains
more than a margin for each of them.
"""

from __future__ import annotations

MARGIN = 1
"""How much a plan has to gain for each action that it gives to another actuator, in the units of
the first part of its value that gets better, such as steps."""


class Standing:
    """The plan that stands, for comparison with others. Used by one thread at a time.

    Attributes:
        begun: The actions that are begun.
    """

    def __init__(
        self, plan: list[int], actors: list[int], names: list[int], begun: list[list[int]]
    ) -> None:
        """Takes the plan.

        Args:
            plan: The numbers of its actions.
            actors: The actuator of each action of the task.
            names: A number for each action of the task, the same one for what different actuators
                can do in each other's place; -1 for what does not count, such as ways.
            begun: For actuators that have begun something, the first of their actions in the plan.
        """
        self._plan = plan
        self._actors = actors
        self._names = names
        self._begun = {actors[first[0]]: first for first in begun if first}
        self.begun = [index for first in begun for index in first]

    def keeps(self, plan: list[int]) -> bool:
        """Tells whether a plan has first what is begun."""
        left = {actor: first[::-1] for actor, first in self._begun.items()}
        for index in plan:
            if not left:
                return True
            first = left.get(self._actors[index])
            if first is None:
                continue
            if first.pop() != index:
                return False
            if not first:
                del left[self._actors[index]]
        return not left

    def is_gain(self, before: tuple[int, ...], after: tuple[int, ...], plan: list[int]) -> bool:
        """Tells whether a plan gains enough for what it gives to other actuators.

        Args:
            before: The value of the plan that stands.
            after: The value of the other plan, which is smaller.
            plan: The other plan.
        """
        names = self._names
        lost, added = set(self._plan).difference(plan), set(plan).difference(self._plan)
        given = {names[index] for index in added if names[index] >= 0}
        moved = [index for index in lost if names[index] in given]
        gain = next((old - new for old, new in zip(before, after) if old != new), 0)
        return gain >= MARGIN * len(moved)
