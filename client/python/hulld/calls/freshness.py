"""How fresh the answer to a read must be."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from hulld.v1 import freshness_pb2

if TYPE_CHECKING:
    from hulld.answers.hulls import Header

#: The number of the field `freshness`, which is the same in all requests.
FIELD = 15


@dataclass(frozen=True)
class Freshness:
    """How fresh the answer to a read must be, where several servers serve one store; as
    proto/hulld/v1/freshness.proto says. Both conditions hold where both are given; without any, and
    without a Freshness, the answer holds everything that was acknowledged before the call.

    at_least: the header of an earlier answer; the answer is of its revision of the store or a later
    one. With that of its last answer a client sees its own changes and never goes back in time,
    whichever server answers. max_staleness: in seconds; the answer holds everything that was
    committed that long before the call, and costs no question to the store while a server knows as
    much. The answer's header.staleness says how stale it may be.
    """

    at_least: Header | None = None
    max_staleness: float | None = None

    def __post_init__(self) -> None:
        bound = self.max_staleness
        if bound is not None and not (bound >= 0 and math.isfinite(bound)):
            raise ValueError(f"max_staleness is {bound!r}; it is a number of seconds, at least 0")

    def message(self) -> Any:
        """As the contract's Freshness."""
        message = freshness_pb2.Freshness()
        if self.at_least is not None:
            message.at_least_revision = self.at_least.revision
            message.store_id = self.at_least.store_id
            for store_id, revision in self.at_least.shards:
                message.at_least.add(store_id=store_id, revision=revision)
        if self.max_staleness is not None:
            # Never more than was said.
            message.max_staleness.FromNanoseconds(math.floor(self.max_staleness * 1e9))
        return message

    def for_next_page(self, header: Header) -> Freshness:
        """For the page after one with this header: what is on no page yet must not be missing."""
        if self.max_staleness is None and self.at_least is None:
            return self
        return replace(self, at_least=header)
