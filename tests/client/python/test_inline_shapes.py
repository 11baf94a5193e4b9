"""Placements that carry points instead of naming a hull."""

from __future__ import annotations

import numpy as np
import pytest

import hulld
from conftest import CUBE


@pytest.fixture
def cube(client: hulld.Client, name: str) -> str:
    client.append_points(f"{name}/cube", CUBE, create=True)
    return f"{name}/cube"


def test_points_answer_as_their_hull(client: hulld.Client, cube: str) -> None:
    for x in (0.5, 1.0, 1.5):
        expected = client.check_collision(cube, (cube, (x, 0, 0)), separation=True, witness=True)
        for points in (CUBE, CUBE.tolist(), CUBE.astype(np.float32)):
            found = client.check_collision(points, (points, (x, 0, 0)), separation=True)
            assert found.relation is expected.relation
            assert found.separation == expected.separation
            assert found.hull_a.hull_id == ""
        mixed = client.check_collision(hulld.Placement(points=CUBE), (cube, (x, 0, 0)))
        assert mixed.relation is expected.relation
        assert mixed.hull_b.hull_id == cube
    assert "points" in repr(mixed)


def test_one_array_is_one_shape(cube: str) -> None:
    packed = hulld.Placements.of([CUBE, cube, (CUBE, (1, 0, 0)), CUBE.copy()])
    assert packed.ids == [cube]
    assert len(packed.shapes) == 2
    assert packed.indices.tolist() == [1, 0, 1, 2]
    assert packed[1].id == cube
    assert np.array_equal(packed[2].points, CUBE)
    assert len(hulld.Placements([], np.zeros((5, 3)), shapes=[CUBE])) == 5


def test_batches_scenes_and_streams_take_points(client: hulld.Client, cube: str) -> None:
    rng = np.random.default_rng(31)
    poses = np.hstack([rng.normal(size=(20, 4)), rng.uniform(-1.5, 1.5, size=(20, 3))])
    indices = np.arange(20) % 2
    registered = hulld.Placements([cube], poses, np.zeros(20, int))
    mixed = hulld.Placements([cube], poses, indices, shapes=[CUBE])
    expected = client.check_collisions(registered)
    assert np.array_equal(client.check_collisions(mixed).answers.relations,
                          expected.answers.relations)
    assert np.array_equal(client.find_collisions(mixed).pairs,
                          client.find_collisions(registered).pairs)
    with client.stream_collisions(mixed) as stream:
        assert np.array_equal(stream.opened.answers.relations, expected.answers.relations)


def test_answers_are_proven_by_the_points(client: hulld.Client, name: str, cube: str) -> None:
    verifier = hulld.Verifier(client)
    shuffled = np.vstack([CUBE[::-1], [[0.5, 0.5, 0.5]], CUBE[3:5]])
    client.put_body(f"{name}/row", [(cube, (2.0 * i, 0, 0)) for i in range(3)])
    for x in (0.5, 1.0, 1.5, 9.0):
        for a in (shuffled, cube, f"{name}/row"):
            b = (shuffled, (x, 0, 0))
            answer = client.check_collision(a, b, certificate=True)
            verifier.check(a, b, answer)
    placements = hulld.Placements([cube], [(0, 0, 0), (1, 0, 0)], shapes=[shuffled])
    found = client.check_collisions(placements, certificate=True)
    verifier.check_row(placements, found, 0)
    touching = client.check_collision(shuffled, (shuffled, (1, 0, 0)), certificate=True)
    with pytest.raises(hulld.VerificationError, match="does not exist in its shape"):
        verifier.check(shuffled / 2, (shuffled, (0.5, 0, 0)), touching)


def test_malformed_points_are_refused(client: hulld.Client, cube: str) -> None:
    with pytest.raises(ValueError, match=r"points\[0\].y is nan"):
        client.check_collision(np.array([[0, np.nan, 0]]), cube)
    for count in (0, 4097):
        with pytest.raises(ValueError, match=f"points has {count} points"):
            client.check_collision(np.zeros((count, 3)), cube)
    with pytest.raises(ValueError, match="both an ID and points"):
        hulld.Placement(cube, points=CUBE)
    with pytest.raises(TypeError, match="is not a placement"):
        client.check_collision(5, cube)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="a piece is a registered hull"):
        client.put_body("row", [CUBE])
