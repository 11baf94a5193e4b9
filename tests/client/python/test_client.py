"""Both clients against the real server: every call, its answer and its errors."""

from __future__ import annotations

import concurrent.futures
import inspect
import pathlib
import threading
from typing import Any

import numpy as np
import pytest

import hulld
from conftest import CUBE
from hulld.calls.requests import update_stream
from hulld.v1 import hull_pb2, hull_pb2_grpc


def put(client: Any, name: str, points: np.ndarray = CUBE) -> None:
    client.append_points(name, points, create=True)


def ball(rng: np.random.Generator, count: int) -> np.ndarray:
    points = rng.normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, np.newaxis]


# --- Hulls ---


def test_both_clients_have_one_surface() -> None:
    def surface(kind: type) -> dict[str, list[str]]:
        return {
            name: [p for p in inspect.signature(member).parameters]
            for name, member in inspect.getmembers(kind, inspect.isfunction)
            if not name.startswith("_")
        }

    for sync, other in (
        (hulld.Client, hulld.AsyncClient),
        (hulld.Appender, hulld.AsyncAppender),
        (hulld.CollisionStream, hulld.AsyncCollisionStream),
        (hulld.HullWatch, hulld.AsyncHullWatch),
        (hulld.CollisionWatch, hulld.AsyncCollisionWatch),
    ):
        # Only asynchronous streams have `open`: a constructor cannot wait.
        found = surface(other)
        found.pop("open", None)
        assert found == surface(sync)
        for name in surface(sync):
            assert inspect.getdoc(getattr(sync, name)) and inspect.getdoc(getattr(other, name))


# == raised a ValueError about the truth value of an array.
def test_answers_with_arrays_can_be_compared(client: hulld.Client, name: str) -> None:
    put(client, name)
    pair = [name, (name, (5, 0, 0))]
    options: dict[str, Any] = {"separation": True, "witness": True, "certificate": True}
    for ask in (
        lambda: client.get_hull(name, properties=True),
        lambda: client.get_hull_mesh(name),
        lambda: client.check_collision(*pair, axis=True, normal=True, **options),
        lambda: client.check_collisions(pair, [(0, 1)], **options),
        lambda: client.find_collisions(pair, **options),
        lambda: client.contains(CUBE, name),
        lambda: client.cast([(-9, 0.5, 0.5)], [(18, 0, 0)], pair),
    ):
        assert ask() == ask() and ask() != 1
    assert client.get_hull_mesh(name) != client.get_hull_mesh(
        name, side="inside", max_vertices=4
    )
    assert client.contains(CUBE, name) != client.contains(CUBE + 1, name)


def test_status_contains_version_and_limits(either: Any) -> None:
    status = either.get_status()
    assert status.version and status.store_kind == "memory"
    assert status.limits.max_points_per_chunk == 200000
    assert status.limits.max_request_time == 300
    assert status.limits.max_calls_per_client == 512
    assert status.limits.max_batches_per_client == 16
    assert status.limits.request_memory_bytes == 128 << 20
    assert status.uptime >= 0 and status.started.tzinfo is not None
    assert either.check_health() is True


def test_the_contracts_own_stubs_share_the_channel(client: hulld.Client, name: str) -> None:
    stub = hull_pb2_grpc.HullServiceStub(client.channel)
    made = stub.CreateHull(hull_pb2.CreateHullRequest(hull_id=name))
    assert made.created and client.get_hull(name).info.create_revision == made.hull.create_revision


