"""Retries of calls that are safe to repeat."""

from __future__ import annotations

from dataclasses import dataclass

from hulld import arguments
from hulld.errors import HulldError, ResourceExhaustedError, UnavailableError


@dataclass(frozen=True)
class RetryPolicy:
    """Calls that are safe to repeat are retried after UNAVAILABLE (the server is unreachable or
    draining), and if the server is overloaded and sends a retry hint. Retries continue until the
    timeout, so that a call outlives a server restart. The backoff doubles from initial_backoff to
    max_backoff, in seconds, and is at least the server's hint.
    """

    #: Total attempts; 1 disables retries; with None, only the timeout applies.
    max_attempts: int | None = None
    initial_backoff: float = 0.1
    max_backoff: float = 2.0

    def __post_init__(self) -> None:
        if self.max_attempts is not None:
            arguments.count(self.max_attempts, "max_attempts", minimum=1)
        for name in ("initial_backoff", "max_backoff"):
            arguments.seconds(arguments.number(getattr(self, name), name), name)

    def wait_after(self, failures: int, error: HulldError, remaining: float | None) -> float | None:
        """The seconds to wait after `failures` >= 1 failed attempts, the last of which ended with
        `error`; None: give up, because the error does not permit a retry, the attempts are
        exhausted, or the wait would pass the deadline, `remaining` seconds away.
        """
        if not may_retry(error):
            return None
        if self.max_attempts is not None and failures >= self.max_attempts:
            return None
        backoff = min(self.initial_backoff * 2.0 ** min(failures - 1, 60), self.max_backoff)
        wait = max(backoff, error.retry_after or 0.0)
        return None if remaining is not None and wait >= remaining else wait


def may_retry(error: HulldError) -> bool:
    """True if a call that is safe to repeat may be retried after `error`."""
    return isinstance(error, UnavailableError) or (
        isinstance(error, ResourceExhaustedError) and error.retry_after is not None
    )
