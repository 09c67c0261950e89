"""Who may see and act."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosoclingo_console.web.access import (
    Access,
    TokenFileError,
    is_loopback,
    new_token,
    token_of_file,
)

TOKEN = "t" * 32
OPEN = Access(TOKEN, sees_all=True, hosts=frozenset({"robot"}))
CLOSED = Access(TOKEN, sees_all=False)


@pytest.mark.parametrize(
    ("host", "is_known"),
    [
        ("localhost:8088", True), ("LOCALHOST", True), ("127.0.0.1:1", True), ("[::1]:80", True),
        ("192.168.0.7", True), ("robot:8088", True), ("Robot", True),
        ("", False), ("evil.example", False), ("evil.example:8088", False),
        ("localhost.evil.example", False), ("127.0.0.1.evil.example", False),
        ("localhost@evil.example", False), ("evil.example/localhost", False),
        ("localhost:port", False), ("[::1", False), ("localhost evil", False),
    ],
)  # fmt: skip
def test_names_of_the_server(host: str, is_known: bool) -> None:
    assert OPEN.is_host(host) is is_known


@pytest.mark.parametrize(
    ("origin", "is_same"),
    [
        ("http://localhost:8088", True), ("https://localhost:8088", True),
        ("http://LOCALHOST:8088", True),
        ("", False), ("null", False), ("http://localhost", False), ("http://localhost:80", False),
        ("http://evil.example", False), ("file://localhost:8088", False),
        ("http://localhost:8088.evil.example", False), ("localhost:8088", False),
    ],
)  # fmt: skip
def test_origins(origin: str, is_same: bool) -> None:
    assert OPEN.is_same_origin(origin, "localhost:8088") is is_same
    assert not OPEN.is_same_origin(origin, "")


def test_tokens() -> None:
    assert OPEN.may_see("")
    assert not OPEN.may_act("")
    assert not CLOSED.may_see("")
    for access in (OPEN, CLOSED):
        assert access.may_see(TOKEN)
        assert access.may_act(TOKEN)
        for wrong in (TOKEN + "x", TOKEN[:-1], "é" * 32, "\ud800", "\0"):
            assert not access.is_token(wrong)
    assert not Access(TOKEN, sees_all=True, read_only=True).may_act(TOKEN)
    assert len({new_token() for _ in range(100)}) == 100


@pytest.mark.parametrize("address", ["localhost", "127.0.0.1", "127.1.2.3", "::1"])
def test_only_this_machine(address: str) -> None:
    assert is_loopback(address)


@pytest.mark.parametrize("address", ["0.0.0.0", "::", "192.168.0.7", "robot", ""])
def test_other_machines(address: str) -> None:
    assert not is_loopback(address)


def test_a_file_of_the_token(tmp_path: Path) -> None:
    file = tmp_path / "folder" / "token"
    token = token_of_file(file)
    assert token_of_file(file) == token
    assert file.stat().st_mode & 0o777 == 0o600
    file.chmod(0o644)
    with pytest.raises(TokenFileError, match="chmod 600"):
        token_of_file(file)
    file.chmod(0o600)
    file.write_text("short")
    with pytest.raises(TokenFileError, match="at least 32"):
        token_of_file(file)
    file.write_bytes(b"\xff" * 40)
    with pytest.raises(TokenFileError, match="cannot use"):
        token_of_file(file)
    with pytest.raises(TokenFileError, match="cannot use"):
        token_of_file(tmp_path)
