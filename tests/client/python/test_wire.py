"""The wire format equals protobuf's, in both directions, to the last bit."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from hulld.geometry.placements import Placements
from hulld.geometry.points import as_points, point_block
from hulld.v1 import collision_pb2, geometry_pb2, hull_pb2
from hulld.wire import (
    MessageWriter,
    WireError,
    encode_varints,
    named_arrays,
    packed_doubles,
    packed_varints,
    read_fields,
)


# Each length of a varint, and both sides of each step.
STEPS = sorted(
    {max(0, min((1 << bits) + d, 2**32 - 1)) for bits in range(33) for d in (-1, 0, 1)}
)
# Doubles that a conversion would change: signed zeros, subnormals, the largest.
HARD = [0.0, -0.0, 5e-324, -2.2e-308, 1.7976931348623157e308, 0.1, 1 / 3, np.pi]


def fields_of(data: bytes) -> list[tuple[int, int, object]]:
    return [(n, t, v if isinstance(v, int) else bytes(v)) for n, t, v in read_fields(data)]


def test_integers_are_encoded_as_protobuf_does() -> None:
    values = np.array(STEPS, np.uint32)
    message = collision_pb2.CollisionStreamUpdate(placements=STEPS)
    assert MessageWriter().uint32s(1, values).finish() == message.SerializeToString()
    for value in STEPS:
        one = collision_pb2.CollisionStreamUpdate(placements=[value]).SerializeToString()
        assert MessageWriter().uint32s(1, np.array([value], np.uint32)).finish() == one


def test_integers_are_read_as_protobuf_writes_them(rng: np.random.Generator) -> None:
    for count in (0, 1, 2, 1000):
        values = (rng.integers(0, 2**32, count) >> rng.integers(0, 32, count)).astype(np.uint32)
        encoded = encode_varints(values).tobytes()
        np.testing.assert_array_equal(packed_varints(memoryview(encoded)), values)
        message = hull_pb2.MeshFacets.FromString(MessageWriter().uint32s(2, values).finish())
        assert list(message.indices) == values.tolist()


def test_points_are_what_protobuf_reads() -> None:
    points = np.array(HARD + [1.0], float).reshape(-1, 3)
    block = geometry_pb2.PointBlock.FromString(point_block(as_points(points)).finish())
    assert struct.pack("<9d", *block.xyz) == points.tobytes()
    assert (
        point_block(as_points(points)).finish()
        == geometry_pb2.PointBlock(xyz=points.reshape(-1).tolist()).SerializeToString()
    )
    floats = np.where(np.abs(points) < 3e38, points, 3e38).astype(np.float32)
    read = geometry_pb2.PointBlock.FromString(point_block(as_points(floats)).finish())
    assert struct.pack("<9f", *read.xyz_float) == floats.tobytes() and not read.xyz


def test_other_strides_and_byte_orders_give_the_same_numbers(rng: np.random.Generator) -> None:
    points = rng.normal(size=(20, 6))
    expected = point_block(as_points(np.ascontiguousarray(points[::-2, ::2]))).finish()
    assert point_block(as_points(points[::-2, ::2])).finish() == expected
    assert point_block(as_points(points[::-2, ::2].astype(">f8"))).finish() == expected


def test_placements_are_what_protobuf_reads(rng: np.random.Generator) -> None:
    poses = rng.normal(size=(300, 7))
    poses[0] = HARD[:7]
    indices = rng.integers(0, 200, 300)
    ids = [f"a/{i}" for i in range(200)]
    message = collision_pb2.PackedPlacements(
        hull_ids=ids, hulls=indices.tolist(), poses=poses.reshape(-1).tolist()
    )
    assert Placements(ids, poses, indices).packed().finish() == message.SerializeToString()


def test_nested_messages_and_empty_arrays_are_as_protobufs() -> None:
    inner = MessageWriter().doubles(1, np.empty((0, 3)))
    assert inner.finish() == b""
    request = hull_pb2.ReplaceHullRequest(points=geometry_pb2.PointBlock())
    assert MessageWriter().message(2, inner).finish() == request.SerializeToString()
    raw = geometry_pb2.PointBlock(xyz=[1, 2, 3]).SerializeToString()
    assert (
        MessageWriter().message(2, raw).finish()
        == hull_pb2.ReplaceHullRequest(
            points=geometry_pb2.PointBlock(xyz=[1, 2, 3])
        ).SerializeToString()
    )


def test_fields_of_all_wire_types_are_found() -> None:
    # field 1: varint 300; 2: fixed64; 3: two bytes; 4: fixed32
    data = b"\x08\xac\x02" + b"\x11" + bytes(8) + b"\x1a\x02hi" + b"\x25" + bytes(4)
    assert fields_of(data) == [(1, 0, 300), (2, 1, bytes(8)), (3, 2, b"hi"), (4, 5, bytes(4))]


def test_unpacked_fields_are_read_too() -> None:
    assert packed_varints(7).tolist() == [7]
    assert packed_doubles(memoryview(struct.pack("<d", 0.1))).tolist() == [0.1]


def test_arrays_have_the_names_of_the_contract() -> None:
    columns = collision_pb2.AnswerColumns(
        relations=[1, 3], separations=HARD[:2], pieces=[-1, 200], axes=[collision_pb2.Axis(kind=2)]
    )
    # A field of a later version of the contract.
    data = columns.SerializeToString() + b"\xf8\x3f\x01"
    found = {name: np.asarray(value).tolist() for name, value in named_arrays(type(columns), data)}
    assert found == {
        "relations": [1, 3],
        "separations": HARD[:2],
        "pieces": [1, 400],
        "axes": list(columns.axes[0].SerializeToString()),
    }
    with pytest.raises(WireError, match="axes is a number"):
        list(named_arrays(type(columns), b"\x18\x01"))


@pytest.mark.parametrize(
    "data", [b"\x0a\x05abc", b"\x08", b"\x08\xff", b"\x0b", b"\x02\x00", b"\x11abc"]
)
def test_truncated_and_malformed_messages_are_refused(data: bytes) -> None:
    with pytest.raises(WireError):
        list(read_fields(data))


@pytest.mark.parametrize("data", [b"\x80", b"\x01\xff", b"\xff" * 11 + b"\x01"])
def test_unterminated_varints_are_refused(data: bytes) -> None:
    with pytest.raises(WireError):
        packed_varints(memoryview(data))


def test_truncated_doubles_are_refused() -> None:
    with pytest.raises(WireError):
        packed_doubles(memoryview(b"1234567"))
