"""TLS and tokens, against the real server, and refusals of the client itself."""

from __future__ import annotations

import pathlib
import shutil
import subprocess
from collections.abc import Callable
from typing import Any

import pytest

import hulld
from conftest import CUBE
from hulld.connection import is_loopback


def run(*command: Any, cwd: pathlib.Path) -> None:
    subprocess.run([str(word) for word in command], cwd=cwd, check=True, capture_output=True)


@pytest.fixture(scope="module")
def secrets(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """ca.pem, server.pem and server.key for hulld.test, tokens, and two token files."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed")
    folder = tmp_path_factory.mktemp("secrets")
    key = ["-newkey", "rsa:2048", "-nodes", "-days", "2"]
    run(
        "openssl",
        "req",
        "-x509",
        *key,
        "-keyout",
        "ca.key",
        "-out",
        "ca.pem",
        "-subj",
        "/CN=ca",
        cwd=folder,
    )
    for who in ("server", "client"):
        run(
            "openssl",
            "req",
            *key[:3],
            "-keyout",
            f"{who}.key",
            "-out",
            f"{who}.csr",
            "-subj",
            f"/CN={who}",
            cwd=folder,
        )
        (folder / "names").write_text("subjectAltName=DNS:hulld.test\n")
        run(
            "openssl",
            "x509",
            "-req",
            "-in",
            f"{who}.csr",
            "-CA",
            "ca.pem",
            "-CAkey",
            "ca.key",
            "-CAcreateserial",
            "-days",
            "2",
            "-extfile",
            "names",
            "-out",
            f"{who}.pem",
            cwd=folder,
        )
        (folder / f"{who}.key").chmod(0o600)
    with open(folder / "tokens", "w", encoding="ascii") as tokens:
        for name, role in (("reader", "read-only"), ("writer", "read-write")):
            subprocess.run(
                [
                    hulld.find_program("hullctl"),
                    "token",
                    "new",
                    name,
                    "--role",
                    role,
                    "--token-out",
                    f"{name}.token",
                ],
                cwd=folder,
                check=True,
                stdout=tokens,
            )
    (folder / "tokens").chmod(0o600)
    return folder


def test_tls_with_certificates_and_tokens(
    connect: Callable[..., Any], secrets: pathlib.Path
) -> None:
    options = [
        "--listen",
        "127.0.0.1:0",
        "--tls-cert",
        str(secrets / "server.pem"),
        "--tls-key",
        str(secrets / "server.key"),
        "--tls-client-ca",
        str(secrets / "ca.pem"),
        "--tokens-file",
        str(secrets / "tokens"),
    ]
    tls = hulld.Tls(
        secrets / "ca.pem", secrets / "client.pem", secrets / "client.key", "hulld.test"
    )
    once = hulld.RetryPolicy(max_attempts=1)
    with hulld.LocalServer(options=options) as server:
        writer = connect(
            server.address, tls=tls, token=hulld.read_token_file(secrets / "writer.token")
        )
        writer.append_points("a", CUBE, create=True)
        assert "<iframe" in writer.get_hull("a")._repr_html_()
        reader = connect(
            server.address, tls=tls, token=hulld.read_token_file(secrets / "reader.token")
        )
        assert reader.check_collision("a", ("a", (1, 0, 0))).relation == hulld.Relation.TOUCHING
        with pytest.raises(hulld.PermissionDeniedError) as denied:
            reader.create_hull("b")
        assert denied.value.metadata["needed_role"] == "read-write"
        with pytest.raises(hulld.UnauthenticatedError) as missing:
            connect(server.address, tls=tls).get_hull("a")
        assert missing.value.reason == "TOKEN_MISSING"
        # The server cannot be reached without our client certificate, with another authority, or
        # without TLS.
        for wrong in (
            hulld.Tls(secrets / "ca.pem", server_name="hulld.test"),
            hulld.Tls(server_name="hulld.test"),
            None,
        ):
            with pytest.raises(hulld.UnavailableError):
                connect(server.address, tls=wrong, retry=once, timeout=10).get_status()


def test_a_token_is_not_sent_unencrypted() -> None:
    with pytest.raises(ValueError, match="unencrypted to hulld.example:1"):
        hulld.Client("hulld.example:1", token="secret")
    hulld.Client("hulld.example:1", token="secret", insecure=True).close()
    for bad in ("", "two words", "line\n", "umlaut-ä"):
        with pytest.raises(ValueError, match="token"):
            hulld.Client(token=bad)


@pytest.mark.parametrize(
    ("server", "here"),
    [
        ("unix:/run/hulld", True),
        ("[::1]:1", True),
        ("localhost:1", True),
        ("127.9.9.9:1", True),
        ("127.0.0.1:1,127.0.0.1:2", True),
        ("127.0.0.1:1,10.0.0.1:1", False),
        ("127.0.0.1.example:1", False),
        ("10.0.0.1:1", False),
        ("hulld.example:1", False),
    ],
)
def test_only_loopback_addresses_are_on_this_machine(server: str, here: bool) -> None:
    assert is_loopback(server) == here


@pytest.mark.parametrize(
    ("servers", "problem"),
    [
        ("a.example:1,b.example:1", "dns:///hulls.example:50551"),
        ("10.0.0.1:1,[::1]:1", "use one kind"),
        ("10.0.0.1:1,", "is not ADDRESS:PORT"),
    ],
)
def test_malformed_server_lists_are_refused(servers: str, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        hulld.Client(servers)


def test_a_certificate_for_several_addresses_needs_a_name() -> None:
    with pytest.raises(ValueError, match="server_name"):
        hulld.Client("10.0.0.1:1,10.0.0.2:1", tls=hulld.Tls())


def test_a_token_file_must_be_private(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "token"
    file.write_text("secret\n")
    file.chmod(0o644)
    with pytest.raises(ValueError, match="chmod 600"):
        hulld.read_token_file(file)
    file.chmod(0o600)
    assert hulld.read_token_file(file) == "secret"
    file.write_text("two words")
    with pytest.raises(ValueError, match="one token") as caught:
        hulld.read_token_file(file)
    assert "words" not in str(caught.value)


def test_an_encrypted_key_is_refused(tmp_path: pathlib.Path) -> None:
    key = tmp_path / "key.pem"
    key.write_text("-----BEGIN ENCRYPTED PRIVATE KEY-----\n")
    with pytest.raises(ValueError, match="without a passphrase"):
        hulld.Client("127.0.0.1:1", tls=hulld.Tls(cert=key, key=key))


def test_a_certificate_and_its_key_belong_together() -> None:
    with pytest.raises(ValueError, match="belong together"):
        hulld.Tls(cert="a.pem")
