"""Calls that are safe to repeat outlive a restart of the server, up to their timeout."""

from __future__ import annotations

import concurrent.futures
import contextlib
import pathlib
import re
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import hulld
from conftest import CUBE

#: More connections than the attempts of a call that soon gives up.
REFUSED = 5
TIMEOUT = 60


class Restartable:
    """A hulld on a port that stays the same."""

    def __init__(self, folder: pathlib.Path) -> None:
        self._folder = folder
        self._process: subprocess.Popen[str] | None = None
        self.port = 0

    @property
    def address(self) -> str:
        return f"127.0.0.1:{self.port}"

    def start(self) -> None:
        self._process = subprocess.Popen(
            [
                str(hulld.find_program("hulld")),
                f"--listen={self.address}",
                f"--data-dir={self._folder / 'hulls'}",
            ],
            stderr=subprocess.STDOUT,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if found := re.search(r"listening on 127\.0\.0\.1:(\d+)", line):
                self.port = int(found[1])
                threading.Thread(target=self._process.stdout.read, daemon=True).start()
                return
        raise RuntimeError("hulld did not start")

    def kill(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None

    def refuse(self, connections: int, until: Callable[[], bool]) -> None:
        """Listens in place of the killed server, and drops connections."""
        with socket.socket() as listener:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
            listener.bind(("127.0.0.1", self.port))
            listener.listen()
            listener.settimeout(0.1)
            while connections > 0:
                assert not until(), "the call ended without a server"
                with contextlib.suppress(TimeoutError):
                    listener.accept()[0].close()
                    connections -= 1


@pytest.fixture
def running(tmp_path: pathlib.Path) -> Iterator[Restartable]:
    server = Restartable(tmp_path)
    server.start()
    yield server
    server.kill()


def outlive_a_restart(server: Restartable, *calls: Callable[[], Any]) -> list[Any]:
    """The answers of `calls`, which begin while the server is gone."""
    server.kill()
    with concurrent.futures.ThreadPoolExecutor(len(calls)) as threads:
        answers = [threads.submit(call) for call in calls]
        server.refuse(REFUSED, lambda: any(answer.done() for answer in answers))
        server.start()
        return [answer.result() for answer in answers]


def test_safe_calls_survive_a_restart(connect: Any, running: Restartable) -> None:
    client = connect(running.address, timeout=TIMEOUT)
    client.append_points("cube", CUBE, create=True)
    client.put_body("body", ["cube"])
    pair = ["cube", ("body", (3, 0, 0))]
    outlive_a_restart(
        running,
        client.get_status,
        lambda: client.create_hull("cube", if_absent=True),
        lambda: client.get_hull("cube"),
        lambda: client.get_hull_mesh("cube"),
        lambda: list(client.list_hulls()),
        lambda: client.put_body("body", ["cube"]),
        lambda: client.check_collision(*pair),
        lambda: client.check_collisions(pair),
        lambda: client.find_collisions(pair),
        lambda: client.append_points("cube", CUBE),
        lambda: next(iter(client.watch_hulls())),
    )


def test_an_open_append_continues_after_a_restart(connect: Any, running: Restartable) -> None:
    client = connect(running.address, timeout=TIMEOUT)
    with client.open_append("cube", create=True) as appender:
        appender.append(CUBE[:4])

        def append_the_rest() -> Any:
            appender.append(CUBE[4:])
            return appender.finish()

        [done] = outlive_a_restart(running, append_the_rest)
    assert done.points_acknowledged == 8
    assert client.get_hull("cube").info.vertex_count == 8


def test_a_call_that_is_not_safe_to_repeat_is_sent_once(connect: Any, running: Restartable) -> None:
    client = connect(running.address, timeout=TIMEOUT)
    client.append_points("cube", CUBE, create=True)
    running.kill()
    for call in (
        lambda: client.delete_hull("cube"),
        lambda: client.create_hull("other"),
        lambda: client.put_body("body", ["cube"], if_revision=0),
        lambda: client.replace_hull("cube", CUBE),
    ):
        with pytest.raises(hulld.UnavailableError):
            call()
    running.start()
    assert [hull.hull_id for hull in client.list_hulls()] == ["cube"]


def test_hullctl_waits_for_a_server_until_its_timeout(running: Restartable) -> None:
    program = str(hulld.find_program("hullctl"))

    def hullctl(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [program, *arguments, "--server", running.address],
            capture_output=True,
            text=True,
            check=False,
        )

    def status() -> subprocess.CompletedProcess[str]:
        return hullctl("list", "--timeout", f"{TIMEOUT}s")

    [answer] = outlive_a_restart(running, status)
    assert answer.returncode == 0
    running.kill()
    assert hullctl("list").returncode == 3


def test_the_channel_finds_a_restarted_server_soon(server: hulld.LocalServer) -> None:
    options = dict(hulld.Client(server.address)._connection.options())
    # By default gRPC resolves a name, and so reconnects, at most every 30 s.
    assert options["grpc.dns_min_time_between_resolutions_ms"] == 100
    assert options["grpc.initial_reconnect_backoff_ms"] <= 100
    assert options["grpc.max_reconnect_backoff_ms"] <= 500
    # By default gRPC never notices that a server vanished silently while a watch is quiet.
    assert options["grpc.keepalive_time_ms"] <= 60_000
    assert options["grpc.keepalive_timeout_ms"] <= 20_000
    assert options["grpc.http2.max_pings_without_data"] == 0
