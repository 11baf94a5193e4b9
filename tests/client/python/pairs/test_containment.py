"""Points inside, on, or outside hulls, and the nearest pairs of a scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import hulld
from conftest import CUBE


@pytest.fixture
def cube(client: hulld.Client, name: str) -> str:
    client.append_points(f"{name}/cube", CUBE, create=True)
    return f"{name}/cube"


def sides(found: hulld.Containment) -> list[str]:
    """One letter per point: i, n, or o."""
    masks = (found.inside, found.on, found.outside)
    assert (np.sum(masks, axis=0) == 1).all()
    return ["ino"[index] for index in np.argmax(masks, axis=0)]


def test_boundaries_are_exact(either: Any, cube: str) -> None:
    below, above = np.nextafter(1, 0), np.nextafter(1, 2)
    points = [(below, 0.5, 0.5), (1, 0.5, 0.5), (above, 0.5, 0.5), (1, 1, 1), (0, 0.5, 1)]
    for hull in (cube, CUBE, CUBE.tolist()):
        assert sides(either.contains(points, hull)) == ["i", "n", "o", "n", "n"]
    assert repr(either.contains(points, cube)) == "Containment(1 inside, 3 on, 1 outside)"


def test_agrees_with_an_integer_lattice(client: hulld.Client, cube: str) -> None:
    pose = hulld.Pose([1, 1, 0, 0], [2, -3, 5])  # a quarter turn about x
    lattice = np.array([[x, y, z] for x in range(-4, 13) for y in range(-4, 13)
                        for z in range(-4, 13)]) / 4  # fmt: skip
    x, y, z = lattice.T
    inside = (0 < x) & (x < 1) & (-1 < y) & (y < 0) & (0 < z) & (z < 1)
    outside = (0 > x) | (x > 1) | (-1 > y) | (y > 0) | (0 > z) | (z > 1)
    found = client.contains(lattice + pose.translation, cube, pose=pose)
    assert np.array_equal(found.inside, inside)
    assert np.array_equal(found.outside, outside)
    assert np.array_equal(found.on, ~inside & ~outside)


def test_depth_is_minus_the_separation(client: hulld.Client, cube: str) -> None:
    points = np.array([[0.5, 0.5, 0.25], [0.5, 0.5, 1], [0.5, 0.5, 3]], np.float32)
    found = client.contains(points, cube, separation=True)
    assert found.separations is not None and found.separation_bounds is not None
    errors = np.abs(found.separations - [-0.25, 0, 2])
    assert (errors <= found.separation_bounds).all()
    assert client.contains(points, cube).separations is None
    loose = client.contains(points, cube, max_error=1)
    assert loose.separations is not None and (loose.separations[:1] < 0).all()


def test_flat_and_empty_hulls_have_no_inside(client: hulld.Client, name: str) -> None:
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    segment = [(0, 0, 0), (2, 2, 2)]
    points = [(0.5, 0.5, 0), (1, 1, 0), (0, 0, 0), (1, 1, 1), (0.5, 0.5, 1e-300)]
    assert sides(client.contains(points, square)) == ["n", "n", "n", "o", "o"]
    assert sides(client.contains(points, segment)) == ["o", "o", "n", "n", "o"]
    assert sides(client.contains(points, [(1, 1, 1)])) == ["o", "o", "o", "n", "o"]
    client.create_hull(f"{name}/empty")
    found = client.contains(points, f"{name}/empty", separation=True)
    assert found.outside.all()
    assert found.separations is not None and np.isinf(found.separations).all()


def test_seams_of_a_body_are_on_it(client: hulld.Client, name: str, cube: str) -> None:
    client.put_body(f"{name}/row", [cube, (cube, (1, 0, 0))])
    points = [(0.5, 0.5, 0.5), (1, 0.5, 0.5), (1.5, 0.5, 0.5), (2, 0, 0), (3, 0, 0)]
    assert sides(client.contains(points, f"{name}/row")) == ["i", "n", "i", "n", "o"]


def test_many_points_go_in_calls_within_the_limits(
    connect: Callable[..., Any], rng: np.random.Generator
) -> None:
    points = rng.integers(-1, 4, (1000, 3)) / 2
    with hulld.LocalServer(options=["--max-pairs-per-batch=300", "--max-placements=200"]) as small:
        found = connect(small.address).contains(points, CUBE, separation=True)
    assert np.array_equal(found.outside, ((points < 0) | (points > 1)).any(axis=1))
    assert np.array_equal(found.inside, ((points > 0) & (points < 1)).all(axis=1))
    assert len(found) == len(found.separations) == 1000


def test_wrong_queries_are_named(either: Any, cube: str) -> None:
    with pytest.raises(hulld.NotFoundError, match=r'^NOT_FOUND: hull "absent" not found'):
        either.contains([(0, 0, 0)], "absent")
    with pytest.raises(ValueError, match=r"points\[1\].y is nan"):
        either.contains([(0, 0, 0), (0, np.nan, 0)], cube)
    with pytest.raises(TypeError, match="not a placement"):
        either.contains([(0, 0, 0)], (cube, (1, 0, 0)))
    assert len(either.contains(np.empty((0, 3)), cube)) == 0
    with pytest.raises(TypeError, match="neither true nor false"):
        bool(either.contains([(0, 0, 0)], cube))


def test_the_nearest_pairs_are_those_of_a_batch(
    either: Any, cube: str, rng: np.random.Generator
) -> None:
    placements = hulld.Placements([cube], rng.integers(0, 12, (40, 3)) / 2)
    batch = either.check_collisions(placements, separation=True)
    values = batch.answers.separations
    order = np.lexsort((batch.pairs[:, 1], batch.pairs[:, 0], values))
    for limit in (1, 7, 100, 5000):
        nearest = either.find_collisions(placements, limit=limit)
        assert np.array_equal(nearest.pairs, batch.pairs[order[:limit]])
        assert np.array_equal(nearest.answers.separations, values[order[:limit]])
        assert nearest.totals.pairs == nearest.totals.candidates == len(values)
    near = either.find_collisions(placements, limit=1000, clearance=1, certificate=True)
    assert np.array_equal(near.pairs, batch.pairs[order][values[order] <= 1])
    assert either.find_collisions(placements, limit=3, clearance=1).totals == near.totals
    hulld.Verifier(hulld.Client(either.server)).check_row(placements, near, len(near) - 1)
    with pytest.raises(ValueError, match="limit is 0; it must be from 1"):
        either.find_collisions(placements, limit=0)