def test_a_hull_is_created_listed_and_deleted(either: Any, name: str) -> None:
    made = either.create_hull(f"{name}/a")
    assert made.created and made.hull.dimension == -1
    assert not either.create_hull(f"{name}/a", if_absent=True).created
    with pytest.raises(hulld.AlreadyExistsError) as caught:
        either.create_hull(f"{name}/a")
    assert caught.value.reason == "HULL_EXISTS"
    put(either, f"{name}/b")
    assert [hull.hull_id for hull in either.list_hulls(f"{name}/")] == [f"{name}/a", f"{name}/b"]
    assert [hull.hull_id for hull in either.list_hulls(f"{name}/", page_size=1)] == [
        f"{name}/a",
        f"{name}/b",
    ]
    with pytest.raises(hulld.AbortedError) as stale:
        either.delete_hull(f"{name}/b", if_revision=1)
    assert (
        int(stale.value.metadata["current_revision"]) == either.get_hull(f"{name}/b").info.revision
    )
    for hull in ("a", "b"):
        assert either.delete_hull(f"{name}/{hull}").revision > 0
    assert list(either.list_hulls(f"{name}/")) == []


def test_doubles_come_back_bit_for_bit(either: Any, name: str, rng: np.random.Generator) -> None:
    # The axes differ in magnitude, down to subnormals, so that every point is a vertex.
    points = np.concatenate([np.diag(s * np.array([5e-324, 1 / 3, 1e308])) for s in (1, -1)])
    put(either, name, points)
    vertices = either.get_hull_mesh(name).vertices
    assert sorted(map(bytes, vertices + 0.0)) == sorted(map(bytes, points + 0.0))


def test_floats_are_widened_exactly(either: Any, name: str, rng: np.random.Generator) -> None:
    points = ball(rng, 50).astype(np.float32)
    put(either, name, points)
    vertices = either.get_hull_mesh(name).vertices
    assert {tuple(v) for v in vertices.tolist()} <= {
        tuple(p) for p in points.astype(float).tolist()
    }
    assert len(vertices) > 40


def test_points_are_counted_and_cut_into_chunks(
    either: Any, name: str, rng: np.random.Generator
) -> None:
    inside = rng.uniform(0.1, 0.9, (1000, 3))
    done = either.append_points(
        name, np.concatenate([CUBE, CUBE, inside]), create=True, chunk_bytes=24 * 100
    )
    assert done.chunks == 11 and done.points == done.points_acknowledged == 1016
    assert done.counts == hulld.PointCounts(1016, 8, 8, 1000)
    assert done.vertex_count == 8 and done.durability == hulld.Durability.MEMORY
    hull = either.get_hull(name, audit=True)
    assert hull.audit is not None and hull.audit.ok
    assert (hull.edge_count, hull.facet_count) == (12, 6)
    np.testing.assert_array_equal(hull.box, [[0, 0, 0], [1, 1, 1]])
    assert either.get_hull(name, facets=False).facet_count is None
    assert hull.properties is None
    properties = either.get_hull(name, properties=True).properties
    assert properties.volume == hulld.BoundedValue(1.0, 0.0)
    assert properties.area.value == 6 and 0 < properties.area.bound < 1e-14
    np.testing.assert_array_equal(properties.centroid, [0.5, 0.5, 0.5])
    np.testing.assert_array_equal(properties.centroid_bounds, np.zeros(3))
    np.testing.assert_allclose(properties.inertia, np.eye(3) / 6, rtol=1e-15, atol=0)
    assert (properties.inertia_bounds <= 2.0**-55).all()


def test_points_come_from_an_iterator(either: Any, name: str) -> None:
    done = either.append_points(name, (CUBE[i : i + 2] for i in range(0, 8, 2)), create=True)
    assert done.chunks == 4 and done.vertex_count == 8
    replaced = either.replace_hull(name, iter([CUBE, 2 * CUBE]))
    assert replaced.hull.vertex_count == 8 and replaced.hull.counts.received == 16


def test_wrong_arguments_are_refused_before_anything_is_sent(either: Any, name: str) -> None:
    with pytest.raises(ValueError, match=r"points\[8\]\.x is nan"):
        either.append_points(name, np.concatenate([CUBE, [[np.nan, 0, 0]]]), chunk_bytes=24)
    put(either, name)
    with pytest.raises(ValueError, match="several|chunks"):
        either.append_points(name, CUBE, if_revision=1, chunk_bytes=24)
    assert either.get_hull(name).info.counts.received == 8


