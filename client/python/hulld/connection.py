"""Where the server is, how the connection is protected, and who we are."""

from __future__ import annotations

import ipaddress
import json
import os
import pathlib
import stat
from dataclasses import dataclass, field
from typing import Any, Union

import grpc

DEFAULT_SERVER = "127.0.0.1:50551"
#: For several servers: in turn, and only to those that report that they serve.
_SPREAD_CALLS = json.dumps(
    {"loadBalancingConfig": [{"round_robin": {}}], "healthCheckConfig": {"serviceName": ""}}
)
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
        _ = self.target
        if self.tls is not None and not self.tls.server_name and _is_list(self.server):
            raise ValueError(
                "several addresses have certificates for one name: say which, with "
                "tls=hulld.Tls(server_name=...)"
            )
        if self.token is None:
            return
        if not self.token or not all("!" <= character <= "~" for character in self.token):
            raise ValueError("the token is empty, or holds blanks or characters beyond ASCII")
        if self.tls is None and not self.insecure and not is_loopback(self.server):
            raise ValueError(
                f"the token would travel unencrypted to {self.server}, where everyone on the way "
                "could read it; use tls=hulld.Tls(), or allow it with insecure=True"
            )

    @property
    def target(self) -> str:
        """What gRPC calls the server. ValueError: a list of what is not addresses of one kind."""
        if not _is_list(self.server):
            return self.server
        return f"ipv{_ip_version(self.server)}:{self.server}"

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
        if _is_list(self.server) or self.server.startswith("dns:///"):
            options.append(("grpc.service_config", _SPREAD_CALLS))
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
    """Whether every server that it names is on this machine. False for what only DNS can tell."""
    return server.startswith("unix:") or all(
        _is_loopback_host(one.rpartition(":")[0]) for one in server.split(",")
    )


def _is_list(server: str) -> bool:
    return "," in server and not server.startswith("unix:") and ":///" not in server


def _ip_version(servers: str) -> int:
    versions = set()
    for one in servers.split(","):
        host, _, port = one.rpartition(":")
        if not host or not port.isdecimal():
            raise ValueError(
                f"{one!r} is not ADDRESS:PORT; a list reads 10.0.0.1:50551,10.0.0.2:50551"
            )
        address = _address(host)
        if address is None:
            raise ValueError(
                f"{host!r} is a name, and a list takes IP addresses; several servers may also "
                "have one name in DNS, as in dns:///hulls.example:50551"
            )
        versions.add(address.version)
    if len(versions) > 1:
        raise ValueError(f"{servers!r} lists addresses of IPv4 and of IPv6; use one kind")
    return versions.pop()


def _address(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        if host.startswith("[") and host.endswith("]"):
            return ipaddress.IPv6Address(host[1:-1])
        return ipaddress.IPv4Address(host)
    except ValueError:
        return None


def _is_loopback_host(host: str) -> bool:
    # An address, not a name that begins like one.
    address = _address(host)
    return host == "localhost" or (address is not None and address.is_loopback)


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
