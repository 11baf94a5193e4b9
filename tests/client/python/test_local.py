"""hulld.local(): a server for the life of a script."""

from __future__ import annotations

import asyncio
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

import pytest

import hulld
from conftest import CUBE


def test_the_server_ends_with_its_context() -> None:
    with hulld.local() as client:
        client.append_points("a", CUBE, create=True)
        folder = pathlib.Path(client.server.removeprefix("unix:")).parent
        assert folder.stat().st_mode & 0o077 == 0
        assert client.get_status().store_kind == "memory"
    assert not folder.exists()


def test_it_serves_asyncio_too() -> None:
    async def ask() -> str:
        async with hulld.local(timeout=20) as client:
            await client.append_points("a", CUBE, create=True)
            return (await client.check_collision("a", ("a", (1, 0, 0)))).relation.name

    assert asyncio.run(ask()) == "TOUCHING"


def test_hulls_persist_in_a_data_directory(tmp_path: pathlib.Path) -> None:
    for expected in ([], ["a"]):
        with hulld.local(data_dir=tmp_path / "hulls") as client:
            assert [hull.hull_id for hull in client.list_hulls()] == expected
            done = client.append_points("a", CUBE, create=True)
            assert done.durability == hulld.Durability.SYNC


def test_options_are_flags_of_the_server() -> None:
    with hulld.local(options=["--max-hulls", "1"]) as client:
        client.create_hull("a")
        with pytest.raises(hulld.ResourceExhaustedError) as caught:
            client.create_hull("b")
        assert caught.value.metadata == {"flag": "max-hulls", "limit": "1"}


def test_a_server_that_does_not_start_raises_the_reason() -> None:
    with pytest.raises(RuntimeError, match="max-hulls"):
        hulld.LocalServer(options=["--max-hulls", "many"]).start()


def test_the_server_ends_with_a_script_that_is_killed() -> None:
    script = (
        "import hulld, sys, time\n"
        "with hulld.local() as client:\n"
        "    print(client.server, flush=True)\n"
        "    sys.stdin.read()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as running:
        assert running.stdout is not None
        address = running.stdout.readline().strip()
        with hulld.Client(address, retry=hulld.RetryPolicy(max_attempts=1)) as client:
            assert client.check_health()
            # This ends when the server does.
            watch = client.watch_hulls(timeout=0)
            while not next(watch).synced:
                pass
            os.kill(running.pid, signal.SIGKILL)
            with pytest.raises(hulld.UnavailableError):
                while True:
                    next(watch)
    # The process that watches the server removes it a moment later.
    while pathlib.Path(address.removeprefix("unix:")).parent.exists():
        time.sleep(0.01)


def test_two_point_sets_are_checked_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    assert hulld.check(CUBE, CUBE + (1, 0, 0)).relation.name == "TOUCHING"
    apart = hulld.check(CUBE, CUBE.tolist(), pose_b=(3, 0, 0), separation=True)
    assert apart.separation is not None and abs(apart.separation.value - 2) < 1e-12
    assert hulld.check(CUBE, CUBE, pose_a=(0, 0, 5), clearance=4.5).within_clearance
    for bad in ((CUBE * float("nan"), CUBE), (CUBE, CUBE[:, :2])):
        with pytest.raises(ValueError, match="^[ab]"):
            hulld.check(*bad)
    with pytest.raises(TypeError, match="separate"):
        hulld.check(CUBE, CUBE, separate=True)
    # The latest point sets are kept for further calls.
    monkeypatch.setattr("hulld.local_server._MAX_SHAPES", 3)
    for x in range(9):
        hulld.check(CUBE, CUBE + (x, 0, 0))
    shared = hulld.local_server.shared_client()
    kept = {hull.hull_id: hull.revision for hull in shared.list_hulls("check/")}
    assert len(kept) == 3
    hulld.check(CUBE, CUBE + (8, 0, 0))
    assert kept == {hull.hull_id: hull.revision for hull in shared.list_hulls("check/")}


def test_threads_check_at_once() -> None:
    found: list[str] = []

    def ask(x: int) -> None:
        found.append(hulld.check(CUBE, CUBE + (x, 0, 0)).relation.name)

    threads = [threading.Thread(target=ask, args=(x,)) for x in (2, 3, 4, 5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == ["SEPARATED"] * 4


def test_the_shared_server_ends_with_the_process() -> None:
    script = (
        "import hulld\n"
        "print(hulld.check([(0, 0, 0)], [(0, 0, 1)]).relation.name)\n"
        "print(hulld.local_server.shared_client().server)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    relation, address = done.stdout.split()
    assert relation == "SEPARATED" and done.stderr == ""
    with hulld.Client(address, retry=hulld.RetryPolicy(max_attempts=1)) as client:
        # The process that watches the server ends it a moment later.
        while pathlib.Path(address.removeprefix("unix:")).exists():
            time.sleep(0.01)
        with pytest.raises(hulld.UnavailableError):
            client.get_status()


def test_programs_are_found_by_variable_path_and_build(
    monkeypatch: pytest.MonkeyPatch, tmp_path: pathlib.Path
) -> None:
    def program(path: pathlib.Path) -> pathlib.Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("#!/bin/sh\n")
        path.chmod(0o755)
        return path

    named, on_path = program(tmp_path / "named/hulld"), program(tmp_path / "path/hulld")
    (tmp_path / "tree/proto/hulld/v1").mkdir(parents=True)
    (tmp_path / "tree/proto/hulld/v1/hull.proto").touch()
    built = program(tmp_path / "tree/build/release/bin/hulld")
    (tmp_path / "tree/deep").mkdir()
    monkeypatch.chdir(tmp_path / "tree/deep")
    # The package itself may be installed below a checkout, as it is when ctest runs this.
    monkeypatch.setattr("hulld.programs.__file__", str(tmp_path / "programs.py"))
    monkeypatch.setenv("PATH", str(on_path.parent))
    monkeypatch.delenv("HULLCTL_BINARY", raising=False)
    monkeypatch.setenv("HULLD_BINARY", str(named))
    assert hulld.find_program("hulld") == named
    program(tmp_path / "named/hullctl")
    assert hulld.find_program("hullctl") == tmp_path / "named/hullctl"
    monkeypatch.delenv("HULLD_BINARY")
    assert hulld.find_program("hulld") == on_path
    monkeypatch.setenv("PATH", str(tmp_path))
    assert hulld.find_program("hulld") == built
    monkeypatch.setenv("HULLD_BINARY", str(tmp_path / "nothing"))
    with pytest.raises(FileNotFoundError, match="HULLD_BINARY is .*nothing"):
        hulld.find_program("hulld")
    monkeypatch.delenv("HULLD_BINARY")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FileNotFoundError, match="HULLD_BINARY is not set"):
        hulld.find_program("hulld")
