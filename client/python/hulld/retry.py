"""When a call that is safe to repeat is repeated."""

from __future__ import annotations

from dataclasses import dataclass

from hulld.errors import HulldError, ResourceExhaustedError, UnavailableError


@dataclass(frozen=True)
class RetryPolicy:
    """Calls that are safe to repeat are repeated after UNAVAILABLE, which says that the server was
    not reached or is draining, and when it is overloaded and says when to come again. Waits double
    from initial_backoff to max_backoff, in seconds, and are at least as long as the server asks.
    All attempts together stay within the call's timeout.
    """

    #: In all; 1 turns retries off.
    max_attempts: int = 4
    initial_backoff: float = 0.1
    max_backoff: float = 2.0

    def wait_after(
        self,
        failures: int,
        error: HulldError,
        remaining: float | None,
        max_attempts: float | None = None,
    ) -> float | None:
        """The seconds to wait after `failures` >= 1 failed attempts, the last of which ended with
        `error`; None: give up, as it may not be repeated, the attempts are used up, or the wait
        would pass the deadline, `remaining` seconds away.
        """
        if not may_retry(error) or failures >= (
            self.max_attempts if max_attempts is None else max_attempts
        ):
            return None
        backoff = min(self.initial_backoff * 2.0 ** min(failures - 1, 60), self.max_backoff)
        wait = max(backoff, error.retry_after or 0.0)
        return None if remaining is not None and wait >= remaining else wait


def may_retry(error: HulldError) -> bool:
    """Whether a call that ended so may be repeated, if it is safe to repeat."""
    return isinstance(error, UnavailableError) or (
        isinstance(error, ResourceExhaustedError) and error.retry_after is not None
    )