def test_a_revision_that_does_not_match_stops_an_append(either: Any, name: str) -> None:
    put(either, name)
    revision = either.get_hull(name).info.revision
    assert either.append_points(name, CUBE + 1, if_revision=revision).vertex_count > 8
    with pytest.raises(hulld.AbortedError) as caught:
        either.append_points(name, CUBE + 2, if_revision=revision)
    assert caught.value.reason == "REVISION_MISMATCH"
    assert caught.value.metadata["if_revision"] == str(revision)


def test_an_appender_continues_the_sequence_of_its_writer(either: Any, name: str) -> None:
    with either.open_append(name, create=True, writer_id="lab") as appender:
        assert appender.opened.last_sequence == 0 and appender.writer_id == "lab"
        appender.append(CUBE[:4])
        appender.append(CUBE[4:])
        assert appender.finish().points_acknowledged == 8
        with pytest.raises(hulld.FailedPreconditionError, match="finished"):
            appender.append(CUBE)
    with either.open_append(name, writer_id="lab") as again:
        assert again.opened.last_sequence == 2


def test_leaving_an_appender_waits_for_acknowledgements(either: Any, name: str) -> None:
    with either.open_append(name, create=True, max_in_flight_chunks=2) as appender:
        for point in CUBE:
            appender.append(point)
    assert appender.totals.points_acknowledged == 8
    assert either.get_hull(name).info.vertex_count == 8


def test_an_error_in_a_with_block_is_raised(either: Any, name: str) -> None:
    with pytest.raises(KeyError, match="mine"):
        with either.open_append(name, create=True) as appender:
            appender.append(CUBE)
            raise KeyError("mine")


def test_missing_hulls_are_named(either: Any, name: str) -> None:
    for call in (
        lambda: either.get_hull(name),
        lambda: either.get_hull_mesh(name),
        lambda: either.append_points(name, CUBE),
        lambda: either.delete_hull(name),
        lambda: either.replace_hull(name, CUBE),
        lambda: either.check_collision(name, name),
    ):
        with pytest.raises(hulld.NotFoundError) as caught:
            call()
        assert caught.value.reason == "HULL_NOT_FOUND"
        assert caught.value.metadata == {"hull_id": name}
        assert caught.value.request_id


def test_a_replacement_is_swapped_in_or_changes_nothing(either: Any, name: str) -> None:
    put(either, name)
    before = either.get_hull(name).info

    def broken() -> Any:
        yield 2 * CUBE
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        either.replace_hull(name, broken())
    with pytest.raises(ValueError, match="shape"):
        either.replace_hull(name, iter([2 * CUBE, np.zeros((2, 2))]))
    assert either.get_hull(name).info == before
    done = either.replace_hull(name, 3 * CUBE, if_revision=before.revision)
    assert not done.created and done.hull.create_revision > before.create_revision
    assert either.replace_hull(f"{name}-new", CUBE, create=True, if_revision=0).created


def test_a_mesh_has_vertices_facets_and_triangles(either: Any, name: str) -> None:
    put(either, name)
    mesh = either.get_hull_mesh(name)
    assert mesh.vertices.shape == (8, 3) and mesh.error is None
    assert [len(facet) for facet in mesh.facets] == [4] * 6
    triangles = mesh.vertices[mesh.triangles]
    # Counter-clockwise from outside: the signed volume is that of the cube.
    assert np.linalg.det(triangles - 0.5).sum() / 6 == pytest.approx(1)


def test_a_mesh_of_many_messages_is_assembled(
    either: Any, name: str, rng: np.random.Generator
) -> None:
    points = ball(rng, 60000)
    put(either, name, points)
    mesh = either.get_hull_mesh(name)
    assert {bytes(v) for v in mesh.vertices} == {bytes(p) for p in points}
    assert len(mesh.triangles) == 2 * len(points) - 4


