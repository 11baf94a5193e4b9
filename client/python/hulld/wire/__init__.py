"""Protobuf's wire format for large fields: numpy's buffers, unchanged."""

from hulld.wire.fields import (
    MessageWriter,
    Unsigned,
    WireError,
    named_arrays,
    named_fields,
    packed_doubles,
    packed_varints,
    read_fields,
)

__all__ = [
    "MessageWriter",
    "Unsigned",
    "WireError",
    "named_arrays",
    "named_fields",
    "packed_doubles",
    "packed_varints",
    "read_fields",
]
