"""Invalid arguments raise a ValueError or TypeError that names them, before anything is sent."""

from __future__ import annotations

import decimal
import fractions
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import hulld
from conftest import CUBE
from fake_hulld import FakeHulld

INEXACT = 2**53 + 1


@pytest.fixture
def silent(connect: Callable[..., Any]) -> Any:
    """A client without a server: a call would fail."""
    return connect("unix:/nonexistent/hulld", timeout=60)


def masked(values: Any, at: Any) -> Any:
    array = np.ma.array(values, mask=False)
    array[at] = np.ma.masked
    return array


# --- Masked elements ---


def test_masked_points_are_refused_with_a_remedy(silent: Any) -> None:
    points = masked(CUBE.copy(), (5, 1))
    message = r"points has masked elements in 1 of 8 rows, the first at \[5\].*compress_rows"
    for call in (
        lambda: hulld.as_points(points),
        lambda: silent.append_points("a", points),
        lambda: silent.replace_hull("a", points),
    ):
        with pytest.raises(ValueError, match=message):
            call()
    with pytest.raises(ValueError, match="masked"):
        hulld.as_points([points[5], points[6]])
    with pytest.raises(ValueError, match="masked"):
        hulld.as_points([[0, 0, 0], [0, np.ma.masked, 0]])
    assert hulld.as_points(np.ma.compress_rows(points)).shape == (7, 3)
    assert hulld.as_points(np.ma.array(CUBE)).tolist() == CUBE.tolist()


def test_masked_poses_pairs_and_indices_are_refused(silent: Any) -> None:
    poses = masked(np.zeros((2, 3)), (1, 2))
    for call in (
        lambda: hulld.pack_poses(poses),
        lambda: hulld.pack_poses([None, poses[1]]),
        lambda: hulld.Placements("a", poses),
        lambda: silent.check_collision("a", ("b", poses[1])),
        lambda: silent.check_collisions(["a", "b"], masked([(0, 1)], (0, 1))),
        lambda: hulld.Placements(["a"], None, masked([0, 0], 1)),
        lambda: silent.find_collisions(["a", "b"], groups=masked([0, 1], 1)),
        lambda: silent.check_collision("a", "b", tolerance=masked([0.0], 0)[0]),
    ):
        with pytest.raises((ValueError, TypeError), match="masked|tolerance is"):
            call()


# --- Numbers ---


@pytest.mark.parametrize(
    "number",
    [
        INEXACT,
        -INEXACT,
        np.int64(INEXACT),
        np.uint64(2**64 - 1),
        10**400,
        fractions.Fraction(1, 3),
        np.longdouble(1) / 3,
    ],
)
def test_numbers_that_no_double_represents_are_refused(silent: Any, number: Any) -> None:
    cube = ("a", "b")
    for call in (
        lambda: hulld.Pose((1, 0, 0, 0), (number, 0, 0)),
        lambda: hulld.Pose((number, 0, 0, 0)),
        lambda: hulld.pack_poses([(number, 0, 0)]),
        lambda: hulld.pack_poses([(number, 0.5, 0)]),
        lambda: hulld.as_points([[number, 0.5, 0]]),
        lambda: silent.check_collision(*cube, tolerance=number),
        lambda: silent.check_collision(*cube, clearance=number),
        lambda: silent.check_collision(*cube, separation=True, max_error=number),
        lambda: silent.check_collisions(cube, tolerance=number),
        lambda: silent.find_collisions(cube, clearance=number),
        lambda: silent.stream_collisions(cube, tolerance=number),
        lambda: silent.watch_collisions(cube, clearance=number),
        lambda: silent.get_hull_mesh("a", side="inside", max_error=number),
    ):
        with pytest.raises(ValueError, match="no double represents|at least 0"):
            call()


def test_numbers_of_other_types_are_accepted_if_a_double_represents_them() -> None:
    for number in (2**53, np.int8(3), np.float32(0.1), np.longdouble(0.5), np.array(2.0)):
        assert hulld.Pose((1, 0, 0, 0), (number, 0, 0)).translation[0] == float(number)
    assert hulld.as_points([[2**60, 0.5, 0]]).tolist() == [[2.0**60, 0.5, 0]]
    assert hulld.as_points(np.array([[1, 2, 3]], object)).tolist() == [[1, 2, 3]]


@pytest.mark.parametrize(
    "array",
    [
        np.zeros((2, 3), bool),
        np.zeros((2, 3), complex),
        np.zeros((2, 3), "M8[s]"),
        np.zeros((2, 3), "m8[s]"),
        np.full((2, 3), "1"),
        np.full((2, 3), b"1"),
        np.full((2, 3), None),
        np.full((2, 3), decimal.Decimal(1)),
        np.zeros((2, 3), "i4,i4"),
    ],
)
def test_arrays_without_numbers_are_refused(array: Any) -> None:
    for call in (hulld.as_points, hulld.pack_poses, lambda a: hulld.Placements("a", a)):
        with pytest.raises(TypeError):
            call(array)