def test_flat_and_empty_hulls_have_meshes(either: Any, name: str) -> None:
    put(either, name, CUBE[:4])
    assert [len(f) for f in either.get_hull_mesh(name).facets] == [4]
    either.create_hull(f"{name}-empty")
    empty = either.get_hull_mesh(f"{name}-empty")
    assert empty.vertices.shape == (0, 3) and empty.facets == [] and empty.triangles.shape == (0, 3)
    assert either.get_hull(f"{name}-empty").box is None


def test_a_simplified_hull_states_its_error(
    either: Any, name: str, rng: np.random.Generator
) -> None:
    put(either, name, ball(rng, 500))
    inside = either.get_hull_mesh(name, side="inside", max_vertices=40)
    assert len(inside.vertices) <= 40 and 0 < inside.error < 1
    outside = either.get_hull_mesh(name, side="outside", max_error=0.2)
    assert outside.error <= 0.2 and len(outside.vertices) < 500
    with pytest.raises(ValueError, match="side"):
        either.get_hull_mesh(name, max_vertices=40)
    with pytest.raises(ValueError, match="max_vertices or max_error"):
        either.get_hull_mesh(name, side="inside")


# --- Pairs ---


def test_one_pair_is_answered_with_every_wanted_result(either: Any, name: str) -> None:
    put(either, name)
    plain = either.check_collision(name, (name, (1, 0, 0)))
    assert plain.relation == hulld.Relation.TOUCHING and plain.colliding
    assert plain.separation is plain.axis is plain.witness is plain.certificate is None
    assert plain.normal is None
    full = either.check_collision(
        name,
        (name, (3, 0, 0)),
        axis=True,
        analysis=True,
        witness=True,
        normal=True,
        certificate=True,
        separation=True,
        clearance=2.0,
    )
    assert full.relation == hulld.Relation.SEPARATED and full.within_clearance is True
    assert abs(full.separation.value - 2) <= full.separation.bound
    assert full.witness.point_b[0] - full.witness.point_a[0] == pytest.approx(2)
    assert full.axis.direction == pytest.approx([1, 0, 0])
    assert full.normal.direction == pytest.approx([1, 0, 0])
    assert 0 < full.normal.angle_bound <= 1e-6
    assert full.analysis.size_a == hulld.HullSize(8, 12, 6)
    n = np.array(full.certificate.direction)
    assert (CUBE @ n).max() < ((CUBE + [3, 0, 0]) @ n).min()
    deep = either.check_collision(name, (name, (0.25, 0, 0)), separation=True, certificate=True)
    assert deep.relation == hulld.Relation.OVERLAPPING
    assert abs(deep.separation.value + 0.75) <= deep.separation.bound
    out = either.check_collision(name, (name, (0, -0.25, 0)), normal=True).normal
    np.testing.assert_array_equal(out.direction, [0, -1, 0])
    assert deep.certificate.direction is None and deep.certificate.pairs


def test_the_smallest_double_decides(either: Any, name: str) -> None:
    put(either, name)
    for x, relation in (
        (1.0, hulld.Relation.TOUCHING),
        (np.nextafter(1, 2), hulld.Relation.SEPARATED),
        (np.nextafter(1, 0), hulld.Relation.OVERLAPPING),
    ):
        assert either.check_collision(name, (name, (x, 0, 0))).relation == relation
        packed = hulld.Placements(name, [(0, 0, 0), (x, 0, 0)])
        assert either.check_collisions(packed).answers.relations.tolist() == [relation]


def test_an_answer_is_neither_true_nor_false(either: Any, name: str) -> None:
    put(either, name)
    with pytest.raises(TypeError, match=r"\.colliding"):
        bool(either.check_collision(name, name))
    with pytest.raises(TypeError, match=r"\.colliding"):
        bool(either.check_collisions([name, name]).answers)


