"""A server for a script or a test, which ends with the process."""

from __future__ import annotations

import collections
import functools
import hashlib
import os
import re
import shutil
import subprocess
import tempfile
import threading
import weakref
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from hulld.answers.collisions import Collision
from hulld.client import Client
from hulld.connection import PathLike
from hulld.geometry.points import PointsLike, as_points
from hulld.geometry.placements import Placement
from hulld.geometry.poses import PoseLike
from hulld.programs import find_program

if TYPE_CHECKING:
    from hulld.aio import AsyncClient

_LISTENING = re.compile(r"listening on (\S+)")
#: Number of lines kept from the end of the server's log.
_LINES = 200
_START_SECONDS = 60.0
#: Number of hulls of check() kept for later calls.
_MAX_SHAPES = 64
_STOP_SECONDS = 10.0
# Its input is a pipe from this process: when this process ends in any way, the script ends, stops
# the server, and removes its folder, $0.
_KEEPER = """
"$@" 3<&- </dev/null & child=$!
trap 'kill "$child" 2>/dev/null' TERM
{ read -r _ <&3; kill "$child" 2>/dev/null; } & reader=$!
wait "$child"; code=$?
[ "$code" -gt 128 ] && { wait "$child"; code=$?; }
kill "$reader" 2>/dev/null
rm -f "$0/socket"; rmdir "$0" 2>/dev/null
exit "$code"
"""


class LocalServer:
    """A hulld process on a socket of its own, in a directory that no other user can enter. It runs
    from `start` to `stop`, and always ends with this process. A context manager.

    data_dir: keeps the hulls there on disk; None: in memory, until the server ends. options:
    further flags of hulld, as in ["--max-hulls", "10"]. binary: the program; None: HULLD_BINARY, or
    else the PATH, or else a build in the checkout around the working directory. FileNotFoundError:
    the program is not found.
    """

    def __init__(
        self,
        *,
        data_dir: PathLike | None = None,
        options: Sequence[str] = (),
        binary: PathLike | None = None,
    ) -> None:
        self._program = str(find_program("hulld") if binary is None else binary)
        self._data_dir = data_dir
        self._options = list(options)
        self._process: subprocess.Popen[str] | None = None
        self._reader: threading.Thread | None = None
        self._listening = threading.Event()
        self._log: collections.deque[str] = collections.deque(maxlen=_LINES)
        self._address = ""
        self._remove: Callable[[], Any] = lambda: None

    @property
    def address(self) -> str:
        """The address, for Client, hullctl, and any other client on this machine. Requires a
        running server."""
        if not self._address:
            raise RuntimeError(
                "the server is not running; call start(), or use it as a context manager"
            )
        return self._address

    @property
    def log(self) -> list[str]:
        """The last lines that the server logged."""
        return list(self._log)

    def start(self) -> LocalServer:
        """Starts the server, and returns when it is listening. RuntimeError: the server ended
        instead; the message contains its output."""
        if self._process is not None:
            return self
        folder = tempfile.mkdtemp(prefix="hulld-")
        self._remove = weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        store = (
            ["--store", "memory"]
            if self._data_dir is None
            else ["--store", "rocksdb", "--data-dir", os.fspath(self._data_dir)]
        )
        command = [
            self._program,
            "--listen",
            f"unix:{folder}/socket",
            "--drain-timeout",
            "1",
            *store,
            *self._options,
        ]
        # Settings for the caller's own server do not apply to this one.
        environment = {
            name: value for name, value in os.environ.items() if not name.startswith("HULLD_")
        }
        # A separate session, so that Ctrl-C in a terminal reaches only the script, which then ends
        # the server.
        self._process = subprocess.Popen(
            ["sh", "-c", "exec 3<&0; " + _KEEPER, folder, *command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=environment,
            start_new_session=True,
        )
        self._reader = threading.Thread(
            target=self._read, args=(self._process,), name="hulld-log", daemon=True
        )
        self._reader.start()
        if not self._listening.wait(_START_SECONDS) or not self._address:
            self.stop()
            raise RuntimeError(
                "hulld did not start: " + ("\n".join(self._log) or "it printed nothing")
            )
        return self

    def _read(self, process: subprocess.Popen[str]) -> None:
        assert process.stdout is not None
        for line in process.stdout:
            self._log.append(line.rstrip("\n"))
            if not self._address and (found := _LISTENING.search(line)):
                self._address = found.group(1)
                self._listening.set()
        self._listening.set()

    def stop(self) -> None:
        """Ends the server, and returns when it has ended."""
        process, self._process = self._process, None
        if process is None:
            return
        assert process.stdin is not None and process.stdout is not None and self._reader is not None
        # Both, because a copy of this process may also hold the pipe.
        process.stdin.close()
        process.terminate()
        try:
            process.wait(_STOP_SECONDS)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, 9)
            process.wait()
        self._reader.join()
        process.stdout.close()
        self._address = ""
        self._listening.clear()
        self._remove()

    def __enter__(self) -> LocalServer:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()


