"""Checks that a bag can be replayed, and lists the processes of the replay. Needs no ROS."""

from __future__ import annotations

import json
import os
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Mapping, Optional, Sequence, Tuple

from rosclingo.solver import lexical
from rosoclingo.bags.model import Recording
from rosoclingo.bags.replay.disk import from_disk, is_unchanged
from rosoclingo.bags.topics import NODE
from rosoclingo.encodings.about import LOOP_NODE, SINGLE_NODE, SOLVER_NODE, Launched
from rosoclingo.encodings.unpack import unpack
from rosoclingo.errors import BagError, LaunchedError

SOLVERS = ("controller", "planner")
_KINDS: Mapping[str, Tuple[type, ...]] = {  # of the parameters by which a loop decides
    "abort_unreachable": (bool,),
    "patience": (int, float),
    "ask_before": (list,),
    "ask_again": (int, float),
    "policies": (dict,),
}
_RENAMED: Mapping[str, str] = {"search_seconds": "patience"}  # by their names in older bags
_REMEDY = (
    'give its command line: --planner "ARGS" and --controller "ARGS", --single "ARGS", or '
    '--system "PACKAGE FILE.launch ARG:=VALUE..."'
)


@dataclass(frozen=True)
class Start:
    """A process to start.

    Attributes:
        name: What to call it in messages.
        command: Program and arguments.
        namespace: ROS namespace of the node.
        directory: Its working directory; None for this process's.
    """

    name: str
    command: Tuple[str, ...]
    namespace: str = "/"
    directory: Optional[Path] = None


def check(bag: Path, recording: Recording, allow_scripts: bool) -> None:
    """Checks that a recording can be replayed on this machine.

    Args:
        bag: Where it was read from.
        recording: The recording.
        allow_scripts: Whether the ``#script`` blocks in its files may run.

    Raises:
        BagError: It cannot; the message says why and what to do.
    """
    for name in (recording.name, *recording.programs):
        if not NODE.fullmatch(name):
            raise BagError(f"{bag}: {name!r} is no name of a node")
    for program in recording.programs.values():
        for file, text in program.files.items():
            if lexical.script(text) is not None and not allow_scripts:
                raise BagError(
                    f"{bag}: {file} has a #script block, which would run on this machine; if you "
                    "trust the bag, allow it with --allow-scripts"
                )


def starts(
    recording: Recording,
    folder: Optional[Path],
    *,
    controller: Optional[str] = None,
    planner: Optional[str] = None,
    single: Optional[str] = None,
    system: Optional[str] = None,
    store: Optional[Path] = None,
) -> List[Start]:
    """Returns the processes of the system, that with the planning loop first.

    Args:
        recording: What the bag says.
        folder: Where the files of the bag are written; None for those of the disk instead.
        controller: Another command line of the controller.
        planner: Another command line of the planner.
        single: The command line of a one-node system.
        system: Arguments of roslaunch, which starts everything.
        store: Where the run is stored, so that nodes can be killed; None for nowhere.

    Raises:
        BagError: The bag does not say enough, or what is to be different does not fit to it.
    """
    is_changed = controller is not None or planner is not None
    if system is not None:
        if store is not None:
            raise BagError("--kill needs nodes that replay.py has started; leave out --system")
        if is_changed or single is not None:
            raise BagError("--system starts everything; leave out the other command lines")
        return [Start("the system", ("roslaunch", *_split(system)))]
    settings = [*_parameters(recording), *([] if store is None else [f"_store:={store}"])]
    if single is not None:
        if is_changed:
            raise BagError("--single is one node; leave out --controller and --planner")
        return [_node(recording.name, SINGLE_NODE, [*settings, *_split(single)])]
    loop = recording.programs.get(recording.name)
    given = {"controller": controller, "planner": planner}
    if loop is None and None in given.values():
        raise BagError(f"the bag does not say what {recording.name} was started with; {_REMEDY}")
    if loop is not None and loop.program == SINGLE_NODE:
        if is_changed:
            raise BagError("the bag is of a system of one node: use --single for its arguments")
        return [_recorded(loop, folder, settings)]
    if loop is not None and loop.program != LOOP_NODE:
        raise BagError(f"the bag has an unknown program, {loop.program!r}; {_REMEDY}")
    names = _solver_names(recording, loop)
    remappings = [f"_{role}:={names[role]}" for role in SOLVERS]
    made = [_node(recording.name, LOOP_NODE, [*remappings, *settings])]
    for role in SOLVERS:
        line = given[role]
        program = recording.programs.get(names[role])
        if line is not None:
            made.append(_node(names[role], SOLVER_NODE, _split(line)))
        elif program is not None and program.program == SOLVER_NODE:
            made.append(_recorded(program, folder))
        else:
            raise BagError(
                f"the bag does not say what the {role}, {names[role]}, was started with; give its "
                f'command line: --{role} "ARGS"'
            )
    return made


