"""Bodies, by both clients against the real server."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hulld
from conftest import CUBE

QUARTER = np.array([[0.0, -1, 0, 5], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


@pytest.fixture
def cube(either: Any, name: str) -> str:
    either.append_points(f"{name}/cube", CUBE, create=True)
    return f"{name}/cube"


def test_a_body_is_put_read_listed_and_deleted(either: Any, name: str, cube: str) -> None:
    made = either.put_body(f"{name}/body", [cube, (cube, (3, 0, 0)), (cube, QUARTER)])
    assert made.created and made.body.piece_count == 3
    assert made.durability is hulld.Durability.MEMORY
    found = either.get_body(f"{name}/body")
    assert found.info == made.body
    assert found.pieces.ids == [cube] and len(found.pieces) == 3
    # A matrix arrives as the quaternion of its quarter turn.
    assert found.pieces[2].pose == hulld.Pose((0.5, 0, 0, 0.5), (5, 0, 0))
    assert [body.body_id for body in either.list_bodies(f"{name}/")] == [f"{name}/body"]
    assert not either.put_body(f"{name}/body", [cube]).created
    header = either.delete_body(f"{name}/body")
    assert header.revision > made.body.revision
    assert list(either.list_bodies(f"{name}/")) == []
    assert either.get_hull(cube).info.vertex_count == 8


def test_poses_arrive_bit_for_bit(either: Any, name: str, cube: str) -> None:
    rng = np.random.default_rng(7)
    poses = rng.normal(size=(20, 7)) * 10.0 ** rng.integers(-12, 12, size=(20, 7))
    poses[0, 5] = -0.0
    either.put_body(f"{name}/body", hulld.Placements(cube, poses))
    assert either.get_body(f"{name}/body").pieces.poses.tobytes() == poses.tobytes()


def test_bodies_are_listed_over_several_pages(either: Any, name: str, cube: str) -> None:
    names = [f"{name}/body-{i}" for i in range(5)]
    for body in names:
        either.put_body(body, [cube])
    listed = list(either.list_bodies(f"{name}/", page_size=2))
    assert [body.body_id for body in listed] == names
    assert all(body.piece_count == 1 and not body.damaged for body in listed)


def test_answers_name_the_pieces_that_decided(either: Any, name: str, cube: str) -> None:
    body = f"{name}/body"
    either.put_body(body, [cube, (cube, (4, 0, 0))])
    answer = either.check_collision((body, (10, 0, 0)), (cube, (14.5, 0, 0)), separation=True)
    assert answer.relation is hulld.Relation.OVERLAPPING
    assert abs(answer.separation.value + 0.5) <= answer.separation.bound
    assert answer.hull_a.hull_id == body and answer.piece_b is None
    assert answer.piece_a.index == 1 and answer.piece_a.hull.hull_id == cube
    assert either.check_collision(cube, cube).piece_a is None
    # Hulls have no pieces, in columns -1.
    placements = [body, (cube, (4.5, 0, 0)), (body, (0, 50, 0))]
    batch = either.check_collisions(placements, [[0, 1], [1, 0], [2, 1]], separation=True)
    assert batch.answers.pieces.dtype == np.int32
    assert batch.answers.pieces[:2].tolist() == [[1, -1], [-1, 1]]
    assert batch.hulls[body].hull_id == body
    scene = either.find_collisions(placements)
    assert scene.pairs.tolist() == [[0, 1]] and scene.answers.pieces.tolist() == [[1, -1]]
    # Without bodies there is no such column.
    assert either.check_collisions([cube, cube]).answers.pieces is None


def test_many_pieces_have_large_indices(either: Any, name: str, cube: str) -> None:
    far = np.zeros((300, 3))
    far[:, 0] = np.arange(300) * 10
    either.put_body(f"{name}/row", hulld.Placements(cube, far))
    batch = either.check_collisions(
        [f"{name}/row", (cube, (2990, 0, 0)), (cube, (0, 0, 0))], [[0, 1], [0, 2]], separation=True
    )
    assert batch.answers.pieces.tolist() == [[299, -1], [0, -1]]


def test_errors_have_reasons(either: Any, name: str, cube: str) -> None:
    body = f"{name}/body"
    with pytest.raises(hulld.NotFoundError) as missing:
        either.get_body(body)
    assert missing.value.reason == "BODY_NOT_FOUND"
    with pytest.raises(hulld.AlreadyExistsError) as taken:
        either.put_body(cube, [f"{name}/nail"])
    assert taken.value.reason == "HULL_EXISTS"
    with pytest.raises(ValueError, match="pieces is empty"):
        either.put_body(body, [])
    made = either.put_body(body, [f"{name}/nail"], if_revision=0)
    with pytest.raises(hulld.AbortedError) as moved:
        either.put_body(body, [cube], if_revision=0)
    assert moved.value.reason == "REVISION_MISMATCH"
    with pytest.raises(hulld.AbortedError):
        either.delete_body(body, if_revision=made.body.revision + 1)
    with pytest.raises(hulld.NotFoundError) as lacking:
        either.check_collision(body, cube)
    assert lacking.value.reason == "PIECE_NOT_FOUND"
    assert lacking.value.metadata["hull_id"] == f"{name}/nail"
    either.delete_body(body, if_revision=made.body.revision)
    with pytest.raises(hulld.NotFoundError):
        either.delete_body(body)


def test_wrong_pieces_are_refused_before_they_are_sent(either: Any, name: str, cube: str) -> None:
    bent = np.eye(4)
    bent[0, 1] = 0.01
    with pytest.raises(ValueError, match=r"poses\[1\]: the rotation is not orthogonal"):
        either.put_body(f"{name}/body", [cube, (cube, bent)])
    with pytest.raises(TypeError, match="is one ID"):
        either.put_body(f"{name}/body", cube)
    assert list(either.list_bodies(f"{name}/")) == []


def test_watches_report_bodies_that_change(either: Any, name: str, cube: str) -> None:
    body = f"{name}/body"
    either.put_body(body, [cube])
    with either.watch_hulls(f"{name}/", bodies=True) as watch:
        events = {}
        changes = next(watch)
        while not changes.synced:
            events |= {event.hull.hull_id: event for event in changes.events}
            changes = next(watch)
        events |= {event.hull.hull_id: event for event in changes.events}
        assert events[body].is_body and events[body].piece_count == 1
        assert events[body].box is None and not events[cube].is_body
        made = either.put_body(body, [cube, cube])
        changes = next(watch)
        while not changes.events:
            changes = next(watch)
        (event,) = changes.events
        assert event.kind is hulld.HullEventKind.CHANGED and event.piece_count == 2
        assert event.hull.revision == made.body.revision
    with either.watch_collisions([body, (f"{name}/probe", (4.5, 0, 0))]) as watch:
        changes = next(watch)
        while not changes.synced:
            changes = next(watch)
        assert [hull.hull_id for hull in changes.piece_hulls] == [cube]
        either.append_points(f"{name}/probe", CUBE, create=True)
        either.put_body(body, [cube, (cube, (4, 0, 0))])
        changes = next(watch)
        while not changes.events:
            changes = next(watch)
        (contact,) = changes.events
        assert contact.kind is hulld.CollisionEventKind.ENTER
        assert contact.piece_a.index == 1 and contact.piece_a.hull.hull_id == cube
        assert contact.piece_b is None
