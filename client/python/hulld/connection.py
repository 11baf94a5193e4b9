"""The address of the server, TLS, and the token."""

from __future__ import annotations

import ipaddress
import json
import os
import pathlib
import re
import stat
from dataclasses import dataclass, field
from typing import Any, Union

DEFAULT_PORT = 50551
DEFAULT_SERVER = f"127.0.0.1:{DEFAULT_PORT}"
#: For several servers: round robin among all that are serving.
_SPREAD_CALLS = json.dumps(
    {"loadBalancingConfig": [{"round_robin": {}}], "healthCheckConfig": {"serviceName": ""}}
)
#: Replies of hulld are about 1 MiB. This limit bounds the memory that a faulty server can claim.
_MAX_RECEIVE_BYTES = 64 << 20

PathLike = Union[str, "os.PathLike[str]"]


@dataclass(frozen=True)
class Tls:
    """Encrypts the connection. Files are PEM, read when the client is created.

    ca_cert: the authorities trusted to sign the server's certificate; None: the system's
    authorities. cert, key: the client's certificate and its key, for mutual TLS. server_name: the
    name in the server's certificate, if it differs from the address.
    """

    ca_cert: PathLike | None = None
    cert: PathLike | None = None
    key: PathLike | None = None
    server_name: str | None = None

    def __post_init__(self) -> None:
        if (self.cert is None) != (self.key is None):
            raise ValueError(
                "a client certificate and its key belong together; pass both or neither"
            )


@dataclass(frozen=True)
class Connection:
    """The settings of a channel. ValueError: a malformed address or token, or a token that would be
    sent unencrypted to another machine."""

    server: str = DEFAULT_SERVER
    tls: Tls | None = None
    token: str | None = field(default=None, repr=False)
    insecure: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "server", _with_port(self.server))
        _ = self.target
        if self.tls is not None and not self.tls.server_name and _is_list(self.server):
            raise ValueError(
                "several addresses need the name in their certificates: pass "
                "tls=hulld.Tls(server_name=...)"
            )
        if self.token is None:
            return
        if not self.token or not all("!" <= character <= "~" for character in self.token):
            raise ValueError("the token is empty, or contains spaces or non-ASCII characters")
        if self.tls is None and not self.insecure and not is_loopback(self.server):
            raise ValueError(
                f"the token would be sent unencrypted to {self.server}; use tls=hulld.Tls(), or "
                "allow it with insecure=True"
            )

    @property
    def target(self) -> str:
        """gRPC's name of the server. ValueError: a list of addresses of different kinds."""
        if not _is_list(self.server):
            return self.server
        return f"ipv{_ip_version(self.server)}:{self.server}"

    def metadata(self) -> tuple[tuple[str, str], ...]:
        """The metadata of each call."""
        return (("authorization", f"Bearer {self.token}"),) if self.token else ()

    def options(self) -> list[tuple[str, Any]]:
        """The arguments of gRPC's channel."""
        options: list[tuple[str, Any]] = [
            ("grpc.max_receive_message_length", _MAX_RECEIVE_BYTES),
            ("grpc.max_send_message_length", -1),
            # Lets a retry reach a restarted server within a second. By default, gRPC resolves the
            # name, even an IP address, at most every 30 s before it reconnects.
            ("grpc.dns_min_time_between_resolutions_ms", 100),
            ("grpc.initial_reconnect_backoff_ms", 50),
            # The time for one connection attempt, TLS handshake included.
            ("grpc.min_reconnect_backoff_ms", 5000),
            ("grpc.max_reconnect_backoff_ms", 500),
            # Detects a server that vanished silently, for which a watch would otherwise wait
            # forever.
            ("grpc.keepalive_time_ms", 60_000),
            ("grpc.keepalive_timeout_ms", 20_000),
            ("grpc.http2.max_pings_without_data", 0),
        ]
        if _is_list(self.server) or self.server.startswith("dns:///"):
            options.append(("grpc.service_config", _SPREAD_CALLS))
        if is_loopback(self.server):
            # By default, gRPC uses the environment's proxy even for this machine.
            options.append(("grpc.enable_http_proxy", 0))
        if self.tls is not None and self.tls.server_name:
            options.append(("grpc.ssl_target_name_override", self.tls.server_name))
        return options

    def pem_files(self) -> tuple[bytes | None, bytes | None, bytes | None] | None:
        """The contents of ca_cert, key, and cert, in the order of gRPC's ssl_channel_credentials;
        None without TLS. OSError: a file cannot be read. ValueError: the key is encrypted."""
        if self.tls is None:
            return None

        def content(path: PathLike | None) -> bytes | None:
            return None if path is None else pathlib.Path(path).read_bytes()

        key = content(self.tls.key)
        if key is not None and b"ENCRYPTED" in key:
            # OpenSSL would ask for the passphrase on the terminal.
            raise ValueError(
                f"{self.tls.key}: the private key is encrypted; use one without a passphrase"
            )
        return content(self.tls.ca_cert), key, content(self.tls.cert)


