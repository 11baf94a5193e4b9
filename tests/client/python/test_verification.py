"""Certificates, checked in Python by exact arithmetic."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import hulld
from conftest import CUBE

TURN = hulld.Pose((0.3, -0.7, 0.2, 0.9), (17.25, -4.125, 1e6))


@pytest.fixture
def cube(client: hulld.Client, name: str) -> str:
    client.append_points(f"{name}/cube", CUBE, create=True)
    return f"{name}/cube"


@pytest.fixture
def row(client: hulld.Client, name: str, cube: str) -> str:
    """Five cubes, two apart."""
    client.put_body(f"{name}/row", [(cube, (2.0 * i, 0, 0)) for i in range(5)])
    return f"{name}/row"


@pytest.mark.parametrize(
    ("x", "relation"),
    [
        (0.5, hulld.Relation.OVERLAPPING),
        (1.0, hulld.Relation.TOUCHING),
        (1.5, hulld.Relation.SEPARATED),
    ],
)
def test_hulls_are_proven(
    client: hulld.Client, cube: str, x: float, relation: hulld.Relation
) -> None:
    verifier = hulld.Verifier(client)
    answer = client.check_collision(cube, (cube, (x, 0, 0)), certificate=True)
    assert answer.relation is relation
    verifier.check(cube, (cube, (x, 0, 0)), answer)
    for other in set(hulld.Relation) - {relation}:
        with pytest.raises(hulld.VerificationError):
            verifier.check(cube, (cube, (x, 0, 0)), dataclasses.replace(answer, relation=other))
    # It proves nothing about another query.
    with pytest.raises(hulld.VerificationError):
        verifier.check(cube, (cube, (9 if x <= 1 else 0.5, 0, 0)), answer)
    with pytest.raises(hulld.VerificationError, match="no certificate"):
        verifier.check(cube, cube, client.check_collision(cube, cube))


def test_random_poses_are_proven(client: hulld.Client, cube: str) -> None:
    rng = np.random.default_rng(3)
    poses = np.hstack([rng.normal(size=(30, 4)), rng.uniform(-1.2, 1.2, size=(30, 3))])
    placements = hulld.Placements(cube, poses)
    found = client.check_collisions(placements, certificate=True)
    verifier = hulld.Verifier(client)
    for row_number in range(len(found.pairs)):
        verifier.check_row(placements, found, row_number)
    assert len(set(found.answers.relations.tolist())) > 1


def test_poses_compose_exactly(client: hulld.Client, name: str, cube: str) -> None:
    client.put_body(f"{name}/left", [(cube, (0.25, 0.2, 0.3))])
    client.put_body(f"{name}/right", [(cube, (1.25, 0.2, 0.3))])
    left, right = (f"{name}/left", TURN), (f"{name}/right", TURN)
    answer = client.check_collision(left, right, certificate=True)
    assert answer.relation is hulld.Relation.TOUCHING
    hulld.Verifier(client).check(left, right, answer)


def test_bodies_are_proven(client: hulld.Client, row: str, cube: str) -> None:
    verifier = hulld.Verifier(client)
    for pose, relation, certificates in [
        ((3.5, 0.5, 0), hulld.Relation.OVERLAPPING, 1),
        ((0, 1, 0), hulld.Relation.TOUCHING, 5),
        ((0, 9, 0), hulld.Relation.SEPARATED, 0),
    ]:
        answer = client.check_collision(row, (row, pose), certificate=True)
        assert answer.relation is relation and answer.certificate is None
        assert len(answer.piece_certificates) == certificates
        assert set(answer.piece_hulls) == {cube}
        verifier.check(row, (row, pose), answer)
    touching = client.check_collision(row, (row, (0, 1, 0)), certificate=True)
    short = dataclasses.replace(touching, piece_certificates=touching.piece_certificates[:-1])
    with pytest.raises(hulld.VerificationError, match="pieces 4 of A and 4 of B have no"):
        verifier.check(row, (row, (0, 1, 0)), short)
    twice = (*touching.piece_certificates, touching.piece_certificates[0])
    with pytest.raises(hulld.VerificationError, match="have two certificates"):
        forged = dataclasses.replace(touching, piece_certificates=twice)
        verifier.check(row, (row, (0, 1, 0)), forged)
    assert touching.piece_a is not None
    other = dataclasses.replace(touching, piece_a=dataclasses.replace(touching.piece_a, index=9))
    with pytest.raises(hulld.VerificationError, match="pieces 9 of A .* no certificate shows"):
        verifier.check(row, (row, (0, 1, 0)), other)
    wrong = dataclasses.replace(touching, relation=hulld.Relation.SEPARATED)
    with pytest.raises(hulld.VerificationError, match="are TOUCHING, but the bodies are SEPARATED"):
        verifier.check(row, (row, (0, 1, 0)), wrong)


def test_batches_scenes_and_streams_are_proven(client: hulld.Client, row: str, cube: str) -> None:
    placements = hulld.Placements.of([row, (row, (0, 1, 0)), (row, TURN), (cube, (4.5, 0.5, 0))])
    verifier = hulld.Verifier(client)
    batch = client.check_collisions(placements, certificate=True)
    assert sorted(batch.answers.piece_proofs) == [0, 1, 2, 3, 4, 5]
    for number in range(6):
        verifier.check_row(placements, batch, number)
    assert set(batch.piece_hulls) == {cube}
    scene = client.find_collisions(placements, certificate=True)
    assert scene.pairs.tolist() == [[0, 1], [0, 3], [1, 3]]
    for number in range(len(scene.pairs)):
        verifier.check_row(placements, scene, number)
    with client.stream_collisions(placements, certificate=True) as stream:
        step = stream.opened
        for number in range(len(step.pairs)):
            verifier.check_row(placements, step, number)
        assert set(step.piece_hulls) == {cube}


def test_changes_since_the_answer_are_reported(client: hulld.Client, row: str, cube: str) -> None:
    verifier = hulld.Verifier(client)
    answer = client.check_collision(row, cube, certificate=True)
    client.put_body(row, [cube])
    with pytest.raises(hulld.VerificationError, match="the answer is from revision") as raised:
        verifier.check(row, cube, answer)
    assert raised.value.moved
    again = client.check_collision(row, cube, certificate=True)
    verifier.check(row, cube, again)


def test_an_answer_about_a_new_version_is_proven(
    client: hulld.Client, row: str, cube: str
) -> None:
    verifier = hulld.Verifier(client)
    for scale in (1, 2):
        client.replace_hull(cube, np.multiply(CUBE, scale))
        client.put_body(row, [cube] * scale)
        verifier.check(cube, cube, client.check_collision(cube, cube, certificate=True))
        verifier.check(row, cube, client.check_collision(row, cube, certificate=True))
    client.delete_hull(cube)
    client.put_body(cube, [row + "/piece"])
    client.append_points(row + "/piece", CUBE, create=True)
    verifier.check(cube, cube, client.check_collision(cube, cube, certificate=True))


def test_numbers_of_a_proof_are_checked(client: hulld.Client, cube: str) -> None:
    verifier = hulld.Verifier(client)
    b = (cube, (1, 0, 0))
    answer = client.check_collision(cube, b, certificate=True)
    assert answer.certificate is not None
    for x in (np.inf, -np.inf, np.nan):
        forged = dataclasses.replace(answer.certificate, direction=(x, 0.0, 0.0))
        with pytest.raises(hulld.VerificationError, match="not finite"):
            verifier.check(cube, b, dataclasses.replace(answer, certificate=forged))
    first, *rest = answer.certificate.pairs
    for changes in ({"vertex_a": first.vertex_a + 1}, {"vertex_b": first.vertex_b + np.nan}):
        pairs = (dataclasses.replace(first, **changes), *rest)  # type: ignore[arg-type]
        forged = dataclasses.replace(answer.certificate, pairs=pairs)
        with pytest.raises(hulld.VerificationError, match="does not have the coordinates"):
            verifier.check(cube, b, dataclasses.replace(answer, certificate=forged))
