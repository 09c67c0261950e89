"""Parses a user's requests, and tracks their statuses. Needs no ROS."""

from __future__ import annotations

import contextlib
import threading
import uuid
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

from rosclingo.errors import TermError
from rosclingo.solver.terms import parse_term, quote
from rosoclingo_interfaces.errors import LedgerError, LineError
from rosoclingo_interfaces.store_file import load, reserve, save

_PART = "open"  # in the file: the requests that have not ended


@dataclass(frozen=True)
class Bring:
    """A request to bring a package.

    Attributes:
        request: The request for the planner, such as ``bring(o9,o14)``.
        information: What the planner needs not know: the object.
    """

    request: str
    information: Tuple[str, ...] = ()

    def __str__(self) -> str:
        return " ".join((self.request, *self.information))


def parse_line(line: str, with_object: bool) -> Union[Bring, int]:
    """Parses a line: a request, or the number of one that is to be cancelled.

    Args:
        line: ``FROM TO`` for a request, or ``ID`` to cancel one.
        with_object: Whether a request also names an object: ``FROM TO OBJECT``, and after it may
            say ``urgent``, or ``by SECONDS``.

    Raises:
        LineError: The line is none of these.
    """
    words = line.split()
    if len(words) == 1 and _is_number(words[0]):
        return int(words[0])
    when = _when(words[3:])
    if len(words[:3]) != (3 if with_object else 2) or when is None:
        form = (
            "FROM TO OBJECT, such as o9 o14 box_of_chocolate, then urgent or by SECONDS if it is"
            if with_object
            else "FROM TO, such as 1 3"
        )
        raise LineError(f"expected {form}, or the ID of a request to cancel it, not {quote(line)}")
    try:
        origin, destination = (parse_term(word) for word in words[:2])
    except TermError as err:
        raise LineError(str(err)) from err
    return Bring(f"bring({origin},{destination}{when})", tuple(words[2:3]))


def _when(words: Sequence[str]) -> Optional[str]:
    """Returns the request's arguments after origin and destination; None if words are wrong."""
    if not words:
        return ""
    if words == ["urgent"]:
        return ",urgent"
    if len(words) == 2 and words[0] == "by" and _is_number(words[1]):
        return f",by({int(words[1])})"
    return None


def _is_number(word: str) -> bool:
    return word.isascii() and word.isdigit() and len(word) < 10


@dataclass
class Order:
    """A request with its status.

    Attributes:
        number: What the user calls it by.
        bring: What was asked for.
        state: What was last heard of it.
        end: How it ended, such as ``succeeded``; None as long as it has not.
        cancel_requested: Whether the user wants it to be cancelled.
        id: What its goal is known by, also when another process sends it again.
    """

    number: int
    bring: Bring
    state: str = "sent"
    end: Optional[str] = None
    cancel_requested: bool = False
    id: str = field(default_factory=lambda: str(uuid.uuid4()))

    def __str__(self) -> str:
        return f"[{self.number}] {self.bring}: {self.state}"

    @property
    def as_asked(self) -> bool:
        """True if the request ended as the user wanted."""
        return self.end == "succeeded" or (self.end == "canceled" and self.cancel_requested)


class Orders:
    """All requests of a session. Thread-safe.

    With a file, those that have not ended are in it, whatever happens to the process: another one
    goes on with them.
    """

    def __init__(self, file: Optional[Path] = None) -> None:
        """Begins with the requests in the file, if there are any.

        Args:
            file: Where they are kept; None for nowhere.

        Raises:
            LedgerError: The file cannot be read or written, or another process has it.
        """
        self._file = file
        self._lock = threading.RLock()  # guards all below; held while the file is written
        self._orders: Dict[int, Order] = {}
        if file is not None:
            self._guard = reserve(file)  # as long as this process lives
            if file.exists():
                orders = load(file, _PART, _orders, "holds no requests", "remove it to forget them")
                self._orders = {order.number: order for order in orders}
            self._write()

    def add(self, bring: Bring) -> Order:
        """Adds a request, with the next number from 1 on.

        Raises:
            LedgerError: It cannot be kept, and is not to be sent.
        """
        with self._lock:
            order = Order(max(self._orders, default=0) + 1, bring)
            self._orders[order.number] = order
            try:
                self._write()
            except LedgerError:
                del self._orders[order.number]
                raise
            return order

    def cancel(self, number: int) -> Order:
        """Notes that a request is to be cancelled.

        Raises:
            LineError: There is none of this number that could be cancelled.
            LedgerError: That cannot be kept.
        """
        with self._lock:
            order = self._orders.get(number)
            if order is None:
                known = ", ".join(map(str, self._orders)) or "none yet"
                raise LineError(f"there is no request {number}; there are: {known}")
            if order.end is not None:
                raise LineError(f"request {number} has ended already: {order.end}")
            order.cancel_requested = True
            self._write()
            return order

    def heard(self, order: Order, state: str) -> bool:
        """Records a status or feedback of a request.

        Returns:
            Whether it is news.
        """
        with self._lock:
            if order.end is not None or order.state == state:
                return False
            order.state = state
            return True

    def ended(self, order: Order, end: str, reason: str) -> bool:
        """Notes how a request ended.

        Returns:
            Whether it is news.
        """
        with self._lock:
            if order.end is not None:
                return False
            order.end = end
            order.state = end if order.as_asked or not reason else f"{end}: {reason}"
            with contextlib.suppress(LedgerError):  # it would be sent again, and end the same way
                self._write()
            return True

    @property
    def open(self) -> List[Order]:
        """The requests that have not ended."""
        with self._lock:
            return [order for order in self._orders.values() if order.end is None]

    def _write(self) -> None:
        if self._file is None:
            return
        said = [
            {
                "number": order.number,
                "id": order.id,
                "request": order.bring.request,
                "information": order.bring.information,
                "cancel": order.cancel_requested,
            }
            for order in self.open
        ]
        save(self._file, _PART, said)

    @property
    def all_as_asked(self) -> bool:
        """True if all requests ended as the user wanted."""
        with self._lock:
            return all(order.as_asked for order in self._orders.values())

    def lines(self) -> List[str]:
        """Returns a line for each request."""
        with self._lock:
            return [str(order) for order in self._orders.values()]

    def summary(self) -> str:
        """Returns how many deliveries there were, and what else became of the requests."""
        with self._lock:
            ends = [order.end or "open" for order in self._orders.values()]
        deliveries = ends.count("succeeded")
        parts = [f"{deliveries} {'delivery' if deliveries == 1 else 'deliveries'}"]
        for end in ("canceled", "rejected", "aborted", "lost", "open"):
            if end in ends:
                parts.append(f"{ends.count(end)} {end}")
        return ", ".join(parts)


def _orders(said: Any) -> List[Order]:
    return [_order(order) for order in said]


def _order(said: Any) -> Order:
    bring = Bring(str(said["request"]), tuple(map(str, said["information"])))
    return Order(
        int(said["number"]),
        bring,
        "sent again",
        cancel_requested=bool(said["cancel"]),
        id=str(said["id"]),
    )
