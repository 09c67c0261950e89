"""Compares a running system with an encoding: interfaces, message sources, versions, files.

All of it is what the nodes say on their topics ``~about`` (docs/protocol.md, section "About").
"""

from __future__ import annotations

import os
from typing import Callable, Dict, Iterator, List, Mapping

from rosclingo.solver.options import Options
from rosclingo.solver.programs import parse_files
from rosoclingo.encodings.about import LOOP_NODE, SINGLE_NODE, Launched
from rosoclingo.encodings.alphabet import Alphabet
from rosoclingo.tools.check.findings import Finding

LiveNodes = Mapping[str, Launched]
"""How each node of a system was started, by its name."""

LiveLook = Callable[[], LiveNodes]
"""Looks at the running system."""


def compare(nodes: LiveNodes, options: Options, alphabet: Alphabet) -> Iterator[Finding]:
    """Yields the differences between a running system and the encodings.

    Args:
        nodes: The running nodes.
        options: The encodings.
        alphabet: What they declare.
    """
    loops = [node for node in nodes.values() if node.program in (LOOP_NODE, SINGLE_NODE)]
    if not loops:
        yield _finding("no planning node runs: start rosoclingo, such as by its launch file")
    for loop in sorted(loops, key=lambda one: one.node):
        planner = loop.solvers.get("planner", loop.node)
        if planner not in nodes:
            yield _finding(f"{loop.node} plans with {planner}, and there is no such node")
        else:
            yield from _files(nodes[planner], options)
    yield from _versions(nodes)
    yield from _interfaces(nodes, alphabet)


def _finding(text: str) -> Finding:
    return Finding("live", text)


def _files(planner: Launched, options: Options) -> Iterator[Finding]:
    """Yields the files of the running planner that differ from the checked ones."""
    running = {os.path.basename(path): text for path, text in planner.files.items()}
    checked = parse_files(options.files).texts
    for path, text in sorted(checked.items()):
        name = os.path.basename(path)
        if name not in running:
            yield _finding(f"{planner.node} runs without {name}, which was checked")
        elif running[name] != text:
            yield _finding(
                f"{planner.node} runs with another {name} than that which was checked, {path}"
            )
    for name in sorted(running.keys() - {os.path.basename(path) for path in checked}):
        yield _finding(f"{planner.node} runs with {name}, which was not checked")


def _versions(nodes: LiveNodes) -> Iterator[Finding]:
    """Yields the nodes by version of clingo, if versions differ."""
    users: Dict[str, List[str]] = {}
    for name, node in sorted(nodes.items()):
        version = node.versions.get("clingo")
        if version is not None:
            users.setdefault(version, []).append(name)
    if len(users) > 1:
        said = "; ".join(f"{version}: {', '.join(names)}" for version, names in users.items())
        yield _finding(f"the nodes run with different versions of clingo ({said})")


def _interfaces(nodes: LiveNodes, alphabet: Alphabet) -> Iterator[Finding]:
    """Yields each actuator without an interface, and each message without a source."""
    served = [node.actuators for node in nodes.values() if node.actuators is not None]
    for actuator in alphabet.answers:
        if not any(actuator in actuators or not actuators for actuators in served):
            yield _finding(f"no interface says that it does the actions of {actuator}")
    sent = {source for node in nodes.values() for source in node.messages}
    for source in sorted({source for source, _ in alphabet.messages} - sent):
        yield _finding(f"no node says that it sends the messages of {source}")
