"""Unpacks the files of a node from a bag, and rewrites its command line to their paths."""

from __future__ import annotations

import os
import posixpath
import re
from itertools import takewhile
from pathlib import Path
from typing import Callable, Iterator, List, Mapping, Optional, Tuple

import rospkg

from rosclingo.errors import OptionsError, ProgramError
from rosclingo.solver import lexical
from rosclingo.solver.options import Argument, arguments
from rosoclingo.bags.errors import BagError
from rosoclingo.bags.model import Program

_INCLUDE = re.compile(r'(#include\s*")([^"]*)(")')


class ReplayError(BagError):
    """A bag cannot be replayed; the message says why and what to do."""


def unpack(program: Program, folder: Path) -> Tuple[List[str], Path]:
    """Writes a program's files as they were when it was recorded.

    Their paths are kept, below the folder, and their includes lead there.

    Args:
        program: What the bag says of the node.
        folder: Where they are written.

    Returns:
        The command line with the new paths, and the working directory that it needs.

    Raises:
        ReplayError: The bag does not have a file of the command line.
    """
    for path, text in program.files.items():
        file = _below(folder, path)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(_move_includes(text, path, program, folder), encoding="utf-8")
    command_line = _with_files(program, lambda path: str(_below(folder, _find(path, program))))
    directory = _below(folder, _directory(program))
    directory.mkdir(parents=True, exist_ok=True)
    return command_line, directory


def from_disk(program: Program) -> List[str]:
    """Returns the command line with the files as they are now.

    A file of a ROS package is looked for in that package, wherever it is on this machine, and else
    where it was when it was recorded: first by the name that the command line has for it, which may
    be a link, and next to which its includes are.

    Raises:
        ReplayError: One is not there any more.
    """
    packages = rospkg.RosPack()

    def existing(path: str) -> str:
        recorded = _find(path, program)
        named = posixpath.join(program.directory, os.path.expanduser(path))
        names = [named, f"{named}.lp"] if program.directory else []
        for place in (*names, recorded):
            for candidate in (*_in_packages(place, packages), place):
                if os.path.isfile(candidate):
                    return candidate
        for candidate in (path, f"{path}.lp"):
            if os.path.isfile(candidate):
                return candidate
        raise ReplayError(
            f"{recorded} of {program.node} is not there any more; leave out --files disk to use "
            "what the bag has"
        )

    return _with_files(program, existing)


def is_unchanged(program: Program) -> bool:
    """Whether the files that :func:`from_disk` uses have the contents that the bag has."""
    packages = rospkg.RosPack()

    def is_same(path: str, text: str) -> bool:
        found = next(filter(os.path.isfile, (*_in_packages(path, packages), path)), None)
        try:
            return found is not None and Path(found).read_text(encoding="utf-8") == text
        except (OSError, ValueError):  # nobody may read it, or it is no text
            return False

    return all(is_same(path, text) for path, text in program.files.items())


def _in_packages(path: str, packages: rospkg.RosPack) -> Iterator[str]:
    """Yields the paths that a file may have in packages named as its folders, the nearest first."""
    parts = path.split("/")
    for place in range(len(parts) - 2, 0, -1):
        try:
            yield os.path.join(packages.get_path(parts[place]), *parts[place + 1 :])
        except rospkg.ResourceNotFound:
            continue


def _with_files(program: Program, change: Callable[[str], str]) -> List[str]:
    """Returns a program's command line with other paths."""
    changed: List[str] = []
    for option, value in _arguments(program):
        changed += [option] if option else []
        changed.append(change(value) if option == "-f" else value)
    return changed


def _arguments(program: Program) -> List[Argument]:
    try:
        return list(arguments(program.arguments))
    except OptionsError as err:
        raise ReplayError(
            f"the command line of {program.node} is wrong: {err}; give another one with --planner, "
            "--controller or --single"
        ) from err


def _find(path: str, program: Program) -> str:
    """Returns which of the recorded files a path of the command line means.

    Older bags do not say that. They have the real paths of files, which the command line may name
    from a working directory, by a link, or without ``.lp``: the one that is most alike counts.
    """
    known = program.paths.get(path)
    if known in program.files:
        return str(known)
    ranked = sorted(program.files, key=lambda file: _likeness(path, file), reverse=True)
    if ranked and (_likeness(path, ranked[0]) > 0 or len(ranked) == 1):
        return ranked[0]
    raise ReplayError(
        f"the bag does not have the file {path} of {program.node}; use --files disk, or give a "
        "command line with --planner, --controller or --single"
    )


def _likeness(path: str, file: str) -> float:
    """Returns how many of their last parts are the same; a bit less without the ``.lp``."""
    best = 0.0
    for less, candidate in ((0.0, path), (0.5, f"{path}.lp")):
        pairs = zip(reversed(_parts(candidate)), reversed(_parts(file)))
        same = takewhile(lambda pair: pair[0] == pair[1], pairs)
        best = max(best, len(list(same)) - less)
    return best


def _directory(program: Program) -> str:
    """Returns the working directory.

    Older bags do not say it; then that from which the command line's paths and includes fit.
    """
    if program.directory:
        return program.directory
    paths = [value for option, value in _arguments(program) if option == "-f"]
    for text in program.files.values():
        paths += [match.group(2) for match in _INCLUDE.finditer(text)]
    for path in paths:
        if not posixpath.isabs(path):
            found = _base(posixpath.normpath(path), program.files)
            if found is not None:
                return found
    return "/"


def _base(path: str, files: Mapping[str, str]) -> Optional[str]:
    """Returns the folder from which a relative path leads to one of the files."""
    for file in sorted(files):
        for ending in (path, f"{path}.lp"):
            if file.endswith(f"/{ending}"):
                return file[: -len(ending)]
    return None


def _move_includes(text: str, path: str, program: Program, folder: Path) -> str:
    """Rewrites a file's includes to the files of the bag, in older bags as far as that is sure."""
    includes = program.includes.get(path, {})

    def moved(name: str) -> Optional[str]:
        if name in includes:
            return str(_below(folder, includes[name]))
        is_known = posixpath.isabs(name) and posixpath.normpath(name) in program.files
        return str(_below(folder, name)) if is_known else None

    try:
        return lexical.with_includes(text, moved)
    except ProgramError:  # nobody has loaded it, as clingo does not; it may say why
        return text


def _below(folder: Path, path: str) -> Path:
    """Returns where a path of the bag is below a folder, which it cannot leave."""
    return folder / posixpath.normpath("/" + path).lstrip("/")


def _parts(path: str) -> List[str]:
    return [part for part in path.split("/") if part not in ("", ".", "..")]