@pytest.mark.parametrize("value", [True, np.True_, "1", 1j, None, decimal.Decimal(1)])
def test_scalars_that_are_not_numbers_are_refused(silent: Any, value: Any) -> None:
    for call in (
        lambda: hulld.Pose((1, 0, 0, 0), (value, 0, 0)),
        lambda: silent.check_collision("a", "b", tolerance=value),
    ):
        with pytest.raises(TypeError, match="it must be a number"):
            call()


@pytest.mark.parametrize("value", [-1, float("nan"), -1e-300])
def test_lengths_are_at_least_zero(silent: Any, value: float) -> None:
    for option in ("tolerance", "clearance", "max_error"):
        with pytest.raises(ValueError, match=option):
            silent.check_collision("a", "b", **{option: value})


# --- Poses ---


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        ((0, np.nan, 0), "nan"),
        ((0, np.inf, 0), "inf"),
        ((1, 0, 0, 0, 0, 0, np.nan), "nan"),
        ((0, 0, 0, 0, 1, 2, 3), "zero"),
        (np.full((4, 4), np.nan), "not finite"),
    ],
)
def test_invalid_poses_are_named(silent: Any, pose: Any, message: str) -> None:
    for call in (
        lambda: silent.check_collision("a", ("b", pose)),
        lambda: silent.check_collisions(["a", ("b", pose)]),
        lambda: silent.find_collisions(["a", ("b", pose)]),
        lambda: silent.stream_collisions(["a", ("b", pose)]),
        lambda: silent.watch_collisions(["a", ("b", pose)]),
        lambda: silent.put_body("c", ["a", ("b", pose)]),
    ):
        with pytest.raises(ValueError, match=rf"poses\[1\].*{message}"):
            call()
    with pytest.raises(ValueError, match=rf"poses\[0\].*{message}"):
        hulld.Placements("a", np.array([pose], float))
    for bad in (((0, 0, 0, 0),), ((1, 0, 0, np.nan),), ((1, 0, 0, 0), (0, np.inf, 0))):
        with pytest.raises(ValueError):
            hulld.Pose(*bad)


def test_a_wrong_update_does_not_end_the_stream(either: Any, name: str) -> None:
    either.append_points(name, CUBE, create=True)
    with either.stream_collisions([name, name]) as stream:
        for placements, poses in (
            ([1], [(np.nan, 0, 0)]),
            ([1], [(0, 0, 0, 0, 0, 0, 0)]),
            ([1], np.full((1, 4, 4), np.nan)),
            ([2], [(0, 0, 0)]),
            ([0, 0], np.zeros((2, 3))),
            ([0], np.zeros((2, 3))),
            (masked([0, 1], 0), np.zeros((2, 3))),
        ):
            with pytest.raises(ValueError):
                stream.update(placements, poses)
        step = stream.update([1], [(3, 0, 0)])
        assert step.update == 1
        assert step[0].relation == hulld.Relation.SEPARATED


def test_matrices_of_floats_pass_with_a_tolerance(either: Any, name: str) -> None:
    either.append_points(name, CUBE, create=True)
    X = hulld.Pose((0.3, -0.7, 0.2, 0.9), (3, 0, 0)).matrix().astype(np.float32)
    pair, tolerance = [name, (name, X)], {"orthogonality_tolerance": 1e-6}
    with pytest.raises(ValueError, match=r"poses\[1\].*from the identity by .*e-0\d,") as refused:
        either.check_collisions(pair)
    assert "orthogonality_tolerance=1e-0" in str(refused.value)
    answer = either.check_collision(*pair, certificate=True, **tolerance)
    assert answer.relation == hulld.Relation.SEPARATED
    assert either.check_collisions(pair, **tolerance)[0].relation == answer.relation
    assert len(either.find_collisions(pair, **tolerance)) == 0
    with either.stream_collisions(pair, **tolerance) as stream:
        assert stream.update([1], [X])[0].relation == answer.relation
    with either.watch_collisions(pair, **tolerance) as watch:
        watch.update([1], [X])
        assert next(watch).synced
    either.put_body(f"{name}/body", [(name, X)], **tolerance)
    packed = hulld.Placements(name, np.stack([X, X]), **tolerance)
    assert hulld.pack_poses([X], **tolerance).tolist() == packed.poses[:1].tolist()


