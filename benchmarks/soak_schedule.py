"""Draws what happens in a soak: requests, cancels, blocked ways, and ends of nodes. Needs no ROS.

Each kind has random numbers of its own, and all depend on the seed alone: the same seed gives the
same disturbances at the same times, however fast the system is that meets them.
"""

from __future__ import annotations

import heapq
import random
from typing import Iterator, NamedTuple, Optional, Sequence, Tuple, Union

REQUEST_SECONDS = 180.0  # of simulated time between two of a kind, on average, for one robot
BLOCK_SECONDS = 300.0
END_SECONDS = 300.0
KILL, INTERRUPT = "kill", "interrupt"

_FIRST_SECONDS = 20.0  # before anything is drawn
_CANCELLED, _SENSELESS, _TWICE, _TIMED = 0.2, 0.05, 0.05, 0.2  # of the requests
_CANCEL_SECONDS = 90.0  # after which a client changes its mind, on average
_BOX_SECONDS = (60.0, 240.0)  # for which a way is blocked
_TOLD = 0.5  # of the blocked ways
_FAULTS = (0.002, 0.001, 0.0005)  # in a second: slip, a stuck wheel, and both for long
_ALWAYS = "times: 1000000"


class Asking(NamedTuple):
    """A client's request.

    Attributes:
        request: Such as ``bring(o1,o2)``.
        cancel_after: Seconds until it is asked to be cancelled; None for never.
        is_sent_twice: Whether the client sends it once more, with the same id.
    """

    request: str
    cancel_after: Optional[float]
    is_sent_twice: bool


class Blocking(NamedTuple):
    """A box is put into a way.

    Attributes:
        way: The waypoints at its ends.
        seconds: When it is taken away again.
        is_told: Whether it is announced, or the robots have to find out.
    """

    way: Tuple[str, str]
    seconds: float
    is_told: bool


class Ending(NamedTuple):
    """A node is ended, for roslaunch to start it again.

    Attributes:
        node: Its name.
        how: :data:`KILL` is SIGKILL, :data:`INTERRUPT` is SIGINT.
    """

    node: str
    how: str


Disturbance = Union[Asking, Blocking, Ending]


class Places(NamedTuple):
    """The names that are drawn from.

    Attributes:
        offices: The offices.
        ways: Waypoints next to each other.
        nodes: The nodes that are ended; if there are none, none is.
        robots: How many robots there are, which is how much is asked for.
        sparse: How many times as long it is from one disturbance to the next of its kind.
    """

    offices: Sequence[str]
    ways: Sequence[Tuple[str, str]]
    nodes: Sequence[str]
    robots: int
    sparse: float = 1.0


def disturbances(seed: int, places: Places) -> Iterator[Tuple[float, Disturbance]]:
    """Draws disturbances without an end.

    Args:
        seed: The same one gives the same disturbances.
        places: What they are about.

    Yields:
        When each comes, in seconds of simulated time from the beginning on, and what it is.
    """
    kinds = (_askings(seed, places), _blockings(seed, places), _endings(seed, places))
    yield from heapq.merge(*kinds, key=lambda drawn: drawn[0])


def faults(seed: int, sparse: float = 1.0) -> str:
    """Returns the file of faults for the simulator: noise, slip, and wheels that get stuck.

    Args:
        seed: Of the draws.
        sparse: How many times as rare those are that come and go.
    """
    slip, stuck, both = (each / sparse for each in _FAULTS)
    return f"""\
seed: {seed}
faults:
  - {{fault: laser_noise, sigma: 0.02, dropout: 0.05}}
  - {{fault: odometry_noise, sigma: 0.02}}
  - {{fault: slip, when: {{probability: {slip:g}, {_ALWAYS}}}, lasts: 10, loss: 0.4}}
  - {{fault: stuck_wheel, when: {{probability: {stuck:g}, {_ALWAYS}}}, lasts: 5, wheel: left}}
  - {{fault: stuck_wheel, when: {{probability: {both:g}, {_ALWAYS}}}, lasts: 25, wheel: both}}
"""


def interface_faults(seed: int) -> str:
    """Returns the faults of the interfaces: packages that are not there for a while."""
    return f"{{fails: {{actions: ^(pickup|deliver), probability: 0.03, lasts: 15}}, seed: {seed}}}"


def _times(dice: random.Random, mean: float) -> Iterator[float]:
    seconds = _FIRST_SECONDS
    while True:
        seconds += dice.expovariate(1 / mean)
        yield seconds


def _askings(seed: int, places: Places) -> Iterator[Tuple[float, Disturbance]]:
    dice = random.Random(f"requests {seed}")
    for seconds in _times(dice, places.sparse * REQUEST_SECONDS / places.robots):
        origin, destination = dice.sample(sorted(places.offices), 2)
        kind, cancel, delay = dice.random(), dice.random(), dice.expovariate(1 / _CANCEL_SECONDS)
        when = dice.choice([",urgent", f",by({dice.randint(60, 600)})"])
        if kind < _SENSELESS:
            destination = origin
        is_timed = _SENSELESS <= kind < _SENSELESS + _TIMED
        request = f"bring({origin},{destination}{when if is_timed else ''})"
        is_sent_twice = dice.random() < _TWICE
        yield seconds, Asking(request, delay if cancel < _CANCELLED else None, is_sent_twice)


def _blockings(seed: int, places: Places) -> Iterator[Tuple[float, Disturbance]]:
    dice = random.Random(f"ways {seed}")
    for seconds in _times(dice, places.sparse * BLOCK_SECONDS):
        way = dice.choice(sorted(places.ways))
        yield seconds, Blocking(way, dice.uniform(*_BOX_SECONDS), dice.random() < _TOLD)


def _endings(seed: int, places: Places) -> Iterator[Tuple[float, Disturbance]]:
    dice = random.Random(f"nodes {seed}")
    for seconds in _times(dice, places.sparse * END_SECONDS) if places.nodes else ():
        yield seconds, Ending(dice.choice(sorted(places.nodes)), dice.choice([KILL, INTERRUPT]))
