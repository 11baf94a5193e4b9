"""Retries of calls that are safe to repeat, and errors of other calls."""

from __future__ import annotations

import asyncio
import pickle
import threading
import types
from collections.abc import Callable, Iterator
from typing import Any

import grpc
import numpy as np
import pytest

import hulld
from fake_hulld import FakeHulld, refuse
from hulld.aio import transport
from hulld.calls import transport as sync_transport
from hulld.calls.reported_pairs import WatchedPlacements
from hulld.calls.requests import SceneFilter, watch_hulls
from hulld.errors import from_status
from hulld.retry import may_retry
from hulld.v1 import hull_pb2

QUICK = hulld.RetryPolicy(max_attempts=4, initial_backoff=0.001, max_backoff=0.002)


@pytest.fixture
def fake() -> Iterator[FakeHulld]:
    with FakeHulld() as server:
        yield server


@pytest.fixture
def caller(connect: Callable[..., Any], fake: FakeHulld) -> Any:
    """A client of the fake server, of either kind."""
    return connect(fake.address, retry=QUICK, timeout=20)


def unavailable(context: Any) -> None:
    refuse(context, grpc.StatusCode.UNAVAILABLE, "the server ends soon", reason="DRAINING")


def stopping(context: Any) -> None:
    """Ends the call like a server in the last moment of its shutdown."""
    context.abort(grpc.StatusCode.CANCELLED, "CANCELLED")


def busy(context: Any) -> None:
    refuse(
        context,
        grpc.StatusCode.RESOURCE_EXHAUSTED,
        "too many calls",
        reason="OVERLOADED",
        metadata={"flag": "max-calls", "limit": "1"},
        pushback="1",
    )


def full(context: Any) -> None:
    refuse(
        context,
        grpc.StatusCode.RESOURCE_EXHAUSTED,
        "too many hulls",
        reason="LIMIT_EXCEEDED",
        metadata={"flag": "max-hulls"},
    )


# --- Single calls ---


def test_calls_that_are_safe_to_repeat_are_retried(caller: Any, fake: FakeHulld) -> None:
    fake.script = [unavailable, busy, unavailable]
    assert caller.get_status().version == "fake"
    assert len(fake.calls) == 4


def test_calls_survive_the_shutdown_of_a_server(caller: Any, fake: FakeHulld) -> None:
    fake.script = [stopping]
    assert caller.get_status().version == "fake"
    fake.script = [stopping]
    assert caller.append_points("a", np.zeros((7, 3)), create=True).points_acknowledged == 7
    fake.script = [stopping]
    with caller.watch_hulls() as watch:
        assert next(watch).header.revision == 10


def test_attempts_are_counted(caller: Any, fake: FakeHulld) -> None:
    fake.script = [unavailable] * 9
    with pytest.raises(hulld.UnavailableError) as caught:
        caller.get_status()
    assert len(fake.calls) == QUICK.max_attempts and caught.value.reason == "DRAINING"


def test_other_calls_are_not_retried(caller: Any, fake: FakeHulld) -> None:
    for call in (lambda: caller.delete_hull("a"), lambda: caller.create_hull("a")):
        fake.calls.clear()
        fake.script = [unavailable]
        with pytest.raises(hulld.UnavailableError):
            call()
        assert len(fake.calls) == 1
    fake.calls.clear()
    fake.script = [unavailable]
    assert caller.create_hull("a", if_absent=True).created and len(fake.calls) == 2


def test_a_limit_without_a_retry_hint_is_final(caller: Any, fake: FakeHulld) -> None:
    fake.script = [full]
    with pytest.raises(hulld.ResourceExhaustedError) as caught:
        caller.get_status()
    error = caught.value
    assert len(fake.calls) == 1 and error.metadata == {"flag": "max-hulls"}
    assert error.retry_after is None and error.request_id == "fake-1"
    assert str(error) == "RESOURCE_EXHAUSTED: too many hulls (LIMIT_EXCEEDED, request fake-1)"


def test_a_retry_hint_beyond_the_deadline_ends_the_call(connect: Any, fake: FakeHulld) -> None:
    client = connect(fake.address, timeout=5)
    fake.script = [
        lambda context: refuse(
            context,
            grpc.StatusCode.RESOURCE_EXHAUSTED,
            "busy",
            reason="OVERLOADED",
            pushback="3600000",
        )
    ]
    with pytest.raises(hulld.ResourceExhaustedError) as caught:
        client.get_status()
    assert caught.value.retry_after == 3600 and len(fake.calls) == 1


