"""Whether a running system fits an encoding: interfaces, sources of messages, versions, files.

All of it is what the nodes say on their topics ``~about`` (docs/protocol.md, section "About").
"""

from __future__ import annotations

import os
from typing import Any, Callable, Dict, Iterator, List, Mapping

from rosclingo.solver.options import Options
from rosclingo.solver.programs import parse_files
from rosoclingo.check.alphabet import Alphabet
from rosoclingo.check.findings import Finding

Abouts = Mapping[str, Mapping[str, Any]]
"""What each node says of itself, by its name."""

Look = Callable[[], Abouts]
"""Looks at the running system."""

_LOOPS = ("rosoclingo run.py", "rosoclingo run-1.0.py")


def compare(abouts: Abouts, options: Options, alphabet: Alphabet) -> Iterator[Finding]:
    """Yields what does not fit.

    Args:
        abouts: What the nodes say of themselves.
        options: The encodings.
        alphabet: What they declare.
    """
    loops = {name: about for name, about in abouts.items() if about.get("program") in _LOOPS}
    if not loops:
        yield _finding("no planning node runs: start rosoclingo, such as by its launch file")
    for name, about in sorted(loops.items()):
        planner = str(about.get("solvers", {}).get("planner", name))
        if planner not in abouts:
            yield _finding(f"{name} plans with {planner}, and there is no such node")
        else:
            yield from _files(planner, abouts[planner], options)
    yield from _versions(abouts)
    yield from _interfaces(abouts, alphabet)


def _finding(text: str) -> Finding:
    return Finding("live", text)


def _files(planner: str, about: Mapping[str, Any], options: Options) -> Iterator[Finding]:
    """Says which files are others than those that were checked."""
    running = {os.path.basename(path): entry for path, entry in about.get("files", {}).items()}
    checked = parse_files(options.files).texts
    for path, text in sorted(checked.items()):
        name = os.path.basename(path)
        if name not in running:
            yield _finding(f"{planner} runs without {name}, which was checked")
        elif running[name].get("text") != text:
            yield _finding(
                f"{planner} runs with another {name} than that which was checked, {path}"
            )
    for name in sorted(running.keys() - {os.path.basename(path) for path in checked}):
        yield _finding(f"{planner} runs with {name}, which was not checked")


def _versions(abouts: Abouts) -> Iterator[Finding]:
    """Says which nodes have other versions of clingo, of those that have one."""
    users: Dict[str, List[str]] = {}
    for name, about in sorted(abouts.items()):
        version = about.get("versions", {}).get("clingo")
        if version is not None:
            users.setdefault(str(version), []).append(name)
    if len(users) > 1:
        said = "; ".join(f"{version}: {', '.join(names)}" for version, names in users.items())
        yield _finding(f"the nodes run with different versions of clingo ({said})")


def _interfaces(abouts: Abouts, alphabet: Alphabet) -> Iterator[Finding]:
    """Says which actuator has no interface, and which message no source."""
    served = [about["actuators"] for about in abouts.values() if "actuators" in about]
    for actuator in alphabet.answers:
        if not any(actuator in actuators or not actuators for actuators in served):
            yield _finding(f"no interface says that it does the actions of {actuator}")
    sent = {source for about in abouts.values() for source in about.get("messages", ())}
    for source in sorted({source for source, _ in alphabet.messages} - sent):
        yield _finding(f"no node says that it sends the messages of {source}")
