"""The node ``console.py``: parameters, and what belongs to it."""

from __future__ import annotations

import contextlib
import socket
import sys
import threading
import time
from pathlib import Path
from typing import NoReturn

import rosgraph
import rospy

from rosclingo.ros import parameters
from rosclingo.ros.init import init_node, on_shutdown, run_node
from rosoclingo.encodings.known import KnownEncoding
from rosoclingo.ros.encoding_reader import EncodingReader
from rosoclingo_console import bag_console
from rosoclingo_console.ros.clock import SystemsClock
from rosoclingo_console.ros.listener import Listener
from rosoclingo_console.ros.operations import RosOperations
from rosoclingo_console.ros.recordings import Recordings
from rosoclingo_console.web.access import (
    LOCALHOST,
    Access,
    is_loopback,
    names_of_this_machine,
    new_token,
    token_of_file,
)
from rosoclingo_console.web.hub import Heard, Hub
from rosoclingo_console.web.running import WebThread
from rosoclingo_console.web.server import Server

_USAGE = """\
usage: console.py [_PARAMETER:=VALUE]... [ROS remappings]
       console.py BAG [--name NAME] [--port PORT]

Serves a page on which an operator sees what planning systems do, and controls them. Prints the
link. The package's README lists the parameters. With a bag, it shows a recorded run."""

_ANYWHERE = ("0.0.0.0", "::")  # noqa: S104 (nothing listens here: the link names this machine)
_MOST_PORT = 65535
_LOOKS_SECONDS = 0.5  # how often it is looked whether the systems are there


class ConsoleNode:
    """Hears systems, and serves their page. Make it after the node is initialised."""

    def __init__(self) -> None:
        """Reads the parameters, subscribes, and starts the server.

        Raises:
            ParameterError: A parameter is wrong.
            TokenFileError: The file of the token cannot be used.
            AddressError: The server cannot listen.
        """
        names = parameters.words("systems", ["rosoclingo"])
        if not names:
            raise parameters.wrong("systems", "name a planning node at least")
        systems = tuple(dict.fromkeys(rospy.resolve_name(name) for name in names))
        address = parameters.text("address", LOCALHOST)
        port = parameters.integer("port", bag_console.PORT, _MOST_PORT)
        token_file = parameters.text("token_file", "")
        access = Access(
            token_of_file(Path(token_file).expanduser()) if token_file else new_token(),
            sees_all=is_loopback(address),
            read_only=parameters.flag("read_only", False),
            hosts=names_of_this_machine()
            | frozenset(name.lower() for name in parameters.words("hosts")),
        )
        self._clock = SystemsClock()
        self._hub = hub = Hub(systems, self._clock.now)
        self._encodings = EncodingReader(
            lambda reason: rospy.logwarn("there are no completions and no map: %s", reason)
        )
        self._listeners = [self._listen(name) for name in systems]
        folder = Path(parameters.text("bags", ".")).expanduser().absolute()
        self._recordings = Recordings(folder, self._show_recording)
        operations = RosOperations(systems, hub, self._recordings)
        server = Server(hub, access, operations, lambda line: rospy.loginfo("%s", line))
        self._web = WebThread(hub, server, address, port)
        on_shutdown(self._web.close)
        on_shutdown(self._recordings.close)
        threading.Thread(target=self._look, name="look", daemon=True).start()
        host = socket.gethostname() if address in _ANYWHERE else address
        host = f"[{host}]" if ":" in host else host
        rospy.loginfo("serving %s", ", ".join(systems))
        # Printed, and not logged: the log of a node is published, and others read its file.
        print(f"open http://{host}:{self._web.port}/#{access.token}", flush=True)

    def _listen(self, name: str) -> Listener:
        def post(heard: Heard) -> None:
            self._hub.post(name, heard)

        def learn(known: KnownEncoding) -> None:
            post(lambda model: model.set_encoding(known))

        self._encodings.listen(name, learn)
        return Listener(name, post)

    def _show_recording(self, system: str, file: str) -> None:
        self._hub.post(system, lambda model: model.set_recording(file))

    def _look(self) -> None:
        while not rospy.is_shutdown():
            for listener in self._listeners:
                listener.look()
            self._recordings.look()
            with contextlib.suppress(OSError, rosgraph.MasterException):  # it may be gone for now
                self._clock.look()
            time.sleep(_LOOKS_SECONDS)


def main() -> NoReturn:
    """Runs the node until it is shut down, or shows a bag, and ends the process.

    The exit status is 0, or 2 if a parameter is wrong or the server cannot listen.
    """
    arguments = [word for word in rospy.myargv(sys.argv)[1:] if not word.startswith("_")]
    if arguments and not {"-h", "--help"}.issuperset(arguments):
        bag_console.main(arguments)
    init_node("console", usage=_USAGE)
    run_node(ConsoleNode)
