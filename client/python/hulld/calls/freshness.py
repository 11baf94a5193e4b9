"""The freshness of reads."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from hulld import arguments
from hulld.v1 import freshness_pb2

if TYPE_CHECKING:
    from hulld.answers.hulls import Header

#: The number of the field `freshness`, the same in all requests.
FIELD = 15


@dataclass(frozen=True)
class Freshness:
    """The required freshness of a read when several servers share a store, as in
    proto/hulld/v1/freshness.proto. If both conditions are given, both must hold. If neither is
    given, or without a Freshness, the answer includes everything acknowledged before the call.

    at_least: the header of an earlier answer; the new answer comes from that revision of the store
    or a later one. A client that passes the header of its last answer sees its own changes and
    never sees an older state than before, whichever server answers. max_staleness: in seconds; the
    answer includes everything committed at least that long before the call, and needs no round trip
    to the store while the server is that fresh. The answer's header.staleness bounds its age.
    """

    at_least: Header | None = None
    max_staleness: float | None = None

    def __post_init__(self) -> None:
        arguments.seconds(self.max_staleness, "max_staleness")
        if self.at_least is not None:
            arguments.header(self.at_least, "at_least")

    def message(self) -> Any:
        """The contract's Freshness."""
        message = freshness_pb2.Freshness()
        if self.at_least is not None:
            message.at_least_revision = self.at_least.revision
            message.store_id = self.at_least.store_id
        if self.max_staleness is not None:
            # Rounded toward fresher.
            message.max_staleness.FromNanoseconds(math.floor(self.max_staleness * 1e9))
        return message

    def for_next_page(self, header: Header) -> Freshness:
        """The freshness for the page that follows one with this header: at least as fresh."""
        if self.max_staleness is None and self.at_least is None:
            return self
        return replace(self, at_least=header)