def test_no_server_is_unavailable(connect: Any, tmp_path: Any) -> None:
    client = connect(f"unix:{tmp_path}/nobody", retry=QUICK, timeout=5)
    with pytest.raises(hulld.UnavailableError) as caught:
        client.get_status()
    assert caught.value.reason is None and caught.value.request_id is None


def test_calls_alternate_between_the_servers_that_remain(connect: Any, fake: FakeHulld) -> None:
    with FakeHulld() as other:
        client = connect(f"{fake.address},{other.address}", retry=QUICK, timeout=20)
        while not (fake.calls and other.calls):
            client.get_status()
        before = len(fake.calls), len(other.calls)
        for _ in range(20):
            client.get_status()
        assert (len(fake.calls) - before[0], len(other.calls) - before[1]) == (10, 10)
    before = len(fake.calls), 0
    for _ in range(20):
        client.get_status()
    assert len(fake.calls) - before[0] == 20


def test_an_interrupted_mesh_is_read_again(caller: Any, fake: FakeHulld) -> None:
    fake.script = [lambda context: None, unavailable]
    assert caller.get_hull_mesh("a").vertices.tolist() == [[0, 0, 0], [1, 1, 1]]
    assert len(fake.calls) == 2


def test_every_call_carries_the_token(connect: Any, fake: FakeHulld) -> None:
    client = connect(fake.address, token="secret", retry=QUICK)
    client.get_status()
    client.get_hull_mesh("a")
    client.append_points("a", np.zeros((1, 3)), create=True)
    assert [m.get("authorization") for m in fake.metadata] == ["Bearer secret"] * 3
    assert "secret" not in repr(client)


# --- Appends ---


def test_a_lost_connection_applies_each_chunk_once(caller: Any, fake: FakeHulld) -> None:
    lost: list[int] = []

    def lose(at: list[int]) -> Callable[[int, Any], None]:
        def fail(sequence: int, context: Any) -> None:
            if sequence in at and sequence not in lost:
                lost.append(sequence)
                unavailable(context)

        return fail

    # Some are lost before they are applied, some afterwards with their acknowledgement.
    fake.before, fake.after = lose([3, 8]), lose([5, 12])
    points = np.arange(3 * 200, dtype=float).reshape(-1, 3)
    done = caller.append_points("a", points, create=True, chunk_bytes=24 * 10)
    assert sorted(lost) == [3, 5, 8, 12]
    assert fake.chunks == {sequence: 10 for sequence in range(1, 21)}
    assert done.points_acknowledged == 200 and done.chunks == 20
    # Chunks sent behind a lost one may be applied, too, before the stream ends.
    assert done.reconnects == len(fake.calls) - 1 > 0
    assert done.counts.received + 10 * done.chunks_recovered == 200


@pytest.mark.parametrize("change", ["store_id", "create_revision", "missing"])
def test_an_append_never_continues_on_a_new_hull(caller: Any, fake: FakeHulld, change: str) -> None:
    def replace(sequence: int, context: Any) -> None:
        if sequence == 2:
            setattr(
                fake, change, {"store_id": "other", "create_revision": 2, "missing": True}[change]
            )
            unavailable(context)

    fake.before = replace
    with caller.open_append("a", create=True) as appender:
        appender.append(np.zeros((1, 3)))
        with pytest.raises(hulld.FailedPreconditionError, match="append all points again"):
            appender.append(np.zeros((2, 3)))
            appender.finish()
        with pytest.raises(hulld.FailedPreconditionError):
            appender.append(np.zeros((1, 3)))


def test_an_append_without_progress_gives_up(caller: Any, fake: FakeHulld) -> None:
    fake.before = lambda sequence, context: unavailable(context)
    with pytest.raises(hulld.UnavailableError):
        caller.append_points("a", np.zeros((1, 3)), create=True)
    assert len(fake.calls) == QUICK.max_attempts and fake.chunks == {}


def test_a_refused_append_is_not_retried(caller: Any, fake: FakeHulld) -> None:
    fake.before = lambda sequence, context: full(context)
    with pytest.raises(hulld.ResourceExhaustedError):
        caller.append_points("a", np.zeros((1, 3)), create=True)
    assert len(fake.calls) == 1


def test_opening_an_append_is_retried(caller: Any, fake: FakeHulld) -> None:
    fake.script = [unavailable, busy]
    assert caller.append_points("a", np.zeros((4, 3)), create=True).points_acknowledged == 4
    assert len(fake.calls) == 3


