"""Writes and reads the fields of a protobuf message as numpy arrays.

python-protobuf converts arrays number by number, at about 50 ns each. A packed field is a tag, a
length, and the bytes of the array, so this module writes and reads these bytes directly from
numpy's buffer. Small messages are left to protobuf; a serialized message can be embedded in a
MessageWriter, and the other way round.

Source: Protocol Buffers, "Encoding". A test compares both directions with protobuf's own encoding.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any, Union

import numpy as np
import numpy.typing as npt
from google.protobuf.descriptor import FieldDescriptor

VARINT, FIXED64, LENGTH, FIXED32 = 0, 1, 2, 5

Value = Union[int, memoryview]
Unsigned = npt.NDArray[np.unsignedinteger[Any]]


class WireError(ValueError):
    """The bytes are not a protobuf message."""


def encode_varint(value: int) -> bytes:
    """Encodes a number, 0 <= value < 2^64, in groups of seven bits, the lowest first."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def encode_varints(values: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint8]:
    """The concatenated varints of all values, in the canonical encoding that protobuf writes. Cost:
    a few ns each."""
    flat = np.ascontiguousarray(values, np.uint32).reshape(-1)
    size = max(1, -(-int(flat.max(initial=0)).bit_length() // 7))
    if size == 1:
        return flat.astype(np.uint8)
    # All groups of all numbers; then unneeded groups are dropped.
    groups = np.empty((flat.size, size), np.uint8)
    kept = np.ones((flat.size, size), np.bool_)
    for group in range(size):
        groups[:, group] = (flat >> np.uint32(7 * group)) & np.uint32(0x7F)
        if group > 0:
            kept[:, group] = flat >= np.uint32(1 << 7 * group)
            groups[:, group - 1] |= kept[:, group].view(np.uint8) << np.uint8(7)
    needed: npt.NDArray[np.uint8] = groups[kept]
    return needed


class MessageWriter:
    """Assembles a message from its fields, in the order of the calls. Empty arrays are omitted, as
    in proto3."""

    def __init__(self) -> None:
        self._parts: list[bytes | memoryview] = []
        self.size = 0

    def _put(self, part: bytes | memoryview) -> None:
        self._parts.append(part)
        self.size += len(part)

    def raw(self, serialized: bytes) -> MessageWriter:
        """Adds fields that are already encoded, for example by SerializeToString."""
        self._put(serialized)
        return self

    def _packed(self, number: int, data: npt.NDArray[Any]) -> MessageWriter:
        if data.size:
            flat = data.reshape(-1).view(np.uint8)
            self._put(encode_varint(number << 3 | LENGTH) + encode_varint(flat.size))
            self._put(flat.data)
        return self

    def doubles(self, number: int, values: npt.ArrayLike) -> MessageWriter:
        """A packed `repeated double`. The bytes are those of the array: no double is changed."""
        return self._packed(number, np.ascontiguousarray(values, "<f8"))

    def floats(self, number: int, values: npt.ArrayLike) -> MessageWriter:
        """A packed `repeated float`."""
        return self._packed(number, np.ascontiguousarray(values, "<f4"))

    def uint32s(self, number: int, values: npt.NDArray[np.uint32]) -> MessageWriter:
        """A packed `repeated uint32`."""
        return self._packed(number, encode_varints(values))

    def strings(self, number: int, values: list[str]) -> MessageWriter:
        """A `repeated string`."""
        for value in values:
            data = value.encode()
            self._put(encode_varint(number << 3 | LENGTH) + encode_varint(len(data)) + data)
        return self

    def message(self, number: int, message: MessageWriter | bytes) -> MessageWriter:
        """A message as a field."""
        parts = message._parts if isinstance(message, MessageWriter) else [message]
        size = message.size if isinstance(message, MessageWriter) else len(message)
        self._put(encode_varint(number << 3 | LENGTH) + encode_varint(size))
        for part in parts:
            self._put(part)
        return self

    def finish(self) -> bytes:
        """The message. Copies each array once."""
        return b"".join(self._parts)


def _read_varint(data: memoryview, at: int) -> tuple[int, int]:
    value = shift = 0
    while shift < 70 and at < len(data):
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value & 0xFFFFFFFFFFFFFFFF, at
        shift += 7
    raise WireError("a varint is truncated")


def read_fields(data: bytes | memoryview) -> Iterator[tuple[int, int, Value]]:
    """Yields the number, wire type, and value of each field, in order. A value with a length is a
    view of `data`.

    WireError: the bytes are truncated, or are not a message.
    """
    view = memoryview(data)
    at = 0
    while at < len(view):
        key, at = _read_varint(view, at)
        number, wire_type = key >> 3, key & 7
        if wire_type == VARINT:
            value, at = _read_varint(view, at)
            yield number, wire_type, value
            continue
        if wire_type == LENGTH:
            size, at = _read_varint(view, at)
        elif wire_type == FIXED64:
            size = 8
        elif wire_type == FIXED32:
            size = 4
        else:
            raise WireError(
                f"field {number} has the wire type {wire_type}, which proto3 does not use"
            )
        if number == 0:
            raise WireError("a field has the number 0")
        if at + size > len(view):
            raise WireError(
                f"field {number} is cut off: {size} bytes were declared, {len(view) - at} are left"
            )
        yield number, wire_type, view[at : at + size]
        at += size


@functools.cache
def _fields_of(kind: Any) -> dict[int, tuple[str, Callable[[Value], npt.NDArray[Any]] | None]]:
    """The fields of a message by number: the name, and the reader of numbers."""
    readers = {
        FieldDescriptor.CPPTYPE_DOUBLE: packed_doubles,
        FieldDescriptor.CPPTYPE_MESSAGE: None,
        FieldDescriptor.CPPTYPE_STRING: None,
    }
    return {
        field.number: (field.name, readers.get(field.cpp_type, packed_varints))
        for field in kind.DESCRIPTOR.fields
    }


def named_fields(kind: Any, data: bytes | memoryview) -> Iterator[tuple[str, Any]]:
    """As read_fields, with the name of each field in the message `kind` (a generated class).
    Unknown fields are skipped."""
    known = _fields_of(kind)
    for number, _, value in read_fields(data):
        if number in known:
            name, read = known[number]
            if read is None and isinstance(value, int):
                raise WireError(f"the field {name} is a number, not a message")
            yield name, value


def named_arrays(kind: Any, data: bytes | memoryview) -> Iterator[tuple[str, Any]]:
    """As named_fields; numbers are arrays."""
    readers = dict(_fields_of(kind).values())
    for name, value in named_fields(kind, data):
        read = readers[name]
        yield name, value if read is None else read(value)


def packed_doubles(value: Value) -> npt.NDArray[np.float64]:
    """The numbers of a `repeated double` field, packed or a single entry: a view, not a copy."""
    if isinstance(value, int) or len(value) % 8:
        raise WireError("a field of doubles has the wrong type or length")
    return np.frombuffer(value, "<f8")


def packed_varints(value: Value) -> Unsigned:
    """The numbers of a field of repeated integers, enums, or bools, packed or a single entry: as
    uint8, and without a copy, if all are below 128, else as uint64. Cost: a few ns each."""
    if isinstance(value, int):
        return np.array([value], np.uint64)
    data = np.frombuffer(value, np.uint8)
    last = data < 0x80
    if last.all():
        return data
    if not last[-1]:
        raise WireError("the last varint of a field is truncated")
    ends = np.flatnonzero(last)
    starts = np.empty_like(ends)
    starts[0] = 0
    starts[1:] = ends[:-1] + 1
    sizes = ends - starts + 1
    longest = int(sizes.max())
    if longest > 10:
        raise WireError("a varint is longer than ten bytes")
    # Byte by byte of all numbers together: most are short, so few remain for later passes.
    out: npt.NDArray[np.uint64] = (data[starts] & np.uint8(0x7F)).astype(np.uint64)
    which = np.arange(out.size)
    for byte in range(1, longest):
        which = which[sizes[which] > byte]
        out[which] |= (data[starts[which] + byte] & np.uint8(0x7F)).astype(np.uint64) << np.uint64(
            7 * byte
        )
    return out
