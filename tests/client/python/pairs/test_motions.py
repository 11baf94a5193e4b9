"""First contacts of motions."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import hulld
from conftest import CUBE

AWAY = (3, 0, 0)


@pytest.fixture
def cube(client: hulld.Client, name: str) -> str:
    client.append_points(f"{name}/cube", CUBE, create=True)
    return f"{name}/cube"


@pytest.mark.parametrize(
    ("to", "relation", "time"),
    [
        ((-1, 0, 0), hulld.Relation.OVERLAPPING, 0.5),
        ((1, 0, 0), hulld.Relation.TOUCHING, 1.0),
        ((1.5, 0, 0), hulld.Relation.SEPARATED, None),
    ],
)
def test_translations_meet_at_exact_times(
    client: hulld.Client,
    cube: str,
    to: tuple[float, float, float],
    relation: hulld.Relation,
    time: float | None,
) -> None:
    answer = client.check_collision(cube, (cube, AWAY), to_b=to, certificate=True)
    assert answer.relation is relation
    assert answer.first_contact is not None
    assert answer.first_contact.contact_time == time
    assert answer.first_contact.separated_until == (1 if time is None else time)
    verifier = hulld.Verifier(client)
    verifier.check(cube, (cube, AWAY), answer, to_b=to)
    with pytest.raises(hulld.VerificationError):
        verifier.check(cube, (cube, AWAY), answer, to_b=(-3, 0, 0))
    for other in {hulld.Relation.SEPARATED, hulld.Relation.OVERLAPPING} - {relation}:
        if relation is hulld.Relation.TOUCHING and other is hulld.Relation.OVERLAPPING:
            continue  # The proof does not show that a translation overlaps after it touches.
        with pytest.raises(hulld.VerificationError):
            forged = dataclasses.replace(answer, relation=other)
            verifier.check(cube, (cube, AWAY), forged, to_b=to)
    assert client.check_collision(cube, (cube, AWAY)).first_contact is None


def test_each_part_of_a_proof_is_checked(client: hulld.Client, cube: str) -> None:
    a, b, to = cube, (cube, (3, 0.25, 0.5)), hulld.Pose((1, 0, 0.25, 1), (-1, 0, 0))
    answer = client.check_collision(a, b, to_b=to, certificate=True)
    contact = answer.first_contact
    assert contact is not None and contact.contact_time is not None and contact.intervals
    verifier = hulld.Verifier(client)
    verifier.check(a, b, answer, to_b=to)

    def expect(message: str, **changes: object) -> None:
        forged = dataclasses.replace(contact, **changes)  # type: ignore[type-var, arg-type]
        with pytest.raises(hulld.VerificationError, match=message):
            verifier.check(a, b, dataclasses.replace(answer, first_contact=forged), to_b=to)

    first, *rest = contact.intervals
    assert first.offset is not None
    expect("the bracket", contact_time=contact.separated_until / 2)
    expect("the bracket", separated_until=contact.separated_until / 2)
    expect("the bracket", contact_time=None)
    expect("before separated_until", intervals=())
    expect("stay", intervals=(dataclasses.replace(first, offset=first.offset + 9), *rest))
    expect("stay", intervals=(dataclasses.replace(first, offset=first.offset - 9), *rest))
    expect("offsets at both ends", intervals=(dataclasses.replace(first, offset=None), *rest))
    at_rest = dataclasses.replace(first, offset=None, end_direction=None, end_offset=None)
    expect("offset is missing", intervals=(at_rest, *rest))
    assert first.end_offset is not None
    for change in (9.0, -9.0):
        moved = dataclasses.replace(first, end_offset=first.end_offset + change)
        expect("stay", intervals=(moved, *rest))
    expect("offsets at both ends", intervals=(dataclasses.replace(first, end_offset=None), *rest))
    zero = dataclasses.replace(first, end_direction=(0.0, 0.0, 0.0))
    expect("direction is zero", intervals=(zero, *rest))
    infinite = dataclasses.replace(first, end_direction=(np.inf, 0.0, 0.0))
    expect("not finite", intervals=(infinite, *rest))
    expect("not finite", intervals=(dataclasses.replace(first, end_offset=np.inf), *rest))
    expect("not finite", intervals=(dataclasses.replace(first, offset=np.inf), *rest))
    expect("direction is zero", intervals=(dataclasses.replace(first, direction=(0, 0, 0)), *rest))
    expect("no direction", intervals=(dataclasses.replace(first, direction=None), *rest))
    expect("interval 0 ends", intervals=(dataclasses.replace(first, until=0.0), *rest))
    with pytest.raises(hulld.VerificationError, match="has no first contact"):
        verifier.check(a, b, dataclasses.replace(answer, first_contact=None), to_b=to)
    with pytest.raises(hulld.VerificationError, match="no certificate of the contact"):
        verifier.check(a, b, dataclasses.replace(answer, certificate=None), to_b=to)


@pytest.mark.parametrize("end", [(-4, 0, 0), (1, 0, 0.25, 0.5, -4, 0, 0)])
def test_pieces_of_bodies_move_with_their_poses(
    client: hulld.Client, name: str, cube: str, end: tuple[float, ...]
) -> None:
    body = f"{name}/body"
    pieces = [(cube, (-7, 0, 0)), (cube, (1, 2, 2, 0, 1, 2, 3)), (cube, (3, 0, 0, 3, 2, 0, 0))]
    client.put_body(body, pieces)
    a, b = cube, (body, (4, 0, 0))
    answer = client.check_collision(a, b, to_b=end, certificate=True)
    contact = answer.first_contact
    assert contact is not None and contact.contact_time is not None
    assert answer.relation is hulld.Relation.OVERLAPPING
    verifier = hulld.Verifier(client)
    verifier.check(a, b, answer, to_b=end)
    found = client.check_collisions([a, hulld.Placement(body, (4, 0, 0), end_pose=end)])
    assert found[0].first_contact is not None
    assert found[0].first_contact.contact_time == contact.contact_time
    # Each pair of pieces is proven at the poses of the pieces.
    assert len(answer.piece_certificates) == len(pieces)
    for index, one in enumerate(answer.piece_certificates):
        first, *rest = one.intervals
        assert first.direction is not None
        x, y, z = first.direction
        first = dataclasses.replace(first, direction=(-x, -y, -z))
        proof = list(answer.piece_certificates)
        proof[index] = dataclasses.replace(one, intervals=(first, *rest))
        forged = dataclasses.replace(answer, piece_certificates=tuple(proof))
        with pytest.raises(hulld.VerificationError, match=f"pieces 0 of A and {index} of B"):
            verifier.check(a, b, forged, to_b=end)
    client.put_body(body, [cube, cube, cube])
    with pytest.raises(hulld.VerificationError) as moved:
        hulld.Verifier(client).check(a, b, answer, to_b=end)
    assert moved.value.moved


def test_batches_answer_as_single_calls(client: hulld.Client, cube: str) -> None:
    rng = np.random.default_rng(31)
    starts = np.hstack([rng.normal(size=(12, 4)), rng.uniform(-2, 2, size=(12, 3))])
    ends = np.hstack([rng.normal(size=(12, 4)), rng.uniform(-2, 2, size=(12, 3))])
    placements = hulld.Placements(cube, starts, end_poses=ends)
    assert placements.end_poses is not None
    assert ((placements.poses[:, :4] * placements.end_poses[:, :4]).sum(axis=1) >= 0).all()
    found = client.check_collisions(placements, certificate=True)
    verifier = hulld.Verifier(client)
    for row, (a, b) in enumerate(found.pairs):
        single = client.check_collision(placements[a], placements[b], certificate=True)
        answer = found[row]
        assert answer.relation is single.relation
        assert answer.first_contact == single.first_contact
        verifier.check_row(placements, found, row)
        verifier.check(placements[a], placements[b], single)
    assert found.answers.contact_times is not None
    assert (
        np.isnan(found.answers.contact_times).sum()
        == (found.answers.relations == hulld.Relation.SEPARATED).sum()
    )
    assert found.answers.separated_until is not None
    assert client.check_collisions([cube, cube]).answers.contact_times is None


def test_rotations_take_the_shorter_path(client: hulld.Client, cube: str) -> None:
    turned = hulld.Placement(cube, (1, 0, 0, 0, 0, 0, 0), end_pose=(-1, 0, 0, 0.5, 9, 0, 0))
    packed = hulld.Placements.of([turned, cube])
    assert packed.end_poses is not None
    assert packed.end_poses[:, :4].tolist() == [[1, 0, 0, -0.5], [1, 0, 0, 0]]
    assert packed[0].end_pose == hulld.Pose((1, 0, 0, -0.5), (9, 0, 0))
    huge = hulld.Placement(cube, (1e200, 0, 0, 0, 0, 0, 0), end_pose=(-1e200, 0, 0, 0, 9, 0, 0))
    assert hulld.Placements.of([huge]).end_poses[0, 0] == 1e200  # type: ignore[index]


def test_options_bound_the_bracket(client: hulld.Client, cube: str) -> None:
    a, b, to = cube, (cube, (3, 0.25, 0.5)), (1, 0, 0.25, 1, -1, 0, 0)
    answer = client.check_collision(a, b, to_b=to, max_time_error=1e-3, certificate=True)
    contact = answer.first_contact
    assert contact is not None and contact.contact_time is not None
    assert 0 <= contact.contact_time - contact.separated_until <= 1e-3
    hulld.Verifier(client).check(a, b, answer, to_b=to, max_time_error=1e-3)
    with pytest.raises(hulld.InvalidArgumentError, match="wanted.max_time_error"):
        client.check_collision(a, b, to_b=to, max_time_error=2)
    with pytest.raises(hulld.InvalidArgumentError, match="wanted.witness cannot be combined"):
        client.check_collision(a, b, to_b=to, witness=True)


def test_options_bound_the_brackets_of_scenes(either: Any) -> None:
    turning = hulld.Placement(points=CUBE, pose=(3, 0.25, 0.5), end_pose=(1, 0, 0.25, 1, -1, 0, 0))
    moving = hulld.Placements.of([hulld.Placement(points=CUBE), turning])
    widths = {}
    for error in (None, 1e-3, 0.25):
        options = {} if error is None else {"max_time_error": error}
        contact = either.find_collisions(moving, **options)[0].first_contact
        widths[error] = contact.contact_time - contact.separated_until
        assert 0 <= widths[error] <= (error or 2**-30)
    assert widths[None] < widths[1e-3] < widths[0.25]
    with pytest.raises(hulld.InvalidArgumentError, match="wanted.max_time_error"):
        either.find_collisions(moving, max_time_error=2)
    with pytest.raises(ValueError, match="resolution"):
        either.find_collisions(moving, resolution=-1)
    # The corner of a box that turns by 90 degrees passes a wall, 1e-14 away.
    wall = CUBE * (1, 10, 10) + (2**0.5 + 1e-14, -5, -5)
    box = hulld.Placement(points=2 * CUBE - 1, end_pose=(1, 0, 0, 1, 0, 0, 0))
    passing = hulld.Placements.of([hulld.Placement(points=wall), box])
    near = either.find_collisions(passing, resolution=0.1)
    assert near.answers.relations.tolist() == [hulld.Relation.WITHIN_TOLERANCE]


def test_scenes_take_motions_and_streams_refuse_them(client: hulld.Client, cube: str) -> None:
    moving = [cube, hulld.Placement(cube, AWAY, end_pose=(1, 0, 0))]
    found = client.find_collisions(moving)
    assert found.pairs.tolist() == [[0, 1]]
    assert found[0].first_contact is not None and found[0].first_contact.contact_time == 1
    with pytest.raises(hulld.InvalidArgumentError, match="end_poses is set, but a stream"):
        with client.stream_collisions(moving):
            pass
    with pytest.raises(hulld.InvalidArgumentError, match="end_poses is set, but a watch"):
        with client.watch_collisions(moving) as watch:
            next(iter(watch))
    with pytest.raises(ValueError, match="1 end poses for 2 placements"):
        hulld.Placements(cube, [AWAY, AWAY], end_poses=[AWAY])


def test_radii_count_at_all_times(client: hulld.Client) -> None:
    origin = np.zeros((1, 3))
    a = hulld.Placement(points=origin, radius=1)
    b = hulld.Placement(points=origin, pose=(6, 8, 0), radius=2, end_pose=(-6, -8, 0))
    answer = client.check_collision(a, b, certificate=True)
    assert answer.first_contact is not None and answer.first_contact.contact_time is not None
    assert abs(answer.first_contact.contact_time - 0.35) < 1e-9
    hulld.Verifier(client).check(a, b, answer)
    smaller = dataclasses.replace(b, radius=1.5)
    with pytest.raises(hulld.VerificationError):
        hulld.Verifier(client).check(a, smaller, answer)


def test_inline_shapes_move(client: hulld.Client) -> None:
    points = np.vstack([CUBE[::-1], [[0.5, 0.5, 0.5]]])
    answer = client.check_collision(points, (points, AWAY), to_b=(-1, 0, 0), certificate=True)
    assert answer.first_contact is not None and answer.first_contact.contact_time == 0.5
    hulld.Verifier(client).check(points, (points, AWAY), answer, to_b=(-1, 0, 0))
    assert "contact_time=0.5" in repr(answer)
    assert "first contact" in answer._repr_html_()


def test_rays_hit_in_order(client: hulld.Client, cube: str) -> None:
    row = hulld.Placements(cube, [(4, 0, 0), (0, 0, 0), (0, 5, 0)])
    origins = [(-1, 0.5, 0.5), (0.5, 0.5, 0.5), (-1, 3, 0.5), (-1, 1, 1)]
    hits = client.cast(origins, (8, 0, 0), row)
    assert hits.rays.tolist() == [0, 0, 1, 1, 3, 3]
    assert hits.placements.tolist() == [1, 0, 1, 0, 1, 0]
    assert hits.times.tolist() == [0.125, 0.625, 0, 0.4375, 0.125, 0.625]
    assert hits.points[1].tolist() == [4, 0.5, 0.5]
    assert hits.normals[0].tolist() == [-1, 0, 0]
    assert np.isnan(hits.normals[2]).all()
    assert hits.first().times.tolist() == [0.125, 0, 0.125]
    assert repr(hits) == "Hits(6 of 3 rays)"
    assert len(client.cast([(-1, 0.5, 0.5)], [(0.5, 0, 0)], row)) == 0
    assert len(client.cast(np.empty((0, 3)), (1, 0, 0), row)) == 0
    with pytest.raises(ValueError, match="3 origins and 2 directions"):
        client.cast(np.zeros((3, 3)), np.zeros((2, 3)), row)
    with pytest.raises(ValueError, match="origins has the shape"):
        client.cast([1, 2], (1, 0, 0), row)
    for origin, direction, message in [
        ((0, np.nan, 0), (1, 0, 0), r"origins\[0\].y is nan"),
        ((0, 0, 0), (1, 0, np.inf), r"directions\[0\].z is inf"),
        ((1e308, 0, 0), (1e308, 0, 0), r"\(origins \+ directions\)\[0\].x is inf"),
    ]:
        with pytest.raises(ValueError, match=message):
            client.cast(origin, direction, row)
    with pytest.raises(hulld.NotFoundError, match="nothing"):
        client.cast((0, 0, 0), (1, 0, 0), [cube, "nothing"])


def test_random_rays_agree_with_the_box(client: hulld.Client, cube: str) -> None:
    rng = np.random.default_rng(8)
    origins = rng.uniform(-3, 3, (200, 3))
    directions = 1.5 * (rng.uniform(-0.5, 1.5, (200, 3)) - origins)
    hits = client.cast(origins, directions, [cube])
    with np.errstate(divide="ignore"):
        low, high = (0 - origins) / directions, (1 - origins) / directions
    enters = np.minimum(low, high).max(axis=1).clip(0)
    leaves = np.maximum(low, high).min(axis=1).clip(max=1)
    expected = np.flatnonzero(enters <= leaves)
    assert hits.rays.tolist() == expected.tolist()
    assert 20 < len(hits) < 200
    np.testing.assert_allclose(hits.times, enters[expected], rtol=1e-13, atol=1e-15)
    faces = np.abs(hits.normals).max(axis=1)
    np.testing.assert_allclose(faces[~np.isnan(faces)], 1, rtol=1e-12)


def test_bodies_in_motion_are_proven(client: hulld.Client, cube: str, name: str) -> None:
    far = f"{name}/far"
    client.append_points(far, np.asarray(CUBE) + (5, 0, 0), create=True)
    body = f"{name}/body"
    client.put_body(body, [far, cube])
    verifier = hulld.Verifier(client)
    start = (cube, (-3, 0, 0))
    for to in [(3, 0, 0), hulld.Pose((1, 0, 0.25, 1), (3, 0, 0)), (-2, 0, 0)]:
        answer = client.check_collision(body, start, to_b=to, certificate=True)
        verifier.check(body, start, answer, to_b=to)
        assert len(answer.piece_certificates) == 2
    hits = client.cast((-3, 0.5, 0.5), (12, 0, 0), [body])
    assert hits.times.tolist() == [0.25] and hits.normals.tolist() == [[-1, 0, 0]]
    answer = client.check_collision(body, start, to_b=(3, 0, 0), certificate=True)
    assert answer.piece_a is not None and answer.piece_a.index == 1
    other = dataclasses.replace(answer, piece_a=dataclasses.replace(answer.piece_a, index=0))
    with pytest.raises(hulld.VerificationError, match="pieces 0 of A and 0 of B decided"):
        verifier.check(body, start, other, to_b=(3, 0, 0))
    for number in range(2):
        short = [*answer.piece_certificates]
        short.pop(number)
        with pytest.raises(hulld.VerificationError):
            forged = dataclasses.replace(answer, piece_certificates=short)
            verifier.check(body, start, forged, to_b=(3, 0, 0))


def test_the_first_contacts_of_a_scene_are_found(client: hulld.Client, cube: str) -> None:
    placements = hulld.Placements.of(
        [
            cube,
            hulld.Placement(cube, (3, 0, 0), end_pose=(-1, 0, 0)),
            hulld.Placement(cube, (0, 5, 0), end_pose=(0, 0, 0)),
        ]
    )
    scene = client.find_collisions(placements, first_only=True, certificate=True)
    assert scene.pairs.tolist() == [[0, 1]]
    hulld.Verifier(client).check_row(placements, scene, 0)
    with pytest.raises(hulld.InvalidArgumentError, match="no placement has an end_pose"):
        client.find_collisions([cube, cube], first_only=True)


def test_every_pair_of_pieces_has_a_row(client: hulld.Client, cube: str, name: str) -> None:
    row = f"{name}/row"
    client.put_body(row, [(cube, (2 * i, 0, 0)) for i in range(3)])
    scene = client.find_collisions([row, (row, (0, 1, 0))], every_piece=True, certificate=True)
    assert scene.pairs.tolist() == [[0, 1]] * 3
    assert scene.answers.pieces is not None
    assert scene.answers.pieces.tolist() == [[0, 0], [1, 1], [2, 2]]
    assert sorted(scene.answers.piece_proofs) == [0, 1, 2]
