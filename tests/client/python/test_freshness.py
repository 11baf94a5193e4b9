"""Freshness of reads: its encoding, and its effect on one server."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
from conftest import CUBE

import hulld
from hulld.calls import requests
from hulld.calls.freshness import FIELD
from hulld.calls.wanted import Wanted
from hulld.geometry.placements import Placements, all_pairs
from hulld.v1 import body_pb2, collision_pb2, hull_pb2

BOTH = hulld.Freshness(at_least=hulld.Header("store", 7), max_staleness=1.25)


def test_the_field_has_one_number() -> None:
    holders = [
        message
        for module in (hull_pb2, body_pb2, collision_pb2)
        for message in module.DESCRIPTOR.message_types_by_name.values()
        if "freshness" in message.fields_by_name
    ]
    assert len(holders) == 9
    assert {message.fields_by_name["freshness"].number for message in holders} == {FIELD}


def test_it_is_what_protobuf_reads() -> None:
    call = requests.as_fresh(requests.get_body("b"), BOTH)
    request = body_pb2.GetBodyRequest.FromString(call.request)
    assert request.body_id == "b"
    assert request.freshness.at_least_revision == 7
    assert request.freshness.store_id == "store"
    assert request.freshness.max_staleness.ToNanoseconds() == 1_250_000_000
    assert requests.as_fresh(call, None) is call
    placements = Placements.of(["a", "b"])
    opening = requests.open_stream(placements, all_pairs(2), Wanted(), 0.0, True, BOTH)
    opened = collision_pb2.StreamCollisionsRequest.FromString(opening).open
    assert opened.freshness == BOTH.message() and opened.only_changes


@pytest.mark.parametrize("bound", [-1.0, float("nan"), float("inf")])
def test_a_bound_is_a_number_of_seconds(bound: float) -> None:
    with pytest.raises(ValueError, match="max_staleness"):
        hulld.Freshness(max_staleness=bound)


def test_the_next_page_never_goes_back() -> None:
    header = hulld.Header("store", 9)
    assert hulld.Freshness().for_next_page(header) == hulld.Freshness()
    assert BOTH.for_next_page(header) == dataclasses.replace(BOTH, at_least=header)


def test_every_read_takes_it(either: Any) -> None:
    client = either
    client.append_points("fresh/cube", CUBE, create=True)
    client.put_body("fresh/body", ["fresh/cube"])
    seen = client.get_hull("fresh/cube").header
    assert seen.staleness == 0.0
    fresh = hulld.Freshness(at_least=seen, max_staleness=0.2)
    future = hulld.Freshness(at_least=dataclasses.replace(seen, revision=seen.revision + 1_000_000))
    pair = ["fresh/cube", "fresh/body"]
    for read in (
        lambda f: client.get_hull("fresh/cube", freshness=f),
        lambda f: client.get_hull_mesh("fresh/cube", freshness=f),
        lambda f: list(client.list_hulls("fresh/", page_size=1, freshness=f)),
        lambda f: client.get_body("fresh/body", freshness=f),
        lambda f: list(client.list_bodies("fresh/", page_size=1, freshness=f)),
        lambda f: client.check_collision(*pair, freshness=f),
        lambda f: client.check_collisions(pair, freshness=f),
        lambda f: client.find_collisions(pair, freshness=f),
    ):
        read(fresh)
        with pytest.raises(hulld.FailedPreconditionError) as refused:
            read(future)
        assert refused.value.reason == "FUTURE_REVISION"
        assert refused.value.metadata["at_least_revision"] == str(seen.revision + 1_000_000)
    other = hulld.Freshness(at_least=hulld.Header("another", 1))
    with pytest.raises(hulld.FailedPreconditionError) as refused:
        client.get_hull("fresh/cube", freshness=other)
    assert refused.value.reason == "OTHER_STORE"
    assert refused.value.metadata["store_id"] == seen.store_id


def test_a_stream_takes_it(client: hulld.Client) -> None:
    client.append_points("fresh/cube", CUBE, create=True)
    seen = client.get_hull("fresh/cube").header
    fresh = hulld.Freshness(at_least=seen)
    with client.stream_collisions(["fresh/cube"] * 2, freshness=fresh) as stream:
        assert stream.opened.answers.relations[0] == hulld.Relation.OVERLAPPING
    future = hulld.Freshness(at_least=dataclasses.replace(seen, revision=seen.revision + 1_000_000))
    with pytest.raises(hulld.FailedPreconditionError):
        client.stream_collisions(["fresh/cube"] * 2, freshness=future)
