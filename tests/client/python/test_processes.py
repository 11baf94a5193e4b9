"""The modules that an import loads, and calls in forked processes."""

from __future__ import annotations

import asyncio
import copy
import os
import pickle
import re
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

import hulld
from conftest import CUBE

REFUSED = 'was forked while its parent had an open hulld client.*"spawn"'


def outcome_in_a_child(act: Callable[[], Any]) -> str:
    """The result of `act` in a forked process: the text of its error, or "done"."""
    out, into = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            act()
            said = "done"
        except BaseException as error:
            said = f"{type(error).__name__}: {error}"
        os.write(into, said.encode())
        os._exit(0)
    os.close(into)
    with os.fdopen(out) as said_by_child:
        text = said_by_child.read()
    os.waitpid(child, 0)
    return text


def test_an_async_client_belongs_to_one_event_loop() -> None:
    with hulld.LocalServer() as server:
        client = hulld.AsyncClient(server.address)
        assert asyncio.run(client.check_health())
        with pytest.raises(hulld.FailedPreconditionError, match="create one in each asyncio.run"):
            asyncio.run(client.check_health())
        asyncio.run(client.close())


def test_a_client_is_neither_copied_nor_sent_to_another_process() -> None:
    client = hulld.Client("127.0.0.1:1")
    for act in (pickle.dumps, copy.deepcopy):
        with pytest.raises(TypeError, match=r"create another one with its address, client\.server"):
            act(client)


def test_an_import_loads_only_the_modules_that_are_used() -> None:
    script = (
        "import sys, hulld\n"
        "def loaded(*names): return [name for name in names if name in sys.modules]\n"
        "print(loaded('numpy', 'google.protobuf', 'grpc', 'asyncio'))\n"
        "client = hulld.Client('127.0.0.1:1')\n"
        "hulld.as_points([(0, 0, 0)])\n"
        "print(loaded('numpy', 'grpc', 'asyncio', 'hulld.aio'))\n"
        "hulld.AsyncClient('127.0.0.1:1')\n"
        "print(loaded('grpc', 'hulld.aio'))\n"
        "print(set(hulld.__all__) <= set(dir(hulld)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == ["[]", "['numpy']", "['hulld.aio']", "True"]
    with pytest.raises(AttributeError, match="AsyncNothing"):
        hulld.AsyncNothing


def test_a_forked_child_gets_an_error_with_advice(client: hulld.Client, name: str) -> None:
    client.append_points(name, CUBE, create=True)
    stream = client.stream_collisions([name, name])
    appender = client.open_append(name)
    watch = client.watch_hulls(name)
    next(watch)
    for act in (
        client.get_status,
        lambda: list(client.list_hulls()),
        lambda: client.check_collisions([name, name]),
        lambda: stream.update([1], [(3, 0, 0)]),
        lambda: appender.append(CUBE),
        lambda: next(watch),
        # A new client needs the same threads of gRPC.
        lambda: hulld.Client(client.server).get_status(),
        lambda: asyncio.run(ask_a_new_client(client.server)),
    ):
        said = outcome_in_a_child(act)
        assert said.startswith("FailedPreconditionError: "), said
        assert re.search(REFUSED, said), said
    # Leaving a context in the child disturbs nothing in the parent.
    assert outcome_in_a_child(client.close) == "done"
    assert stream.update([1], [(3, 0, 0)]).answers.relations.tolist() == [1]
    stream.close()
    appender.cancel()
    watch.cancel()
    assert client.get_hull(name).info.vertex_count == 8


def test_a_child_may_connect_if_every_client_was_closed(server: hulld.LocalServer) -> None:
    script = (
        "import os, sys, hulld\n"
        "with hulld.Client(sys.argv[1]) as client:\n"
        "    client.get_status()\n"
        "unused = hulld.Client(sys.argv[1])\n"
        "if (child := os.fork()) == 0:\n"
        "    unused.get_status()\n"
        "    with hulld.Client(sys.argv[1]) as client:\n"
        "        print(client.check_health(), flush=True)\n"
        "    os._exit(0)\n"
        "os.waitpid(child, 0)\n"
    )
    command = [sys.executable, "-c", script, server.address]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == "True\n", done.stderr


def test_a_fork_returns_while_a_channel_reconnects(server: hulld.LocalServer) -> None:
    script = (
        "import os, sys, hulld\n"
        "client = hulld.Client(sys.argv[1])\n"
        "client.get_status()\n"
        "gone = hulld.Client('127.0.0.1:1', timeout=0.5)\n"
        "for _ in range(4):\n"
        "    try:\n"
        "        gone.get_status()\n"
        "    except hulld.HulldError:\n"
        "        pass\n"
        "    if (child := os.fork()) == 0:\n"
        "        os._exit(0)\n"
        "    os.waitpid(child, 0)\n"
        "print(client.check_health())\n"
    )
    command = [sys.executable, "-c", script, server.address]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=100)
    assert done.stdout == "True\n", done.stderr


async def ask_a_new_client(address: str) -> None:
    async with hulld.AsyncClient(address) as client:
        await client.get_status()


def test_an_asynchronous_client_gets_the_same_error(server: hulld.LocalServer) -> None:
    async def fork_and_ask() -> str:
        async with hulld.AsyncClient(server.address) as client:
            await client.get_status()
            out, into = os.pipe()
            child = os.fork()
            if child == 0:
                try:
                    await client.get_status()
                    said = "done"
                except BaseException as error:
                    said = str(error)
                os.write(into, said.encode())
                os._exit(0)
            os.close(into)
            with os.fdopen(out) as said_by_child:
                text = said_by_child.read()
            os.waitpid(child, 0)
            await client.get_status()
            return text

    assert "open hulld client" in asyncio.run(fork_and_ask())


def test_a_closed_client_raises_an_error(connect: Any, server: hulld.LocalServer) -> None:
    client = connect(server.address)
    client.get_status()
    client.close()
    with pytest.raises(hulld.FailedPreconditionError, match="the client is closed"):
        client.get_status()