class Local:
    """The result of local(): `with` yields a Client, `async with` an AsyncClient."""

    def __init__(self, server: LocalServer, client: dict[str, Any]) -> None:
        self._server = server
        self._options = client
        self._client: Client | None = None
        self._async_client: AsyncClient | None = None

    def __enter__(self) -> Client:
        self._client = Client(self._server.start().address, **self._options)
        return self._client

    def __exit__(self, *_: object) -> None:
        if self._client is not None:
            self._client.close()
        self._server.stop()

    async def __aenter__(self) -> AsyncClient:
        import asyncio

        from hulld.aio import AsyncClient

        await asyncio.to_thread(self._server.start)
        self._async_client = AsyncClient(self._server.address, **self._options)
        return self._async_client

    async def __aexit__(self, *_: object) -> None:
        import asyncio

        if self._async_client is not None:
            await self._async_client.close()
        await asyncio.to_thread(self._server.stop)


def local(
    *,
    data_dir: PathLike | None = None,
    options: Sequence[str] = (),
    binary: PathLike | None = None,
    **client: Any,
) -> Local:
    """Starts a private server and connects a client to it, for a script or a test:

        with hulld.local() as client:
            ...

    Arguments other than those of LocalServer, such as timeout, are passed to the client. The server
    stops when the context exits; its hulls are lost unless data_dir is set. With `async with`, the
    client is an AsyncClient.
    """
    return Local(LocalServer(data_dir=data_dir, options=options, binary=binary), client)


@functools.cache
def _shared() -> tuple[Client, threading.Lock, collections.OrderedDict[str, None]]:
    """The client of an in-memory server that ends with this process; the lock of check(), and the
    IDs of its hulls, oldest first."""
    return Client(LocalServer().start().address), threading.Lock(), collections.OrderedDict()


_starting = threading.Lock()


def shared_client() -> Client:
    """The client of an in-memory server shared by the whole process. It starts at the first
    call."""
    with _starting:
        return _shared()[0]


def check(
    a: PointsLike,
    b: PointsLike,
    *,
    pose_a: PoseLike = None,
    pose_b: PoseLike = None,
    radius_a: float = 0.0,
    radius_b: float = 0.0,
    **query: Any,
) -> Collision:
    """The relation of the convex hulls of two point sets, in one line:

        hulld.check(points_a, points_b, separation=True).separation.value

    a, b: n x 3 points, or objects with `vertices` or `points`, as in append_points. radius_a,
    radius_b: as in Placement; one point with a radius is a sphere. query: the keyword arguments of
    Client.check_collision. An in-memory server answers; it starts at the first call, ends with this
    process, and keeps the latest 64 point sets.
    """
    points = [as_points(a, "a"), as_points(b, "b")]
    client = shared_client()
    _, lock, known = _shared()
    with lock:
        ids = []
        for array in points:
            digest = hashlib.blake2b(array.tobytes(), key=array.dtype.str.encode(), digest_size=16)
            ids.append(f"check/{digest.hexdigest()}")
            if ids[-1] not in known:
                client.replace_hull(ids[-1], array, create=True)
            known[ids[-1]] = None
            known.move_to_end(ids[-1])
        answer = client.check_collision(
            Placement(ids[0], pose_a, radius=radius_a),
            Placement(ids[1], pose_b, radius=radius_b),
            **query,
        )
        while len(known) > _MAX_SHAPES:
            client.delete_hull(known.popitem(last=False)[0])
    return answer
