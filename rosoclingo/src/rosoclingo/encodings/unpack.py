"""Writes the files of a node to a folder, and rewrites its command line to their paths."""

from __future__ import annotations

import posixpath
import re
from itertools import takewhile
from pathlib import Path
from typing import Callable, List, Mapping, Optional, Tuple

from rosclingo.errors import OptionsError, ProgramError
from rosclingo.solver import lexical
from rosclingo.solver.options import Argument, arguments
from rosoclingo.encodings.about import Launched
from rosoclingo.errors import LaunchedError

_INCLUDE = re.compile(r'(#include\s*")([^"]*)(")')


def options(launched: Launched) -> List[Argument]:
    """Returns the options and words of a node's command line.

    Raises:
        LaunchedError: An option lacks its value.
    """
    try:
        return list(arguments(launched.arguments))
    except OptionsError as err:
        raise LaunchedError(f"the command line of {launched.node} is wrong: {err}") from err


def unpack(launched: Launched, folder: Path) -> Tuple[List[str], Path]:
    """Writes a node's files as they were when it was started.

    Their paths are kept, below the folder, and their includes lead there.

    Args:
        launched: How the node was started.
        folder: Where they are written.

    Returns:
        The command line with the new paths, and the working directory that it needs.

    Raises:
        LaunchedError: The command line is wrong, or has a file that is not there.
    """
    for path, text in launched.files.items():
        file = _below(folder, path)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(_move_includes(text, path, launched, folder), encoding="utf-8")
    command_line = with_files(launched, lambda path: str(_below(folder, find(path, launched))))
    directory = _below(folder, _directory(launched))
    directory.mkdir(parents=True, exist_ok=True)
    return command_line, directory


def with_files(launched: Launched, change: Callable[[str], str]) -> List[str]:
    """Returns a node's command line with other paths."""
    changed: List[str] = []
    for option, value in options(launched):
        changed += [option] if option else []
        changed.append(change(value) if option == "-f" else value)
    return changed


def find(path: str, launched: Launched) -> str:
    """Returns which of the loaded files a path of the command line means.

    Older bags do not say that. They have the real paths of files, which the command line may name
    from a working directory, by a link, or without ``.lp``: the one that is most alike counts.
    """
    known = launched.paths.get(path)
    if known in launched.files:
        return str(known)
    ranked = sorted(launched.files, key=lambda file: _likeness(path, file), reverse=True)
    if ranked and (_likeness(path, ranked[0]) > 0 or len(ranked) == 1):
        return ranked[0]
    raise LaunchedError(f"{launched.node}/about does not have the file {path} of its command line")


def _likeness(path: str, file: str) -> float:
    """Returns how many of their last parts are the same; a bit less without the ``.lp``."""
    best = 0.0
    for less, candidate in ((0.0, path), (0.5, f"{path}.lp")):
        pairs = zip(reversed(_parts(candidate)), reversed(_parts(file)))
        same = takewhile(lambda pair: pair[0] == pair[1], pairs)
        best = max(best, len(list(same)) - less)
    return best


def _directory(launched: Launched) -> str:
    """Returns the working directory.

    Older bags do not say it; then that from which the command line's paths and includes fit.
    """
    if launched.directory:
        return launched.directory
    paths = [value for option, value in options(launched) if option == "-f"]
    for text in launched.files.values():
        paths += [match.group(2) for match in _INCLUDE.finditer(text)]
    for path in paths:
        if not posixpath.isabs(path):
            found = _base(posixpath.normpath(path), launched.files)
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


def _move_includes(text: str, path: str, launched: Launched, folder: Path) -> str:
    """Rewrites a file's includes to the node's files, in older bags as far as that is sure."""
    includes = launched.includes.get(path, {})

    def moved(name: str) -> Optional[str]:
        if name in includes:
            return str(_below(folder, includes[name]))
        is_known = posixpath.isabs(name) and posixpath.normpath(name) in launched.files
        return str(_below(folder, name)) if is_known else None

    try:
        return lexical.with_includes(text, moved)
    except ProgramError:  # nobody has loaded it, as clingo does not; it may say why
        return text


def _below(folder: Path, path: str) -> Path:
    """Returns where a path of a node is below a folder, which it cannot leave."""
    return folder / posixpath.normpath("/" + path).lstrip("/")


def _parts(path: str) -> List[str]:
    return [part for part in path.split("/") if part not in ("", ".", "..")]
