"""Tables of rows that pages show, and what has changed in them since they were looked at.

>>> board = Board()
>>> board.replace("goals", {"g1": {"status": "pending"}})
>>> board.take_changes()
{'goals': {'g1': {'status': 'pending'}}}
>>> board.replace("goals", {})
>>> board.take_changes()
{'goals': {'g1': None}}
"""

from __future__ import annotations

from typing import Any, Dict, Mapping, Optional

Row = Mapping[str, Any]
"""A row of a table, in types of JSON; it is not changed once it is in the table."""

Tables = Dict[str, Dict[str, Optional[Row]]]
"""For each table its rows by their keys; None for a row that is gone."""


class Board:
    """The tables of one system. Not thread-safe."""

    def __init__(self) -> None:
        self._tables: Dict[str, Dict[str, Row]] = {}
        self._changes: Tables = {}

    def replace(self, table: str, rows: Mapping[str, Row]) -> None:
        """Makes these the rows of a table, and notes those that are new, different or gone."""
        before = self._tables.get(table, {})
        if before == rows:
            return
        changes = self._changes.setdefault(table, {})
        changes.update({key: row for key, row in rows.items() if before.get(key) != row})
        changes.update({key: None for key in before if key not in rows})
        self._tables[table] = dict(rows)

    def take_changes(self) -> Tables:
        """Returns what has changed since the last call."""
        changes, self._changes = self._changes, {}
        return {table: rows for table, rows in changes.items() if rows}

    def all(self) -> Tables:
        """Returns all rows."""
        return {table: dict(rows) for table, rows in self._tables.items()}
