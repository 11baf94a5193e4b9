"""Answers about bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hulld.answers.hulls import Durability, Header, enum_or_zero, header_of
from hulld.geometry.placements import Placements
from hulld.v1 import body_pb2


@dataclass(frozen=True)
class BodyInfo:
    """A body without its pieces.

    revision: of the last put_body. create_revision: distinguishes incarnations of an ID. damaged:
    the stored body is damaged; calls that need it raise DataLossError, other fields may be missing,
    and put_body and delete_body repair it.
    """

    body_id: str
    create_revision: int
    revision: int
    piece_count: int
    damaged: bool = False


@dataclass(frozen=True)
class Body:
    """pieces: in the order of put_body; each is a hull with a radius, at a pose in the frame of the
    body, with the doubles that were put."""

    info: BodyInfo
    pieces: Placements
    header: Header


@dataclass(frozen=True)
class ReplacedBody:
    """created: True if the body did not exist before."""

    body: BodyInfo
    created: bool
    durability: Durability
    header: Header


def info_of(message: Any) -> BodyInfo:
    return BodyInfo(
        message.body_id,
        message.create_revision,
        message.revision,
        message.piece_count,
        message.damaged,
    )


def decode_replaced(data: bytes) -> ReplacedBody:
    message = body_pb2.PutBodyResponse.FromString(data)
    return ReplacedBody(
        info_of(message.body),
        message.created,
        enum_or_zero(Durability, message.durability),
        header_of(message.header),
    )


def decode_body(data: bytes) -> Body:
    message = body_pb2.GetBodyResponse.FromString(data)
    places: dict[str, int] = {}
    indices = np.empty(len(message.pieces), np.uint32)
    poses = np.zeros((len(message.pieces), 7))
    radii = np.zeros(len(message.pieces))
    for row, piece in enumerate(message.pieces):
        indices[row] = places.setdefault(piece.hull_id, len(places))
        q, t = piece.pose.rotation, piece.pose.translation
        turned = piece.pose.HasField("rotation")
        poses[row, :4] = (q.w, q.x, q.y, q.z) if turned else (1, 0, 0, 0)
        poses[row, 4:] = (t.x, t.y, t.z)
        radii[row] = piece.radius
    return Body(
        info_of(message.body),
        Placements(list(places), poses, indices, radii=radii),
        header_of(message.header),
    )


def decode_deleted(data: bytes) -> Header:
    return header_of(body_pb2.DeleteBodyResponse.FromString(data).header)