def test_a_batch_answers_as_single_queries_do(
    either: Any, name: str, rng: np.random.Generator
) -> None:
    put(either, name, ball(rng, 40))
    poses = np.concatenate([rng.normal(size=(12, 4)), rng.uniform(-1.5, 1.5, (12, 3))], axis=1)
    batch = either.check_collisions(
        hulld.Placements(name, poses),
        separation=True,
        witness=True,
        normal=True,
        axis=True,
        certificate=True,
        analysis=True,
        clearance=0.1,
    )
    answers = batch.answers
    assert len(batch.pairs) == len(answers) == 66
    assert {1, 3} <= set(answers.relations.tolist())
    for row, (a, b) in enumerate(batch.pairs):
        one = either.check_collision(
            (name, poses[a]),
            (name, poses[b]),
            separation=True,
            witness=True,
            normal=True,
            axis=True,
            clearance=0.1,
        )
        assert answers.relations[row] == one.relation
        assert answers.separations[row] == one.separation.value
        assert answers.separation_bounds[row] == one.separation.bound
        np.testing.assert_array_equal(
            answers.witness_points[row], [one.witness.point_a, one.witness.point_b]
        )
        np.testing.assert_array_equal(answers.normals[row], one.normal.direction)
        assert answers[row].normal.angle_bound == one.normal.angle_bound
        assert answers.within_clearance[row] == one.within_clearance
        assert (answers.axes[row] is None) == (one.axis is None)
    assert all(certificate is not None for certificate in answers.certificates)
    assert answers.analyses[0].size_a.vertices == 40
    assert batch.hulls[name].revision == either.get_hull(name).info.revision


def test_a_batch_of_many_messages_comes_in_order(
    either: Any, name: str, rng: np.random.Generator
) -> None:
    put(either, name)
    shifts = rng.integers(0, 4, (600, 3)).astype(float)
    pairs = rng.integers(0, 600, (150000, 2))
    placements = hulld.Placements(name, shifts)
    batch = either.check_collisions(placements, pairs)
    gaps = np.abs(shifts[pairs[:, 0]] - shifts[pairs[:, 1]]).max(axis=1)
    expected = np.select([gaps == 0, gaps == 1], [3, 2], 1)
    np.testing.assert_array_equal(batch.answers.relations, expected)


def test_a_pair_without_an_answer_has_a_problem(either: Any, name: str) -> None:
    put(either, name)
    batch = either.check_collisions([name, "no/such", name])
    assert batch.answers.relations.tolist() == [0, 3, 0]
    missing = batch.problem(0)
    assert missing.code == "NOT_FOUND" and missing.reason == "HULL_NOT_FOUND"
    assert batch.problem(1) is None and batch.problem(2) is not None
    assert "no/such" not in batch.hulls
    fine = either.check_collisions([name, name])
    assert fine.problem(0) is None


def test_a_tolerance_may_leave_a_pair_open(either: Any, name: str) -> None:
    put(either, name)
    near = (name, (1 + 1e-9, 0, 0))
    assert either.check_collision(name, near).relation == hulld.Relation.SEPARATED
    loose = either.check_collision(name, (name, (1, 0, 0)), tolerance=1e-3)
    assert loose.relation == hulld.Relation.WITHIN_TOLERANCE and not loose.colliding
    with pytest.raises(hulld.InvalidArgumentError):
        either.check_collision(name, near, tolerance=1e-3, separation=True)


def test_the_textbook_agrees(either: Any, name: str) -> None:
    put(either, name)
    answer = either.check_collision(
        name, (name, (1, 0, 0)), method=hulld.Method.TEXTBOOK_SAT, analysis=True
    )
    assert answer.relation == hulld.Relation.TOUCHING and answer.analysis.axes_total > 0


