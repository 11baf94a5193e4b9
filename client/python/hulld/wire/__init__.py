"""Protobuf's wire format for what is large: numpy's buffers as they are, no element touched by
Python."""

from hulld.wire.fields import (
    MessageWriter,
    Unsigned,
    WireError,
    packed_doubles,
    packed_floats,
    packed_varints,
    read_fields,
)

__all__ = [
    "MessageWriter",
    "Unsigned",
    "WireError",
    "packed_doubles",
    "packed_floats",
    "packed_varints",
    "read_fields",
]