def test_a_silent_server_is_a_timeout(connect: Any, fake: FakeHulld) -> None:
    release = threading.Event()
    fake.before = lambda sequence, context: release.wait(60) and None
    client = connect(fake.address, timeout=0.2, retry=QUICK)
    try:
        with pytest.raises(hulld.DeadlineExceededError, match="acknowledged no chunk for 0.2 s"):
            client.append_points("a", np.zeros((1, 3)), create=True)
    finally:
        release.set()


def test_a_server_that_stops_reading_is_a_timeout(connect: Any, fake: FakeHulld) -> None:
    release = threading.Event()
    gave_up: list[int] = []

    # More chunks are on their way behind the first than there is room for.
    def read_no_further(sequence: int, context: Any) -> None:
        if not release.wait(20):
            gave_up.append(sequence)

    fake.before = read_no_further
    client = connect(fake.address, timeout=0.2, retry=QUICK)
    try:
        with pytest.raises(hulld.DeadlineExceededError, match="no chunk for 0.2 s"):
            client.append_points("a", np.zeros((1 << 18, 3)), create=True)
        assert not gave_up
    finally:
        release.set()


def test_a_task_that_is_cancelled_while_writing_ends(fake: FakeHulld) -> None:
    release = threading.Event()
    fake.before = lambda sequence, context: release.wait(60) and None

    async def cancel_a_write() -> None:
        async with hulld.AsyncClient(fake.address, retry=QUICK) as client:
            appender = client.open_append("a", create=True)
            writing = asyncio.create_task(appender.append(np.zeros((1 << 18, 3))))
            while appender.totals.chunks < 2:
                await asyncio.sleep(0)
            writing.cancel()
            with pytest.raises(asyncio.CancelledError):
                await writing

    try:
        asyncio.run(cancel_a_write())
    finally:
        release.set()


def test_a_writer_continues_its_sequence(caller: Any, fake: FakeHulld) -> None:
    fake.chunks = {1: 5, 2: 5}
    caller.append_points("a", np.zeros((7, 3)), writer_id="lab")
    assert fake.chunks == {1: 5, 2: 5, 3: 7}


# --- Watches ---


def test_a_watch_resumes_where_it_was(caller: Any, fake: FakeHulld) -> None:
    with caller.watch_hulls() as watch:
        seen = [next(watch).header.revision for _ in range(3)]
    assert seen == [10, 20, 30]
    assert fake.calls[:3] == ["WatchHulls after 0", "WatchHulls after 10", "WatchHulls after 20"]


def test_a_refused_watch_raises_the_reason(caller: Any, fake: FakeHulld) -> None:
    fake.script = [full]
    with pytest.raises(hulld.ResourceExhaustedError, match="too many hulls"):
        next(iter(caller.watch_hulls()))
    assert len(fake.calls) == 1


class LostAfterAnHour(grpc.RpcError):
    """The end of a quiet watch."""

    def code(self) -> grpc.StatusCode:
        return grpc.StatusCode.UNAVAILABLE

    def details(self) -> str:
        return "the connection is lost"

    def trailing_metadata(self) -> None:
        return None