def test_a_scene_finds_what_a_batch_finds(either: Any, name: str, rng: np.random.Generator) -> None:
    put(either, name)
    placements = hulld.Placements(name, rng.uniform(0, 8, (60, 3)))
    batch = either.check_collisions(placements)
    scene = either.find_collisions(placements, separation=True)
    np.testing.assert_array_equal(scene.pairs, batch.pairs[batch.answers.colliding])
    assert 0 < len(scene.pairs) == scene.totals.overlapping and scene.totals.pairs == 60 * 59 // 2
    assert (scene.answers.separations < 0).all() and scene.hulls[name].hull_id == name
    movers = either.find_collisions(placements, movers=1)
    np.testing.assert_array_equal(movers.pairs, scene.pairs[scene.pairs[:, 0] == 0])
    groups = np.arange(60) % 2
    apart = either.find_collisions(placements, groups=groups, ignore_same_group=True)
    np.testing.assert_array_equal(apart.pairs, scene.pairs[(scene.pairs.sum(axis=1) % 2) == 1])
    none = either.find_collisions(
        placements,
        groups=groups,
        ignore_same_group=True,
        ignored_group_pairs=[(0, 1)],
        separation=True,
    )
    assert none.pairs.shape == (0, 2) and none.answers.separations.shape == (0,)
    near = either.find_collisions(placements, clearance=0.5)
    assert len(near.pairs) > len(scene.pairs) and near.answers.within_clearance.all()


def test_a_stream_answers_what_moved(either: Any, name: str) -> None:
    put(either, name)
    with either.stream_collisions([name, name, (name, (9, 0, 0))], separation=True) as stream:
        assert stream.opened.answers.relations.tolist() == [3, 1, 1]
        answer = stream.update([1], [(1, 0, 0)])
        assert answer.update == 1 and answer.rows.tolist() == [0, 2]
        assert answer.pairs.tolist() == [[0, 1], [1, 2]]
        assert answer.answers.relations.tolist() == [2, 1]
        assert answer.answers.separations[0] == 0
        moves = [([1], [(x, 0, 0)]) for x in (1.5, 0.5)]
        steps = [step.answers.relations[0] for step in stream.follow(moves)]
        assert steps == [1, 3]
        either.replace_hull(name, CUBE / 4)
        # Equal poses, different hulls.
        assert stream.update([1], [(0.5, 0, 0)]).answers.relations[0] == 3
        assert stream.refresh().answers.relations[0] == 1
        with pytest.raises(ValueError, match=r"placements\[0\] is 3; indices start at 0"):
            stream.update([3], [(0, 0, 0)])
        with pytest.raises(ValueError, match="2 poses for 1"):
            stream.update([0], np.zeros((2, 3)))
        # The refused update did not end the stream.
        assert stream.update([1], [(0, 0, 0)]).answers.relations[0] == 3
    with pytest.raises(hulld.FailedPreconditionError, match="closed"):
        stream.update([1], [(0, 0, 0)])


def test_a_stream_that_the_server_ends_raises_the_reason(either: Any, name: str) -> None:
    put(either, name)
    with either.stream_collisions([name, name], only_changes=True) as stream:
        assert stream.update([1], [(0.1, 0, 0)]).answers.relations.tolist() == []
        assert stream.update([1], [(1.0, 0, 0)]).answers.relations.tolist() == [2]
        for _ in range(2):
            with pytest.raises(hulld.InvalidArgumentError) as caught:
                # The client itself would refuse to send this.
                stream._ask(update_stream(np.zeros(2, np.uint32), np.ones((2, 7)), False))
            assert caught.value.reason == "INVALID_REQUEST"


# --- Watches ---