def _with_port(server: Any) -> str:
    """The address, with DEFAULT_PORT if it has no port. TypeError, ValueError: not an address."""
    if not isinstance(server, str):
        raise TypeError(f'server is {server!r}; it must be a string such as "{DEFAULT_SERVER}"')
    if _is_list(server) or re.match(r"(unix|unix-abstract|ipv4|ipv6|vsock):|\w+:///", server):
        return server
    if _address(f"[{server}]") is not None:
        return f"[{server}]:{DEFAULT_PORT}"
    # A name or IPv4 address, or an IPv6 address in brackets; then a port.
    parts = re.fullmatch(r"([\w.-]+|\[[0-9A-Fa-f:.%\w]+\])(?::(\d{1,5}))?", server)
    if parts is None or (parts[2] is not None and not 1 <= int(parts[2]) <= 65535):
        raise ValueError(f'server is {server!r}; it must be HOST:PORT, such as "{DEFAULT_SERVER}"')
    return server if parts[2] else f"{server}:{DEFAULT_PORT}"


def is_loopback(server: str) -> bool:
    """True if every listed server is on this machine; False for DNS names other than localhost."""
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
                f"{one!r} is not ADDRESS:PORT; write a list as 10.0.0.1:50551,10.0.0.2:50551"
            )
        address = _address(host)
        if address is None:
            raise ValueError(
                f"{host!r} is a name, but a list must contain IP addresses; alternatively, give "
                "several servers one DNS name, as in dns:///hulls.example:50551"
            )
        versions.add(address.version)
    if len(versions) > 1:
        raise ValueError(f"{servers!r} lists IPv4 and IPv6 addresses; use one kind")
    return versions.pop()


def _address(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        if host.startswith("[") and host.endswith("]"):
            return ipaddress.IPv6Address(host[1:-1])
        return ipaddress.IPv4Address(host)
    except ValueError:
        return None


def _is_loopback_host(host: str) -> bool:
    # Not a name such as 127.0.0.1.example.
    address = _address(host)
    return host == "localhost" or (address is not None and address.is_loopback)


def read_token_file(path: PathLike) -> str:
    """The token in a file written by `hullctl token new --token-out`.

    ValueError: other users can read the file, or it contains no token. OSError: it cannot be read.
    Errors never quote the token.
    """
    info = os.stat(path)
    if stat.S_ISREG(info.st_mode) and info.st_mode & 0o077:
        raise ValueError(
            f"{os.fspath(path)}: the token is readable by other users; run chmod 600 on the file"
        )
    words = pathlib.Path(path).read_text(encoding="ascii", errors="replace").split()
    if len(words) != 1:
        raise ValueError(
            f"{os.fspath(path)}: it must contain exactly one token, as written by 'hullctl token "
            "new --token-out'"
        )
    return words[0]
