"""Ports for ROS masters."""

from __future__ import annotations

import socket
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from rosclingo.ros import ports


def free_port() -> int:
    with ports.reserve_port() as reserved:
        port: int = reserved.getsockname()[1]
        return port


def test_a_free_port_is_none_that_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as taken, socket.socket() as server:
        taken.bind(("", free_port()))
        other = free_port()
        monkeypatch.setattr(ports, "_PORTS", [taken.getsockname()[1], other])
        assert {free_port() for _ in range(20)} == {other}
        monkeypatch.setattr(ports, "_PORTS", [taken.getsockname()[1]])
        with pytest.raises(OSError, match="no free TCP port"):
            free_port()
        server.bind(("", other))


def test_a_reserved_port_is_for_one_master(monkeypatch: pytest.MonkeyPatch) -> None:
    with ports.reserve_port() as reserved:
        port = reserved.getsockname()[1]
        monkeypatch.setattr(ports, "_PORTS", [port])
        with pytest.raises(OSError, match="no free TCP port"):
            free_port()
        with SimpleXMLRPCServer(("", port)) as server:  # of which the master's is made
            assert server.server_address[1] == port
    assert free_port() == port


def test_outgoing_connections_take_other_ports() -> None:
    assert max(ports._PORTS) < 32_768  # the first that Linux gives them by itself