def test_a_watch_reports_existing_hulls_and_changes(either: Any, name: str) -> None:
    put(either, f"{name}/a")
    reported: dict[str, str] = {}
    with either.watch_hulls(f"{name}/") as watch:
        changes = next(watch)
        while not changes.synced:
            reported |= {event.hull.hull_id: event.kind.name for event in changes.events}
            changes = next(watch)
        assert reported == {f"{name}/a": "PRESENT"}
        either.create_hull(f"{name}/b")
        put(either, f"{name}/a", 2 * CUBE)
        either.delete_hull(f"{name}/b")
        while reported.get(f"{name}/a") != "CHANGED" or reported.get(f"{name}/b") == "CREATED":
            reported |= {event.hull.hull_id: event.kind.name for event in next(watch).events}
        position = watch.position
    assert list(watch) == []
    either.replace_hull(f"{name}/a", CUBE)
    with either.watch_hulls(f"{name}/", after=position) as resumed:
        changes = next(resumed)
        while not changes.events:
            changes = next(resumed)
        assert [(e.hull.hull_id, e.kind.name) for e in changes.events] == [(f"{name}/a", "PRESENT")]
        np.testing.assert_array_equal(changes.events[0].box, [[0, 0, 0], [1, 1, 1]])
        assert not changes.restarted


def test_a_watch_reports_contacts_that_begin_and_end(either: Any, name: str) -> None:
    put(either, name)
    with either.watch_collisions([name, (name, (3, 0, 0))], clearance=1.5) as watch:

        def events_of(update: int) -> list[str]:
            found: list[str] = []
            while True:
                changes = next(watch)
                found += [event.kind.name for event in changes.events]
                if changes.synced and changes.update >= update:
                    return found

        assert events_of(0) == []
        for update, (x, expected) in enumerate(
            [(2, ["NEAR"]), (1, ["TOUCH"]), (0.5, ["ENTER"]), (9, ["EXIT"])], 1
        ):
            watch.update([1], [(x, 0, 0)])
            assert events_of(update) == expected
        watch.update([1], [(1.5, 0, 0)])
        assert events_of(5) == ["NEAR"]
        either.replace_hull(name, 2 * CUBE)
        changes = next(watch)
        while not changes.events:
            changes = next(watch)
        event = changes.events[0]
        assert event.kind == hulld.CollisionEventKind.ENTER and event.placements == (0, 1)
        assert event.revisions[0] == either.get_hull(name).info.revision
    assert list(watch) == []


def test_a_collision_watch_survives_a_restart_of_its_server(
    connect: Any, tmp_path: pathlib.Path, name: str
) -> None:
    def run() -> hulld.LocalServer:
        listen = ["--listen", f"unix:{tmp_path}/socket"]
        return hulld.LocalServer(data_dir=tmp_path / "hulls", options=listen)

    def events_of(update: int) -> dict[tuple[int, int], str]:
        found: dict[tuple[int, int], str] = {}
        while True:
            changes = next(watch)
            for event in changes.events:
                assert event.placements not in found
                found[event.placements] = event.kind.name
            if changes.synced and changes.update >= update:
                return found

    placements = [(name, (x, 0, 0)) for x in (0, 0.5, 9, 9.5, 30, 30.5, 50, 52)]
    with run() as server:
        client = connect(server.address, timeout=60)
        put(client, name)
        watch = client.watch_collisions(placements, clearance=1.5)
        assert events_of(0) == {(0, 1): "ENTER", (2, 3): "ENTER", (4, 5): "ENTER", (6, 7): "NEAR"}
        watch.update([1], [(3, 0, 0)])
        assert events_of(1) == {(0, 1): "EXIT"}
        watch.update([1], [(1, 0, 0)])
        assert events_of(2) == {(0, 1): "TOUCH"}
    watch.update([3, 7], [(15, 0, 0), (70, 0, 0)])
    watch.update([1], [(0.5, 0, 0)])
    with run() as server:
        # The unchanged pair (4, 5) is not reported again.
        assert events_of(4) == {(0, 1): "ENTER", (2, 3): "EXIT", (6, 7): "FAR"}
        client.delete_hull(name)
        assert set(events_of(4).values()) == {"LOST"}
        watch.cancel()
        assert list(watch) == []