def has_same_encodings(recording: Recording, given: Sequence[Optional[str]], *, disk: bool) -> bool:
    """Returns whether the system that :func:`starts` returns is known to have the bag's encodings.

    Args:
        recording: What the bag says.
        given: The command lines that replace the bag's; None for one that does not.
        disk: Whether the files of the disk are used instead of the bag's.
    """
    if any(line is not None for line in given):
        return False
    return not disk or all(map(is_unchanged, recording.programs.values()))


def _solver_names(recording: Recording, loop: Optional[Launched]) -> Dict[str, str]:
    namespace = recording.name.rpartition("/")[0]
    names = {role: f"{namespace}/{role}" for role in SOLVERS}
    if loop is not None:
        names.update({role: name for role, name in loop.solvers.items() if role in names})
    return names


def _parameters(recording: Recording) -> List[str]:
    """Returns arguments that set the parameters by which the loop decides, as the bag has them.

    ``~action_timeout`` is none of them: an action's failure after it is an input of the recording.

    Raises:
        BagError: The bag has a value that is none.
    """
    loop = recording.programs.get(recording.name)
    words = []
    for recorded, value in loop.parameters.items() if loop is not None else ():
        name = _RENAMED.get(recorded, recorded)
        if name not in _KINDS:
            continue  # of another version
        if type(value) not in _KINDS[name]:  # true is no number
            raise BagError(
                f"the bag has a wrong value of the parameter {recorded} of {recording.name}; "
                f"{_REMEDY}"
            )
        words.append(f"_{name}:={json.dumps(value)}")
    return words


def _recorded(program: Launched, folder: Optional[Path], more: Sequence[str] = ()) -> Start:
    remapping = next((one for one in program.arguments if ":=" in one), None)
    if remapping is not None:
        raise BagError(
            f"the bag has the argument {remapping!r} of {program.node}, which record.py does not "
            f"write; {_REMEDY}"
        )
    own = program.node.strip("/").replace("/", ".")  # which no name of a node has
    directory = Path(program.directory) if os.path.isdir(program.directory) else None
    try:
        if folder is None:
            arguments = from_disk(program)
        else:
            arguments, directory = unpack(program, folder / own)
    except LaunchedError as err:
        raise BagError(f"{err}; {_REMEDY}") from err
    except (OSError, ValueError) as err:
        raise BagError(
            f"the files of {program.node} cannot be written to {folder}: {err}; use --files disk"
        ) from err
    return _node(program.node, program.program, [*more, *arguments], directory)


def _node(name: str, program: str, arguments: List[str], directory: Optional[Path] = None) -> Start:
    namespace, _, base = name.rpartition("/")
    command = ("rosrun", *program.split(), f"__name:={base}", *arguments)
    return Start(base, command, namespace or "/", directory)


def _split(line: str) -> List[str]:
    try:
        return shlex.split(line)
    except ValueError as err:
        raise BagError(f"the command line {line!r} cannot be split into words: {err}") from err
