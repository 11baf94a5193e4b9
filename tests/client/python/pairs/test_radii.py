"""Placements and pieces with a radius."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import hulld
from conftest import CUBE


@pytest.fixture
def cube(client: hulld.Client, name: str) -> str:
    client.append_points(f"{name}/cube", CUBE, create=True)
    return f"{name}/cube"


def ball(radius: float, *center: float) -> hulld.Placement:
    return hulld.Placement(points=[[0, 0, 0]], pose=center, radius=radius)


@pytest.mark.parametrize(
    ("radius", "relation"),
    [
        (np.nextafter(3, 0), hulld.Relation.SEPARATED),
        (3.0, hulld.Relation.TOUCHING),
        (np.nextafter(3, 4), hulld.Relation.OVERLAPPING),
    ],
)
def test_the_last_bit_decides_and_is_proven(
    client: hulld.Client, radius: float, relation: hulld.Relation
) -> None:
    a, b = ball(2, 0, 0, 0), ball(radius, 3, 4, 0)
    answer = client.check_collision(a, b, certificate=True, separation=True)
    assert answer.relation is relation
    verifier = hulld.Verifier(client)
    verifier.check(a, b, answer)
    for other in set(hulld.Relation) - {relation}:
        with pytest.raises(hulld.VerificationError):
            verifier.check(a, b, dataclasses.replace(answer, relation=other))


def test_boxes_and_capsules_are_proven(client: hulld.Client, cube: str) -> None:
    placements = hulld.Placements(
        [cube],
        [(0, 0, 0), (2.0, 0, 0), (1, 4, 0.5), (0.5, 0.5, 0.5)],
        [0, 0, 1, 1],
        shapes=[[[0, 0, -1], [0, 0, 2]]],
        radii=[0.25, 0.5, 2.75, 0.125],
    )
    found = client.check_collisions(placements, certificate=True)
    verifier = hulld.Verifier(client)
    for row in range(len(found.pairs)):
        verifier.check_row(placements, found, row)
    relations = dict(zip(map(tuple, found.pairs.tolist()), found.answers.relations.tolist()))
    assert relations[0, 1] == hulld.Relation.SEPARATED
    assert relations[0, 2] == hulld.Relation.TOUCHING
    assert relations[0, 3] == hulld.Relation.OVERLAPPING


def test_bodies_keep_the_radii_of_their_pieces(
    client: hulld.Client, name: str, cube: str
) -> None:
    body = f"{name}/row"
    client.put_body(body, [cube, hulld.Placement(cube, (4, 0, 0), radius=0.25)])
    assert [piece.radius for piece in client.get_body(body).pieces] == [0, 0.25]
    a = hulld.Placement(body, radius=0.5)
    verifier = hulld.Verifier(client)
    for x, relation in ((6.0, "TOUCHING"), (6.25, "SEPARATED"), (5.75, "OVERLAPPING")):
        answer = client.check_collision(a, ball(0.25, x, 0.5, 0.5), certificate=True)
        assert answer.relation.name == relation
        verifier.check(a, ball(0.25, x, 0.5, 0.5), answer)


def test_scenes_streams_and_watches_take_them(client: hulld.Client) -> None:
    placements = [ball(1, 0, 0, 0), ball(1, 2, 0, 0), ball(0.5, 9, 0, 0)]
    assert client.find_collisions(placements).pairs.tolist() == [[0, 1]]
    with client.stream_collisions(placements, [(0, 2)]) as stream:
        moved = stream.update([2], [(1.5, 0, 0)])
        assert moved.answers.relations.tolist() == [hulld.Relation.TOUCHING]


def test_check_takes_radii() -> None:
    answer = hulld.check([[0, 0, 0]], [[3, 4, 0]], radius_a=1, radius_b=2, separation=True)
    assert answer.separation is not None
    assert answer.separation.value == pytest.approx(2, abs=answer.separation.bound)


@pytest.mark.parametrize("radius", [-1, np.nan, np.inf, "1"])
def test_malformed_radii_are_refused(radius: float) -> None:
    with pytest.raises((ValueError, TypeError), match="radius"):
        hulld.Placement("cube", radius=radius)
    with pytest.raises((ValueError, TypeError), match="radii"):
        hulld.Placements("cube", [(0, 0, 0)], radii=[radius])
    with pytest.raises(ValueError, match="one number for each of 1"):
        hulld.Placements("cube", [(0, 0, 0)], radii=[1, 2])