@pytest.mark.parametrize("kind", ["hulls", "collisions"])
def test_another_thread_ends_a_watch(client: hulld.Client, name: str, kind: str) -> None:
    put(client, name)
    watch = client.watch_hulls(name) if kind == "hulls" else client.watch_collisions([name, name])
    synced, seen = threading.Event(), []

    def follow() -> None:
        for changes in watch:
            seen.append(changes)
            if changes.synced:
                synced.set()

    follower = threading.Thread(target=follow)
    follower.start()
    assert synced.wait(60)
    watch.cancel()
    follower.join(60)
    assert not follower.is_alive() and seen


def test_many_threads_use_one_client(client: hulld.Client, name: str) -> None:
    put(client, name)
    shifts = np.linspace(0, 2, 65)
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        found = list(
            pool.map(lambda x: client.check_collision(name, (name, (x, 0, 0))).relation, shifts)
        )
    assert found == [3] * 32 + [2] + [1] * 32


# --- Rows, and short texts ---


def test_answers_are_read_row_by_row(either: Any, name: str) -> None:
    put(either, name)
    scene = [name, (name, (1, 0, 0)), (name, (3, 0, 0)), "no/such"]
    batch = either.check_collisions(scene, separation=True, witness=True, clearance=0.5)
    assert len(batch) == len(batch.answers) == 6
    first = batch[0]
    assert first.pair == (0, 1) and first.relation is hulld.Relation.TOUCHING and first.colliding
    assert first.separation == hulld.Separation(0.0, 0.0) and first.within_clearance is True
    assert first.witness is not None and first.witness.point_a.shape == (3,)
    assert batch[1].separation is not None and batch[1].within_clearance is False
    lost = batch[-1]
    assert lost.pair == (2, 3) and lost.relation is hulld.Relation.UNSPECIFIED
    assert lost.problem is not None and lost.problem.code == "NOT_FOUND"
    assert lost.separation is None and lost.within_clearance is None
    assert [row.pair for row in batch] == [tuple(pair) for pair in batch.pairs.tolist()]
    assert [row.relation for row in batch.answers] == batch.answers.relations.tolist()
    for row in (6, -7):
        with pytest.raises(IndexError):
            batch[row]
    with pytest.raises(TypeError, match="neither true nor false"):
        bool(batch[0])
    with pytest.raises(TypeError, match="neither true nor false"):
        bool(batch)


def test_reprs_are_short(either: Any, name: str) -> None:
    put(either, name)
    wanted = {"separation": True, "witness": True, "axis": True, "certificate": True}
    answer = either.check_collision(name, (name, (2, 0, 0)), **wanted)
    assert repr(answer).startswith(f"Collision({name}@{answer.hull_a.revision}, {name}@")
    assert "SEPARATED" in repr(answer) and "separation=0.99" in repr(answer)
    assert len(repr(answer)) < 200 + 2 * len(name)
    batch = either.check_collisions(hulld.Placements(name, np.zeros((20, 3))), **wanted)
    assert repr(batch) == "Batch(190 pairs: 190 OVERLAPPING)"
    assert repr(batch.answers) == "Answers(190 pairs: 190 OVERLAPPING)"
    assert repr(batch[0]).startswith("AnswerRow(pair=(0, 1), OVERLAPPING")
    assert len(repr(batch[0])) < 200
    scene = either.find_collisions([name, (name, (3, 0, 0))])
    assert repr(scene) == "Scene(0 pairs)"
    mesh, hull = either.get_hull_mesh(name), either.get_hull(name)
    assert repr(mesh) == f"HullMesh({name}@{mesh.info.revision}, 8 vertices, 6 facets)"
    assert repr(hull) == f"Hull({name}@{hull.info.revision}, dimension 3, 8 vertices)"
