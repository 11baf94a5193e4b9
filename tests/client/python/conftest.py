"""Shared fixtures: one server for all tests, clients of both kinds, the larger meshes."""

from __future__ import annotations

import asyncio
import inspect
import os
import pathlib
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import hulld

SOURCE = pathlib.Path(__file__).resolve().parents[3]
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)


@pytest.fixture(scope="session")
def server() -> Iterator[hulld.LocalServer]:
    with hulld.LocalServer() as running:
        yield running


@pytest.fixture
def client(server: hulld.LocalServer) -> Iterator[hulld.Client]:
    with hulld.Client(server.address) as connected:
        yield connected


class Blocking:
    """An asynchronous object, used like its synchronous twin, so that one test covers both.

    The loop runs in a thread of its own, so that any thread may call.
    """

    def __init__(self, target: Any, loop: asyncio.AbstractEventLoop) -> None:
        self._target = target
        self._loop = loop

    def _run(self, awaitable: Any) -> Any:
        async def wait() -> Any:
            return await awaitable

        return asyncio.run_coroutine_threadsafe(wait(), self._loop).result()

    def _settle(self, value: Any) -> Any:
        if inspect.isawaitable(value):
            value = self._run(value)
        if hasattr(value, "__anext__") or hasattr(value, "__aenter__"):
            return Blocking(value, self._loop)
        return value

    def __getattr__(self, attribute: str) -> Any:
        value = getattr(self._target, attribute)
        if not inspect.isroutine(value):
            return value

        def call(*arguments: Any, **options: Any) -> Any:
            # Some routines open channels and calls, which belong to the running loop.
            async def start() -> Any:
                return value(*arguments, **options)

            return self._settle(self._run(start()))

        return call

    def __iter__(self) -> Blocking:
        return self

    def __next__(self) -> Any:
        try:
            return self._settle(self._target.__anext__())
        except StopAsyncIteration:
            raise StopIteration from None

    def __enter__(self) -> Any:
        return self._settle(self._target.__aenter__())

    def __exit__(self, *error: Any) -> None:
        self._run(self._target.__aexit__(*error))


@pytest.fixture(params=["sync", "async"])
def connect(request: pytest.FixtureRequest) -> Iterator[Callable[..., Any]]:
    """Creates synchronous and asynchronous clients with the same interface."""
    clients: list[Any] = []
    loop = asyncio.new_event_loop() if request.param == "async" else None
    if loop is not None:
        thread = threading.Thread(target=loop.run_forever)
        thread.start()

    def make(server: str, **options: Any) -> Any:
        made = (
            hulld.Client(server, **options)
            if loop is None
            else Blocking(hulld.AsyncClient(server, **options), loop)
        )
        clients.append(made)
        return made

    yield make
    for made in clients:
        made.close()
    if loop is not None:
        asyncio.run_coroutine_threadsafe(loop.shutdown_asyncgens(), loop).result()
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()


@pytest.fixture
def either(connect: Callable[..., Any], server: hulld.LocalServer) -> Any:
    """A client of the shared server, of either kind."""
    return connect(server.address)


@pytest.fixture
def name(request: pytest.FixtureRequest) -> str:
    """An ID unique to the test."""
    return "".join(c if c.isalnum() else "-" for c in request.node.name).strip("-")


@pytest.fixture
def data() -> pathlib.Path:
    """The folder of larger meshes; the test is skipped without it."""
    folder = pathlib.Path(os.environ.get("HULLD_DATA", SOURCE.parent / "shared/data"))
    if not folder.is_dir():
        pytest.skip("no data: HULLD_DATA names no folder")
    return folder


@pytest.fixture
def rng() -> np.random.Generator:
    seed = int(os.environ.get("HULLD_TEST_SEED", "1"))
    print(f"seed {seed}")
    return np.random.default_rng(seed)