def test_a_watch_resumes_after_a_long_quiet_time(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    passing = types.SimpleNamespace(monotonic=lambda: clock[0])
    monkeypatch.setattr("hulld.calls.attempts.time", passing)
    monkeypatch.setattr("hulld.watches.pause", lambda event, seconds: None)
    revisions = iter((10, 20, 30))

    class Quiet:
        """Sends one message, and loses the connection an hour later."""

        def __init__(self, call: Any) -> None:
            self.was_notified = False

        def __next__(self) -> bytes:
            if self.was_notified:
                clock[0] += 3600
                raise LostAfterAnHour
            self.was_notified = True
            message = hull_pb2.WatchHullsResponse(synced=True)
            message.header.revision = next(revisions)
            return bytes(message.SerializeToString())

        def cancel(self) -> None:
            pass

    def begin(after: Any) -> Any:
        return watch_hulls("", None, False, after)

    watch = hulld.HullWatch(Quiet, begin, None, QUICK, 20)
    assert [next(watch).header.revision for _ in range(3)] == [10, 20, 30]


class Lost:
    """A stream of answers that is lost before the first one."""

    def __init__(self, call: Any) -> None:
        pass

    def __next__(self) -> bytes:
        raise LostAfterAnHour

    async def read(self) -> bytes:
        raise LostAfterAnHour

    def cancel(self) -> None:
        pass


@pytest.mark.parametrize("is_async", [False, True])
def test_cancelling_a_watch_ends_its_wait_for_a_retry(
    monkeypatch: pytest.MonkeyPatch, is_async: bool
) -> None:
    slow = hulld.RetryPolicy(initial_backoff=3600, max_backoff=3600)
    kind: Any = hulld.aio.AsyncHullWatch if is_async else hulld.HullWatch
    watch = kind(Lost, lambda after: watch_hulls("", None, False, after), None, slow, None)

    def pause_and_cancel(event: threading.Event, seconds: float) -> None:
        threading.Thread(target=watch.cancel).start()
        sync_transport.pause(event, seconds)

    async def pause_and_cancel_async(event: asyncio.Event, seconds: float) -> None:
        asyncio.get_running_loop().call_soon(watch.cancel)
        await transport.pause(event, seconds)

    async def messages() -> list[Any]:
        return [changes async for changes in watch]

    monkeypatch.setattr("hulld.watches.pause", pause_and_cancel)
    monkeypatch.setattr("hulld.aio.watches.pause", pause_and_cancel_async)
    assert (asyncio.run(messages()) if is_async else list(watch)) == []


def test_a_watch_that_cannot_read_an_answer_ends_its_call() -> None:
    cancelled = threading.Event()

    class Garbled:
        """Sends malformed messages until it is cancelled."""

        def __init__(self, requests: Any, metadata: Any) -> None:
            pass

        def __iter__(self) -> Iterator[bytes]:
            while not cancelled.is_set():
                yield b"\xff"

        def cancel(self) -> None:
            cancelled.set()

    watched = WatchedPlacements(
        hulld.Placements.of(["a", "b"]), None, SceneFilter(None, False, None, None), None
    )
    watch = hulld.CollisionWatch(Garbled, (), watched, QUICK, 20)
    with pytest.raises(hulld.InternalError, match="cannot be read"):
        next(watch)
    assert cancelled.is_set()


def test_a_task_cancelled_just_after_its_call_ended_is_cancelled() -> None:
    class EndedCall:
        async def read(self) -> bytes:
            try:
                await asyncio.Event().wait()
            except asyncio.CancelledError:
                pass
            # As grpc 1.51, which then reads a variable that it has not set.
            raise UnboundLocalError("raw_response")

    async def cancel_a_read() -> None:
        reading = asyncio.create_task(transport.read(EndedCall()))
        await asyncio.sleep(0)
        reading.cancel()
        with pytest.raises(asyncio.CancelledError):
            await reading
        assert reading.cancelled()

    asyncio.run(cancel_a_read())


# --- Errors ---


def test_an_error_has_the_class_of_its_status() -> None:
    for code in grpc.StatusCode:
        error = from_status(code.name, "why", None)
        assert error.code == code.name and isinstance(error, hulld.HulldError)
    assert isinstance(from_status("NOT_FOUND", "", None), LookupError)
    assert isinstance(from_status("INVALID_ARGUMENT", "", None), ValueError)


def test_foreign_and_malformed_details_are_ignored() -> None:
    assert from_status("UNAVAILABLE", "", [("grpc-status-details-bin", b"\xff\xff")]).reason is None
    for hint, seconds in (("1500", 1.5), ("-1", None), ("soon", None)):
        error = from_status("RESOURCE_EXHAUSTED", "", [("grpc-retry-pushback-ms", hint)])
        assert error.retry_after == seconds and may_retry(error) == (seconds is not None)


def test_errors_can_be_pickled() -> None:
    error = hulld.NotFoundError(
        "no", reason="HULL_NOT_FOUND", metadata={"hull_id": "a"}, request_id="7"
    )
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is hulld.NotFoundError and str(again) == str(error)
    assert again.metadata == {"hull_id": "a"}


def test_waits_double_and_respect_the_hint_of_the_server() -> None:
    policy = hulld.RetryPolicy(max_attempts=9, initial_backoff=0.1, max_backoff=0.5)
    error = hulld.UnavailableError("")
    waits = [policy.wait_after(n, error, None) for n in range(1, 6)]
    assert waits == [0.1, 0.2, 0.4, 0.5, 0.5]
    assert policy.wait_after(9, error, None) is None
    assert policy.wait_after(1, error, 0.05) is None
    assert policy.wait_after(1, hulld.ResourceExhaustedError("", retry_after=2), 9) == 2
    assert policy.wait_after(1, hulld.AbortedError(""), None) is None
