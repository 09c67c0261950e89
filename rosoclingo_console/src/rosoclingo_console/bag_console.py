"""The console of a recorded run, ``console.py run.bag``. Needs no ROS."""

from __future__ import annotations

import argparse
import signal
import sys
import threading
from pathlib import Path
from typing import List, NoReturn

from rosclingo.errors import RosclingoError
from rosoclingo.bags.model import Recording
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.encodings.known import KnownEncoding, read_encoding
from rosoclingo_console.model.playback import Playback
from rosoclingo_console.web.access import LOCALHOST, Access, new_token
from rosoclingo_console.web.player import Player
from rosoclingo_console.web.running import WebThread
from rosoclingo_console.web.server import Server

_PROGRAM = "console.py"
PORT = 8088
"""The default port of a console."""


def main(arguments: List[str]) -> NoReturn:
    """Serves the run of a bag until Ctrl-C, and ends the process.

    The exit status is 0, or 2 if the command line or the bag is wrong, or the server cannot listen.
    """
    chosen = _parse(arguments)
    try:
        recording = read_recording(Path(chosen.bag), chosen.name, with_feedback=True)
        player = Player(Playback(recording, _encoding(recording)))
        access = Access(new_token(), sees_all=True)
        server = Server(player.hub, access, player)
        web = WebThread(player.hub, server, LOCALHOST, chosen.port, player.start)
    except RosclingoError as err:
        print(f"{_PROGRAM}: {err}", file=sys.stderr)
        sys.exit(2)
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    print(f"open http://{LOCALHOST}:{web.port}/#{access.token}", flush=True)
    ended.wait()
    web.close()
    sys.exit(0)


def _parse(arguments: List[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog=_PROGRAM,
        usage="console.py BAG [--name NAME] [--port PORT]",
        description="Shows a recorded run in the browser: plays it, from any time on.",
        allow_abbrev=False,
    )
    parser.add_argument("bag", metavar="BAG")
    parser.add_argument("--name", help="the planning node, if the bag has several")
    parser.add_argument("--port", type=int, default=PORT, help="0 for any that is free")
    chosen: argparse.Namespace = parser.parse_args(arguments)
    return chosen


def _encoding(recording: Recording) -> KnownEncoding:
    """Returns what the planner's encoding says, as far as the bag has it and it is understood."""
    planner = recording.planner
    if planner is None:
        return KnownEncoding()
    try:
        return read_encoding(planner)
    except (RosclingoError, OSError) as err:
        print(f"{_PROGRAM}: there is no map: {err}", file=sys.stderr)
        return KnownEncoding()