def test_a_certificate_is_verified_with_the_same_tolerance(client: hulld.Client, name: str) -> None:
    client.append_points(name, CUBE, create=True)
    X = hulld.Pose((0.3, -0.7, 0.2, 0.9), (3, 0, 0)).matrix().astype(np.float32)
    answer = client.check_collision(name, (name, X), certificate=True, orthogonality_tolerance=1e-6)
    verifier = hulld.Verifier(client)
    verifier.check(name, (name, X), answer, orthogonality_tolerance=1e-6)
    with pytest.raises(ValueError, match="orthogonality_tolerance"):
        verifier.check(name, (name, X), answer)


def test_quaternions_are_taken_in_either_order() -> None:
    xyzw = np.array([[0.1, 0.2, 0.3, 0.9, 1, 2, 3]])
    wxyz = [[0.9, 0.1, 0.2, 0.3, 1, 2, 3]]
    assert hulld.pack_poses(xyzw, quaternion_order="xyzw").tolist() == wxyz
    assert hulld.pack_poses(list(xyzw), quaternion_order="xyzw").tolist() == wxyz
    assert hulld.Placements("a", xyzw, quaternion_order="xyzw").poses.tolist() == wxyz
    pose = hulld.Pose(tuple(xyzw[0, :4]), (1, 2, 3), quaternion_order="xyzw")
    assert pose == hulld.Pose.from_packed(wxyz[0])
    assert pose == hulld.Pose.from_packed(xyzw[0], quaternion_order="xyzw")
    for order in ("wzyx", "", None):
        with pytest.raises((ValueError, TypeError)):
            hulld.pack_poses(xyzw, quaternion_order=order)  # type: ignore[arg-type]


# --- IDs, counts, groups, and times ---


@pytest.mark.parametrize(
    "bad", ["", "a//b", "/a", "a/", "a b", "ä", "-a", "a" * 257, 3, None, b"a"]
)
def test_malformed_ids_are_refused(silent: Any, bad: Any) -> None:
    for call in (
        lambda: silent.create_hull(bad),
        lambda: silent.append_points(bad, CUBE),
        lambda: silent.open_append(bad),
        lambda: silent.replace_hull(bad, CUBE),
        lambda: silent.get_hull(bad),
        lambda: silent.get_hull_mesh(bad),
        lambda: silent.delete_hull(bad),
        lambda: silent.put_body(bad, ["a"]),
        lambda: silent.put_body("a", [bad]),
        lambda: silent.get_body(bad),
        lambda: silent.delete_body(bad),
        lambda: silent.check_collision("a", bad),
        lambda: silent.check_collisions(["a", bad]),
        lambda: silent.find_collisions(["a", bad]),
        lambda: hulld.Placements(["a", bad]),
    ):
        with pytest.raises((ValueError, TypeError)):
            call()


def test_groups_and_counts_are_checked(silent: Any) -> None:
    scene = ["a", "b", "c"]
    for options in (
        {"groups": [0, 1]},
        {"groups": [[0, 1, 2]]},
        {"groups": [0.0, 1.0, 2.0]},
        {"groups": [0, 1, -1]},
        {"groups": [0, 1, 2**32]},
        {"groups": [0, 1, 2], "ignored_group_pairs": [0, 1]},
        {"groups": [0, 1, 2], "ignored_group_pairs": [(0, -1)]},
        {"ignore_same_group": True},
        {"movers": -1},
        {"movers": 1.0},
    ):
        with pytest.raises((ValueError, TypeError), match="group|movers"):
            silent.find_collisions(scene, **options)
        with pytest.raises((ValueError, TypeError), match="group|movers"):
            silent.watch_collisions(scene, **options)
    for call in (
        lambda: silent.delete_hull("a", if_revision=-1),
        lambda: silent.delete_hull("a", if_revision=True),
        lambda: silent.append_points("a", CUBE, chunk_bytes=0),
        lambda: silent.append_points("a", CUBE, if_revision=1.5),
        lambda: silent.open_append("a", max_in_flight_chunks=0),
        lambda: silent.open_append("a", writer_id=""),
        lambda: silent.open_append("a", writer_id=7),
        lambda: list(silent.list_hulls(page_size=-1)),
        lambda: list(silent.list_hulls(3)),
        lambda: silent.get_hull_mesh("a", side="inside", max_vertices=0),
    ):
        with pytest.raises((ValueError, TypeError)):
            call()


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (hulld.Header("store", -1), "revision is -1"),
        (hulld.Header("store", 2**64), "revision is 18446744073709551616"),
        (hulld.Header("store", "7"), "revision is '7'"),  # type: ignore[arg-type]
        (hulld.Header("\udcff", 7), "which is not Unicode text"),
        (7, "7; it must be the header of an answer"),
    ],
)
def test_headers_are_checked(silent: Any, header: Any, message: str) -> None:
    with pytest.raises((ValueError, TypeError), match="after.*" + message):
        next(silent.watch_hulls(after=header))
    with pytest.raises((ValueError, TypeError), match="at_least.*" + message):
        hulld.Freshness(at_least=header)


