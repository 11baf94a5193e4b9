"""Where the server is, how the connection is protected, and who we are."""

from __future__ import annotations

import ipaddress
import os
import pathlib
import stat
from dataclasses import dataclass, field
from typing import Any, Union

import grpc

DEFAULT_SERVER = "127.0.0.1:50551"
#: The server cuts its replies at about 1 MiB. This bounds the memory that a faulty one can claim.
_MAX_RECEIVE_BYTES = 64 << 20

PathLike = Union[str, "os.PathLike[str]"]


@dataclass(frozen=True)
class Tls:
    """Encrypts. All are paths of PEM files, read when the client connects.

    ca_cert: the authorities that the server's certificate may come from; None: those of the system.
    cert, key: ours, for a server that asks for one; both or neither. server_name: the name in the
    server's certificate, where it is not that of the address.
    """

    ca_cert: PathLike | None = None
    cert: PathLike | None = None
    key: PathLike | None = None
    server_name: str | None = None

    def __post_init__(self) -> None:
        if (self.cert is None) != (self.key is None):
            raise ValueError(
                "a client certificate and its key belong together; give both or neither"
            )


@dataclass(frozen=True)
class Connection:
    """What a channel is made of. ValueError: the token would be readable on its way, or is none."""

    server: str = DEFAULT_SERVER
    tls: Tls | None = None
    token: str | None = field(default=None, repr=False)
    insecure: bool = False

    def __post_init__(self) -> None:
        if self.token is None:
            return
        if not self.token or not all("!" <= character <= "~" for character in self.token):
            raise ValueError("the token is empty, or holds blanks or characters beyond ASCII")
        if self.tls is None and not self.insecure and not is_loopback(self.server):
            raise ValueError(
                f"the token would travel unencrypted to {self.server}, where everyone on the way "
                "could read it; use tls=hulld.Tls(), or allow it with insecure=True"
            )

    def metadata(self) -> tuple[tuple[str, str], ...]:
        """What goes with each call."""
        return (("authorization", f"Bearer {self.token}"),) if self.token else ()

    def options(self) -> list[tuple[str, Any]]:
        """The arguments of gRPC's channel."""
        options: list[tuple[str, Any]] = [
            ("grpc.max_receive_message_length", _MAX_RECEIVE_BYTES),
            ("grpc.max_send_message_length", -1),
            # A retry must find a server that has come back meanwhile, rather than gRPC's memory of
            # the failure.
            ("grpc.initial_reconnect_backoff_ms", 50),
            ("grpc.max_reconnect_backoff_ms", 1000),
        ]
        if is_loopback(self.server):
            # Otherwise gRPC uses the proxy of the environment even for services on this machine.
            options.append(("grpc.enable_http_proxy", 0))
        if self.tls is not None and self.tls.server_name:
            options.append(("grpc.ssl_target_name_override", self.tls.server_name))
        return options

    def credentials(self) -> Any:
        """gRPC's credentials of the channel; None without TLS. OSError: a file cannot be read."""
        if self.tls is None:
            return None

        def content(path: PathLike | None) -> bytes | None:
            return None if path is None else pathlib.Path(path).read_bytes()

        return grpc.ssl_channel_credentials(
            content(self.tls.ca_cert), content(self.tls.key), content(self.tls.cert)
        )


def is_loopback(server: str) -> bool:
    """Whether gRPC's target name stays on this machine."""
    if server.startswith(("unix:", "[::1]:")):
        return True
    host = server.rpartition(":")[0]
    if host == "localhost":
        return True
    # An address, not a name that begins like one.
    try:
        return host.startswith("127.") and ipaddress.IPv4Address(host).is_loopback
    except ValueError:
        return False


def read_token_file(path: PathLike) -> str:
    """The token in a file of one line, as `hullctl token new --token-out` writes it.

    Raises ValueError: others can read it too, or it holds no token; OSError: it cannot be read. No
    error repeats its text.
    """
    info = os.stat(path)
    if stat.S_ISREG(info.st_mode) and info.st_mode & 0o077:
        raise ValueError(f"{os.fspath(path)}: others can read this token; chmod 600 it")
    words = pathlib.Path(path).read_text(encoding="ascii", errors="replace").split()
    if len(words) != 1:
        raise ValueError(
            f"{os.fspath(path)}: it does not hold one token, as 'hullctl token new --token-out' "
            "writes it"
        )
    return words[0]
