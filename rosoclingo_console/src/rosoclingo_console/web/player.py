"""Plays a recorded run on the pages: starts and stops, faster or slower, from any time on."""

from __future__ import annotations

import asyncio
from typing import Any, Dict, Mapping, Optional

from rosoclingo_console.model.playback import Playback
from rosoclingo_console.web.hub import Hub
from rosoclingo_console.web.operations import OperationReply, Operations

_TICK_SECONDS = 0.1
_FASTEST = 100.0


class Player(Operations):
    """A recorded run, and what operators want of it: to see another part. Nothing else is done.

    The event loop's thread uses it, but for the methods of :class:`.Operations`.

    Attributes:
        hub: Shows the recording.
    """

    refusal = OperationReply(False, "this is a recorded run: nothing of it can be changed")

    def __init__(self, playback: Playback) -> None:
        """Begins at the end of the run, where all of it is seen, and does not play."""
        self._playback = playback
        self._position = playback.seconds
        self._speed = 1.0
        self._plays = False
        self._at = 0.0  # when it was there, by the loop's clock
        self._loop: Optional[asyncio.AbstractEventLoop] = None
        self.hub = Hub([playback.name], self.clock)

    def clock(self) -> Mapping[str, float]:
        """Returns the time in the run, and how fast it goes by."""
        rate = self._speed if self._plays else 0.0
        return {"now": self._position, "ros": self._position, "rate": rate}

    def start(self) -> None:
        """Begins to play, once there is an event loop; called by its thread."""
        self._loop = asyncio.get_event_loop()
        self._at = self._loop.time()
        self._show()
        self._tick()

    def _tick(self) -> None:
        assert self._loop is not None
        now = self._loop.time()
        passed, self._at = now - self._at, now
        if self._plays:
            self._position = min(self._playback.seconds, self._position + passed * self._speed)
            if self._position >= self._playback.seconds:
                self._plays = False
                self.hub.beat()
            self._show()
        self._loop.call_later(_TICK_SECONDS, self._tick)

    def _show(self) -> None:
        name = self._playback.name
        self.hub.models[name] = self._playback.seek(self._position)
        self.hub.post(name, lambda _: None)

    def about(self) -> Dict[str, Any]:
        """Returns what pages are told of the recording."""
        return {"seconds": self._playback.seconds, "holds": self._playback.holds}

    def play(self, plays: bool, position: float, speed: float) -> OperationReply:
        """Goes to a time in the run, and plays from there or stops; called by any thread."""
        assert self._loop is not None

        def change() -> None:
            self._plays = plays
            self._position = min(max(position, 0.0), self._playback.seconds)
            self._speed = min(max(speed, 0.0), _FASTEST)
            self._show()
            self.hub.beat()

        self._loop.call_soon_threadsafe(change)
        return OperationReply(True, "plays" if plays else "stands")
