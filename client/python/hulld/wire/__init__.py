"""Protobuf's wire format for large fields: numpy's buffers, unchanged."""

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
