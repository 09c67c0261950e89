"""A recorded run as values: its journal, and the command lines and files of its nodes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Mapping, Tuple

from rosoclingo.bags.topics import solvers, text_entries
from rosoclingo.loop.journal import Record


@dataclass(frozen=True)
class Entry(Record):
    """An event of a recorded journal.

    Attributes:
        number: Its number in the journal, from 1.
        seconds: When it happened, in seconds of wall time since the recording began; negative for
            what was published before.
    """

    number: int = 1
    seconds: float = 0.0


@dataclass(frozen=True)
class Program:
    """A node's command line, files and parameters; see :func:`rosclingo.solver.about.about`.

    Attributes:
        node: Its resolved name, such as ``/planner``.
        program: Package and executable, such as ``rosclingo run.py``.
        arguments: Its command line, without ROS remappings.
        files: The texts of the files that it had loaded, by their real paths.
        paths: The real paths of those of the command line, by how that names them; empty if the
            bag does not say.
        includes: For each file, the real paths of what it includes, by how it names that, likewise.
        directory: Its working directory, likewise.
        versions: Versions of clingo and Python.
        solvers: Of ``rosoclingo run.py``, the names of the nodes which are ``controller`` and
            ``planner``; else empty.
        parameters: Of a node with the planning loop, those by which it decides, such as
            ``abort_unreachable``, with values of JSON; empty if the bag does not say.
    """

    node: str
    program: str
    arguments: Tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    solvers: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    paths: Mapping[str, str] = field(default_factory=dict)
    includes: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    directory: str = ""

    @classmethod
    def of(cls, node: str, described: Mapping[str, Any]) -> Program:
        """Parses a node's ``~about``, without entries of wrong types.

        Args:
            node: Its resolved name.
            described: The entries, of which ``program`` is there.
        """
        arguments, files = described.get("arguments"), described.get("files")
        parameters, directory = described.get("parameters"), described.get("directory")
        loaded = files if isinstance(files, dict) else {}
        known = {path: file for path, file in loaded.items() if isinstance(file, dict)}
        return cls(
            node,
            str(described["program"]),
            tuple(map(str, arguments)) if isinstance(arguments, list) else (),
            {path: text_entries(file).get("text", "") for path, file in loaded.items()},
            text_entries(described.get("versions")),
            solvers(described),
            parameters if isinstance(parameters, dict) else {},
            text_entries(described.get("paths")),
            {path: text_entries(file.get("includes")) for path, file in known.items()},
            directory if isinstance(directory, str) else "",
        )


@dataclass(frozen=True)
class Recording:
    """The recorded run of one system, read from a bag.

    Attributes:
        name: Resolved name of the node with the planning loop, such as ``/rosoclingo``.
        entries: The journal, in the order of its numbers.
        programs: What the nodes were started with, by node; empty if the bag does not say.
        remarks: What was wrong with the bag and could be mended, in words for the user.
        size: Size of the bag in bytes.
        has_journal: Whether the bag has the journal itself; otherwise the entries were made from
            what the bag has of the node's other topics.
    """

    name: str
    entries: Tuple[Entry, ...]
    programs: Mapping[str, Program] = field(default_factory=dict)
    remarks: Tuple[str, ...] = ()
    size: int = 0
    has_journal: bool = True
