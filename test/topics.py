"""Hears and sends ROS's messages within the process of the tests.

Tools of ROS take longer than a node to start, and rospy would be one node of one master for a whole
process. So this is as much of ROS's TCP protocol as that takes; the READMEs' tests type the tools.
"""

from __future__ import annotations

import contextlib
import io
import socket
import threading
from typing import Any, List, Tuple

import yaml
from genpy.message import fill_message_args
from rosgraph.network import (
    decode_ros_handshake_header,
    encode_ros_handshake_header,
    read_ros_handshake_header,
)
from rosgraph.xmlrpc import ThreadingXMLRPCServer
from roslib.message import get_message_class


class Listener:
    """Hears a topic of a node, as ``rostopic echo`` does, but nobody who publishes it later."""

    def __init__(self, node: Any, topic: str, name: str) -> None:
        """Connects to what answers for a node, and listens under a name."""
        _, host, port = node.requestTopic(name, topic, [["TCPROS"]])[2]
        self._texts: List[str] = []
        self._changed = threading.Condition()  # guards the texts
        self._connection = socket.create_connection((host, port))
        self._file = self._connection.makefile("rb")
        fields = {"callerid": name, "topic": topic, "type": "*", "md5sum": "*"}
        self._connection.sendall(encode_ros_handshake_header(fields))
        self._type = decode_ros_handshake_header(self._read())["type"]
        threading.Thread(target=self._listen, daemon=True).start()

    def _read(self) -> bytes:
        """Returns what comes next, a length and so many bytes; nothing at the end."""
        size = self._file.read(4)
        return size + self._file.read(int.from_bytes(size, "little")) if size else b""

    def _listen(self) -> None:
        message = get_message_class(self._type)
        with contextlib.suppress(OSError, ValueError):  # when it is closed
            for data in iter(self._read, b""):
                with self._changed:
                    self._texts.append(f"{message().deserialize(data[4:])}\n---\n")
                    self._changed.notify_all()

    @property
    def output(self) -> str:
        """What has come so far, as ``rostopic echo`` prints it."""
        return "".join(self._texts)

    def wait_for(self, text: str, timeout: float = 60.0) -> None:
        """Waits until a text has come, so many seconds at most."""
        with self._changed:
            assert self._changed.wait_for(lambda: text in self.output, timeout), self.output

    def close(self) -> None:
        """Hears no more."""
        with contextlib.suppress(OSError):  # its node may have ended before
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()


class Publisher:
    """Sends a message to all who listen to a topic, now or later, as ``rostopic pub`` does."""

    def __init__(self, master: Any, topic: str, kind: str, text: str, name: str) -> None:
        """Begins to send it.

        Args:
            master: What to ask the master.
            topic: Its name.
            kind: The type of the message.
            text: What is in the message, as YAML.
            name: The publisher's, for the master.
        """
        message, data = get_message_class(kind)(), io.BytesIO()
        fill_message_args(message, [yaml.safe_load(text)])
        message.serialize(data)
        fields = {
            "callerid": name, "topic": topic, "type": kind, "md5sum": message._md5sum,
            "latching": "1",
        }  # fmt: skip
        size = len(data.getvalue()).to_bytes(4, "little")
        self._sent = encode_ros_handshake_header(fields) + size + data.getvalue()
        self._connections: List[socket.socket] = []
        self._server = socket.create_server(("localhost", 0))
        self._node = ThreadingXMLRPCServer(("localhost", 0), log_requests=0)
        self._node.register_function(self._request_topic, "requestTopic")
        for serve in (self._send, self._node.serve_forever):
            threading.Thread(target=serve, daemon=True).start()
        uri = f"http://localhost:{self._node.server_address[1]}/"
        self._listening = len(master.registerPublisher(name, topic, kind, uri)[2])

    def has_told_all(self) -> bool:
        """Whether all have the message who listened when it began."""
        return len(self._connections) >= self._listening

    def _request_topic(self, *_: Any) -> Tuple[int, str, List[Any]]:
        return 1, "", ["TCPROS", "localhost", self._server.getsockname()[1]]

    def _send(self) -> None:
        with contextlib.suppress(OSError):  # when it is closed
            while True:
                connection, _ = self._server.accept()
                read_ros_handshake_header(connection, io.BytesIO(), 4096)  # who listens
                connection.sendall(self._sent)
                self._connections.append(connection)

    def close(self) -> None:
        """Ends all connections."""
        self._node.shutdown()
        self._node.server_close()
        for connection in (self._server, *self._connections):
            connection.close()
