"""Reads the waypoint graph of an instance, with positions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Mapping, Sequence, Tuple

import clingo

from rosclingo.errors import RosclingoError
from rosclingo.solver.programs import parse_files
from rosclingo.solver.theories import make_theory

_METRES = 0.1  # in a unit of position/3
_MOST = 5  # waypoints that an error lists

MapPoint = Tuple[float, float]


class GraphError(RosclingoError):
    """An instance that cannot be read or drawn; the message names file, atom and remedy."""


@dataclass(frozen=True)
class Graph:
    """A graph of waypoints.

    Attributes:
        places: x and y of each waypoint, in m.
        edges: Waypoints next to each other, each pair once.
        starts: For each robot, the waypoint where it stands in the beginning.
    """

    places: Mapping[str, MapPoint]
    edges: Tuple[Tuple[str, str], ...]
    starts: Mapping[str, str]


def read_graph(files: Sequence[str], options: Sequence[str] = (), theory: str = "") -> Graph:
    """Grounds an instance and takes ``connection/2``, ``position/3`` and ``start/2`` out of it.

    Args:
        files: Encodings that together are the instance; positions are in decimetres.
        options: Options for clingo, such as constants.
        theory: The name of the theory that extends clingo; "" for none.

    Raises:
        GraphError: The files do not parse, or do not say where all waypoints are.
    """
    atoms = _ground(files, options, theory)
    where = " ".join(files)
    places: Dict[str, MapPoint] = {}
    for atom in _named(atoms, "position", 3):
        waypoint, *numbers = atom.arguments
        if any(number.type is not clingo.SymbolType.Number for number in numbers):
            raise GraphError(f"{where}: {atom}: expected two integers, decimetres")
        x, y = (number.number * _METRES for number in numbers)
        if str(waypoint) in places:
            raise GraphError(f"{where}: {atom}: {waypoint} has another position, too; remove one")
        places[str(waypoint)] = (x, y)
    pairs = {
        tuple(sorted(str(end) for end in atom.arguments)) for atom in _named(atoms, "connection", 2)
    }
    if not pairs:
        raise GraphError(f"{where}: there is no connection(V,W); name the file of an instance")
    lost = sorted({end for pair in pairs for end in pair if end not in places})
    if lost:
        more = ", ..." if len(lost) > _MOST else ""
        raise GraphError(
            f"{where}: no coordinates of {', '.join(lost[:_MOST])}{more}; add facts "
            f"position({lost[0]},X,Y) in decimetres"
        )
    starts = {str(atom.arguments[0]): str(atom.arguments[1]) for atom in _named(atoms, "start", 2)}
    return Graph(places, tuple((a, b) for a, b in sorted(pairs)), starts)


def _ground(files: Sequence[str], options: Sequence[str], theory: str) -> List[clingo.Symbol]:
    for file in files:
        if not Path(file).is_file():
            raise GraphError(f"there is no file {file}; check the path")
    said: List[str] = []
    solver = clingo.Control(list(options), logger=lambda _, text: said.append(text.strip()))
    try:
        extension = make_theory(theory)
        extension.register(solver)
        parse_files(files).add_to(solver, extension)
        solver.ground([("base", [])])
    except RosclingoError as err:
        raise GraphError(str(err)) from err
    except RuntimeError as err:
        raise GraphError("\n".join(said) or f"{' '.join(files)}: {err}") from err
    # Copied, because the atoms vanish together with their solver.
    return sorted(atom.symbol for atom in solver.symbolic_atoms)


def _named(atoms: List[clingo.Symbol], name: str, arity: int) -> List[clingo.Symbol]:
    return [atom for atom in atoms if atom.match(name, arity)]
