"""The topics of a system, with the types of their messages. Needs no ROS."""

from __future__ import annotations

import re
from typing import Iterable, List, Mapping, Tuple

NODE = re.compile(r"(/[A-Za-z]\w*)+", re.ASCII)
"""A resolved name of a node."""

MD5SUMS: Mapping[str, str] = {
    "actionlib_msgs/GoalID": "302881f31927c1df708a2dbab0e80ee8",
    "actionlib_msgs/GoalStatusArray": "8b2b82f13216d0a8ea88bd3af735e619",
    "rosclingo/ROSClingoActionFeedback": "cfc8df433733b209d8d27c4550e82185",
    "rosclingo/ROSClingoActionGoal": "a954f14b3320c8eab8820876f876a308",
    "rosclingo/ROSClingoActionResult": "35254b6ae782e495beaf0013e2e11e74",
    "rosclingo/ROSClingoControlLog": "e29c446218f3573cbbfa9c187b4b6eba",
    "rosoclingo/ROSoClingoActionFeedback": "82e97615735594b25e2cee3da22d3eb7",
    "rosoclingo/ROSoClingoActionGoal": "a564766fd8aefcfc4f48c76156e15a29",
    "rosoclingo/ROSoClingoActionResult": "5489bcfa93e36e07a0b801f3ac4c7c97",
    "rosoclingo/ROSoClingoAnswer": "6c783d9ad2841170005517bac0273823",
    "rosoclingo/ROSoClingoDispatch": "cbd1e9b1c6e31320f355e10804c8691c",
    "rosoclingo/ROSoClingoEvent": "2a31dfc214852870398149dd202c7519",
    "rosoclingo/ROSoClingoHeld": "589fb7f76acfbf401f84ae35610eb68f",
    "rosoclingo/ROSoClingoIn": "0b40d0b5a778942032d78099d7e20200",
    "rosoclingo/ROSoClingoOut": "9a51ce6280ae95d37f544ff777ac99c9",
    "rosoclingo/ROSoClingoPlan": "d1cce18e22b1eeb482fd2a05a3b11771",
    "std_msgs/String": "992ce8a1687cec8c8bd883ec73ca41d1",
}
"""MD5 sums of the messages; comments and constants' order of a definition do not change them."""

OLDER_MD5SUMS: Mapping[str, str] = {
    "rosoclingo/ROSoClingoActionGoal": "858a91ebec593e8ed539fb774286cfb5",  # without information
    "rosoclingo/ROSoClingoHeld": "8ee7bbea4daafa125ab99a064d816a00",  # without tokens
}
"""MD5 sums of older definitions that have less fields, which bags may have, too."""

LOOP_TYPES: Mapping[str, str] = {
    "about": "std_msgs/String",
    "journal": "rosoclingo/ROSoClingoEvent",
    "goal": "rosoclingo/ROSoClingoActionGoal",
    "cancel": "actionlib_msgs/GoalID",
    "in": "rosoclingo/ROSoClingoIn",
    "out": "rosoclingo/ROSoClingoOut",
    "dispatch": "rosoclingo/ROSoClingoDispatch",
    "answer": "rosoclingo/ROSoClingoAnswer",
    "plan": "rosoclingo/ROSoClingoPlan",
    "held": "rosoclingo/ROSoClingoHeld",
    "status": "actionlib_msgs/GoalStatusArray",
    "feedback": "rosoclingo/ROSoClingoActionFeedback",
    "result": "rosoclingo/ROSoClingoActionResult",
}
"""The topics below the node with the planning loop."""

SOLVER_TYPES: Mapping[str, str] = {
    "about": "std_msgs/String",
    "control_log": "rosclingo/ROSClingoControlLog",
    "goal": "rosclingo/ROSClingoActionGoal",
    "cancel": "actionlib_msgs/GoalID",
    "feedback": "rosclingo/ROSClingoActionFeedback",
    "result": "rosclingo/ROSClingoActionResult",
}
"""The topics below a solver node; its status list comes often and says nothing more."""


def loop_topics(name: str) -> List[str]:
    """Returns the topics of the node with the planning loop.

    Args:
        name: Resolved name of the node, such as ``/rosoclingo``.
    """
    return [f"{name}/{topic}" for topic in LOOP_TYPES]


def solver_topics(names: Iterable[str]) -> List[str]:
    """Returns the topics of the solver nodes that a planning loop uses.

    Args:
        names: The solvers' names. What is no name of a node is left out: a recorder that subscribes
            to it waits for the master for ever.
    """
    return [f"{node}/{topic}" for node in names if NODE.fullmatch(node) for topic in SOLVER_TYPES]


def resolved(topic: str) -> str:
    """Resolves a topic's name in the root namespace; ``rosbag record`` writes it as typed."""
    return "/" + "/".join(filter(None, topic.split("/")))


def owner(topic: str) -> Tuple[str, str]:
    """Returns the name of the node that a private topic belongs to, and the topic's last name."""
    node, _, last = topic.rpartition("/")
    return node, last
