"""Access control: the token, the names of this server, and the origins of requests.

Browsers send nothing of this by themselves: the page sends the token with each request, from a
storage that only pages of the same scheme, host and port can read. So a page of somebody else's,
which a browser lets send requests here, can neither see nor do anything, and no cookie can leak to
another port of this machine.
"""

from __future__ import annotations

import hmac
import ipaddress
import os
import secrets
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import FrozenSet
from urllib.parse import urlsplit

from rosclingo.errors import RosclingoError

_TOKEN_BYTES = 32  # of chance
_LEAST_TOKEN = 32  # characters
LOCALHOST = "localhost"


class TokenFileError(RosclingoError):
    """The file of the token cannot be used; the message names it and the remedy."""


@dataclass(frozen=True)
class Access:
    """The rules of a console. Immutable.

    Attributes:
        token: Who knows it may act.
        sees_all: Whether everybody who gets here may see, since only this machine does.
        read_only: Whether operators may only look.
        hosts: Names under which this server may be asked, in small letters, besides ``localhost``
            and addresses. A page of a stranger's, whose name leads here, comes under another one.
    """

    token: str
    sees_all: bool
    read_only: bool = False
    hosts: FrozenSet[str] = frozenset()

    def is_token(self, text: str) -> bool:
        """Compares a text with the token, in constant time."""
        return hmac.compare_digest(text.encode("utf-8", "replace"), self.token.encode("utf-8"))

    def may_see(self, token: str) -> bool:
        """Returns whether a client with this token may read the systems' state."""
        return self.sees_all or self.is_token(token)

    def may_act(self, token: str) -> bool:
        """Returns whether a client with this token may request operations."""
        return not self.read_only and self.is_token(token)

    def is_host(self, host: str) -> bool:
        """Returns whether the header ``Host`` of a request names this server."""
        name = _host_name(host)
        return name == LOCALHOST or name in self.hosts or _is_address(name)

    def is_same_origin(self, origin: str, host: str) -> bool:
        """Returns whether the header ``Origin`` of a request is that of the page of this server."""
        parts = origin.partition("://")
        return parts[0] in ("http", "https") and bool(host) and parts[2].lower() == host.lower()


def is_loopback(address: str) -> bool:
    """Returns whether only this machine can connect to an address to listen on."""
    if address == LOCALHOST:
        return True
    return _is_address(address) and ipaddress.ip_address(address).is_loopback


def names_of_this_machine() -> FrozenSet[str]:
    """Returns the names under which other machines may know this one, in small letters."""
    name = socket.gethostname().lower()
    return frozenset({name, f"{name}.local"})


def new_token() -> str:
    """Returns a random token that cannot be guessed."""
    return secrets.token_urlsafe(_TOKEN_BYTES)


def token_of_file(file: Path) -> str:
    """Returns the token in a file that only its owner may read; writes a new one if it is missing.

    Raises:
        TokenFileError: The file cannot be read or written, others may read it, or it is too short.
    """
    try:
        if not file.exists():
            file.parent.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with open(descriptor, "w", encoding="ascii") as written:
                written.write(f"{new_token()}\n")
        if file.stat().st_mode & 0o077:
            raise TokenFileError(f"{file}: others may read or write it; type: chmod 600 {file}")
        token = file.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as err:
        raise TokenFileError(f"cannot use {file} for the token: {err}; name another file") from err
    if len(token) < _LEAST_TOKEN:
        raise TokenFileError(
            f"{file}: a token has at least {_LEAST_TOKEN} characters; remove the file for a new one"
        )
    return token


def _host_name(host: str) -> str:
    """Returns the name in a header ``Host``, in small letters; empty if it is none."""
    try:
        parts = urlsplit(f"//{host}")
        _ = parts.port
    except ValueError:
        return ""
    return "" if parts.path or parts.username is not None else (parts.hostname or "")


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