def test_text_is_unicode(silent: Any) -> None:
    for name, call in (
        ("prefix", lambda: list(silent.list_hulls("\udcff"))),
        ("prefix", lambda: next(silent.watch_hulls("\udcff"))),
        ("writer_id", lambda: silent.open_append("a", writer_id="\udcff")),
    ):
        with pytest.raises(ValueError, match=name + r" is '\\udcff', which is not Unicode text"):
            call()


def test_placements_are_a_list(silent: Any) -> None:
    for bad in (None, 7):
        with pytest.raises(TypeError, match=f"placements is {bad}; it must be a list"):
            silent.check_collisions(bad)


@pytest.mark.parametrize("bad", [-1, float("nan"), float("inf"), 1e300, "1", True])
def test_times_are_finite_and_not_negative(silent: Any, bad: Any) -> None:
    for call in (
        lambda: hulld.Client(timeout=bad),
        lambda: hulld.AsyncClient(timeout=bad),
        lambda: silent.get_status(timeout=bad),
        lambda: silent.check_health(timeout=bad),
        lambda: silent.append_points("a", CUBE, timeout=bad),
        lambda: silent.replace_hull("a", CUBE, timeout=bad),
        lambda: silent.check_collisions(["a", "b"], timeout=bad),
        lambda: silent.stream_collisions(["a", "b"], timeout=bad),
        lambda: silent.watch_hulls(timeout=bad),
        lambda: silent.watch_collisions(["a", "b"], timeout=bad),
        lambda: hulld.Freshness(max_staleness=bad),
        lambda: hulld.RetryPolicy(initial_backoff=bad),
    ):
        with pytest.raises((ValueError, TypeError)):
            call()
    for attempts in (0, -1, 1.5):
        with pytest.raises((ValueError, TypeError), match="max_attempts"):
            hulld.RetryPolicy(max_attempts=attempts)  # type: ignore[arg-type]


# --- Addresses ---


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("localhost", "localhost:50551"),
        ("127.0.0.1", "127.0.0.1:50551"),
        ("hulls.example", "hulls.example:50551"),
        ("::1", "[::1]:50551"),
        ("[::1]", "[::1]:50551"),
        ("[::1]:7", "[::1]:7"),
        ("hulls.example:7", "hulls.example:7"),
        ("unix:/run/hulld.sock", "unix:/run/hulld.sock"),
        ("dns:///hulls.example:7", "dns:///hulls.example:7"),
    ],
)
def test_an_address_without_a_port_gets_the_default_port(given: str, meant: str) -> None:
    with hulld.Client(given) as client:
        assert client.server == meant


@pytest.mark.parametrize(
    "bad", [50551, None, b"localhost", "", ":7", "a:", "a:0", "a:65536", "a:b", "http://a:7", "a b"]
)
def test_malformed_addresses_are_refused(bad: Any) -> None:
    for kind in (hulld.Client, hulld.AsyncClient):
        with pytest.raises((ValueError, TypeError), match="server is .* it must be"):
            kind(bad)


def test_no_wrong_argument_reaches_a_server(connect: Callable[..., Any]) -> None:
    with FakeHulld() as fake:
        client = connect(fake.address)
        for call in (
            lambda: client.append_points("a", masked(CUBE.copy(), (0, 0)), create=True),
            lambda: client.append_points("a", CUBE * np.nan, create=True),
            lambda: client.get_status(timeout=-1),
            lambda: client.create_hull("a//b"),
        ):
            with pytest.raises(ValueError):
                call()
        assert fake.calls == []


def test_max_error_requests_the_separation(either: Any, name: str) -> None:
    either.append_points(name, CUBE, create=True)
    scene = [name, (name, (3, 0, 0))]
    assert either.check_collision(*scene, max_error=1e-3).separation is not None
    assert either.check_collisions(scene, max_error=1e-3).answers.separations is not None
    found = either.find_collisions(scene, max_error=1e-3, clearance=9)
    assert found.answers.separations is not None


def test_a_freshness_of_another_type_is_refused(silent: Any) -> None:
    for call in (
        lambda: silent.get_hull("a", freshness=0.2),
        lambda: silent.check_collision("a", "b", freshness=0.2),
    ):
        with pytest.raises(TypeError, match=r"freshness is 0.2; it must be a hulld.Freshness"):
            call()
