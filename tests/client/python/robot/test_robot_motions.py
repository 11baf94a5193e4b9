"""Motions of robots between waypoints: the same contacts as `hullctl robot check --continuous`."""

from __future__ import annotations

import json
import math
import pathlib
import subprocess
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import hulld
from hulld.robot.kinematics import joint_values, link_poses
from hulld.robot.motion_bounds import MAX_TURN, align_turns, bound_motions
from hulld.robot.urdf import read_urdf
from test_robot_checks import ALL_KINDS, ALL_SRDF
from test_robot_meshes import TRIANGLES, binary_stl, box_obj

#: Past a wall that a ball of radius 1/4 on an arm of length 1 enters only near angle 0.
SWING_PAST = [[-1.5], [-0.5], [0.6], [1.5]]


def swing(wall: str) -> str:
    """The wall starts 0.5 before `wall`; the ball reaches to x = 1.25 at the angle 0."""
    return f"""<robot name="swing">
      <link name="wall"><collision><origin xyz="{wall} 0 0"/>
        <geometry><box size="1 4 4"/></geometry></collision></link>
      <joint name="hinge" type="continuous"><parent link="wall"/><child link="arm"/>
        <axis xyz="0 0 1"/></joint>
      <link name="arm"><collision><origin xyz="1 0 0"/>
        <geometry><sphere radius="0.25"/></geometry></collision></link>
    </robot>"""


Make = Callable[..., hulld.Robot]


@pytest.fixture
def make(tmp_path: pathlib.Path, client: hulld.Client, request: pytest.FixtureRequest) -> Make:
    """Makes a robot that checks all pairs."""

    def robot(urdf: str) -> hulld.Robot:
        (tmp_path / "robot.urdf").write_text(urdf)
        made = hulld.Robot.from_urdf(tmp_path / "robot.urdf", client=client, adjacent=True)
        request.addfinalizer(made.close)
        return made

    return robot


def test_a_graze_between_waypoints_is_found(make: Make) -> None:
    robot = make(swing("1.7499"))
    assert robot.check(SWING_PAST).first_contact is None
    check = robot.check_motion(SWING_PAST)
    contact = check.first_contact
    assert contact is not None and not check.is_free and not check.undecided
    assert contact.waypoint == 1 and contact.pair == ("wall", "arm")
    assert contact.relation == hulld.Relation.OVERLAPPING
    # acos(0.9999) before the middle, of 1.1.
    exact = (0.5 - math.acos(0.9999)) / 1.1
    assert contact.contact_time is not None
    assert contact.separated_until <= exact <= contact.contact_time
    assert contact.contact_time - contact.separated_until < 1e-5
    assert "first_contact=MotionContact(waypoint=1" in repr(check)
    with pytest.raises(TypeError, match="is_free"):
        bool(check)


def test_a_free_motion_is_proven_with_its_clearance(make: Make) -> None:
    # 1e-4 from the ball.
    robot = make(swing("1.7501"))
    assert robot.check_motion(SWING_PAST).is_free
    assert robot.check_motion(SWING_PAST, clearance=9.9e-5).is_free
    near = robot.check_motion(SWING_PAST, clearance=1.1e-4).first_contact
    assert near is not None and near.relation == hulld.Relation.SEPARATED
    assert repr(robot.check_motion(SWING_PAST)) == "MotionCheck(4 waypoints, free)"


@pytest.mark.parametrize("wall,free", [("1.75000001", True), ("1.74999999", False)])
def test_narrow_misses_and_shallow_grazes_are_decided(make: Make, wall: str, free: bool) -> None:
    assert make(swing(wall)).check_motion(SWING_PAST).is_free == free


def test_an_approach_within_rounding_is_undecided(make: Make) -> None:
    check = make(swing("1.7500000000000009")).check_motion(SWING_PAST)
    assert check.first_contact is None and not check.is_free
    (undecided,) = check.undecided
    assert (undecided.waypoint, undecided.contact_time, undecided.relation) == (1, None, None)
    assert undecided.separated_until == pytest.approx(0.5 / 1.1, abs=1e-3)


def test_a_contact_at_a_waypoint_is_found_there(make: Make) -> None:
    robot = make(swing("1.5"))
    first = robot.check_motion([[0], [1.5]]).first_contact
    assert first is not None and (first.separated_until, first.contact_time) == (0, 0)
    # Several turns between two waypoints.
    assert robot.check_motion([[3], [40]]).first_contact is not None


def test_a_scene_is_at_rest(make: Make, client: hulld.Client, name: str) -> None:
    robot = make(swing("9"))
    client.append_points(name, [[x, y, z] for x in (1.2, 2) for y in (-1, 1) for z in (-1, 1)],
                         create=True)
    check = robot.check_motion({"hinge": [-2, 2]}, scene=[name], ignore=[("wall", name)])
    assert check.first_contact is not None and check.first_contact.pair == ("arm", name)
    apart = robot.check_motion({"hinge": [-2, 2]}, scene=[(name, (0.1, 0, 0))])
    assert apart.is_free
    with pytest.raises(ValueError, match="must be at rest"):
        robot.check_motion(SWING_PAST, scene=[hulld.Placement(name, end_pose=(1, 0, 0))])
    with pytest.raises(hulld.NotFoundError, match=f"wall with {name}-absent: "):
        robot.check_motion(SWING_PAST, scene=[f"{name}-absent"])


@pytest.mark.parametrize(
    "arguments,options,message",
    [
        ([[0.5]], {}, "1 waypoints; a motion needs at least 2"),
        ([0.5], {}, "1 waypoints"),
        ([[0], [1e5]], {}, "arm turns or moves too far between waypoints 0 and 1"),
        ([[0], [1]], {"clearance": -1}, "clearance"),
        ([[0], [1]], {"resolution": math.nan}, "resolution"),
    ],
)
def test_wrong_arguments_are_refused(
    make: Make, arguments: Any, options: dict[str, float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        make(swing("1.5")).check_motion(arguments, **options)


def test_contacts_are_those_of_hullctl(
    tmp_path: pathlib.Path, client: hulld.Client, server: hulld.LocalServer,
    rng: np.random.Generator
) -> None:
    (tmp_path / "all.urdf").write_text(ALL_KINDS)
    (tmp_path / "all.srdf").write_text(ALL_SRDF)
    (tmp_path / "parts.obj").write_text(box_obj("o a", 0, 1) + box_obj("o b", 1.5, 9))
    solid = np.concatenate([TRIANGLES, TRIANGLES[:, ::-1]])
    (tmp_path / "part.stl").write_bytes(binary_stl(solid))
    with hulld.Robot.from_urdf(
        tmp_path / "all.urdf", client=client, srdf=tmp_path / "all.srdf"
    ) as robot:
        lower, upper = np.clip(robot.limits.T, -2, 2)
        path = rng.uniform(lower, upper, (6, robot.dof))
        check = robot.check_motion(path)
        rows = [",".join(robot.variables), *(",".join(map(repr, row)) for row in path.tolist())]
        (tmp_path / "path.csv").write_text("\n".join(rows))
        command = [str(hulld.find_program("hullctl")), "robot", "check", "all.urdf", "--srdf",
                   "all.srdf", "--trajectory", "path.csv", "--continuous"]
        said = subprocess.run(
            [*command, "--server", server.address, "--output", "json"], cwd=tmp_path, check=True,
            capture_output=True, text=True,
        ).stdout
    theirs = {}
    for event in map(json.loads, said.splitlines()):
        if event["event"] == "CONTACT":
            theirs[(event["a"], event["b"])] = event
    assert {one.pair for one in check.contacts} == theirs.keys()
    assert len(theirs) > 3
    for one in check.contacts:
        event = theirs[one.pair]
        assert one.waypoint + 1 == int(event["waypoint"])
        time = event["firstContact"]["contactTime"]
        # The bounds differ in the last places.
        assert one.contact_time == pytest.approx(time, abs=1e-6)
        assert one.separated_until <= time
    assert list(check.contacts) == sorted(
        check.contacts, key=lambda one: (one.waypoint, one.contact_time)
    )


def test_bounds_hold_for_sampled_motions(
    tmp_path: pathlib.Path, rng: np.random.Generator
) -> None:
    (tmp_path / "all.urdf").write_text(ALL_KINDS)
    robot = read_urdf(tmp_path / "all.urdf")
    X_WB = [2.0, 1.0, 0.0, -1.0, 100.0, 0.0, 7.0]
    path = rng.uniform(-2, 2, (8, len(robot.variables)))
    values = joint_values(robot, path)
    align_turns(robot, values)

    def rows(index: Any) -> list[list[Any]]:
        return [[c if isinstance(c, float) else c[index] for c in value] for value in values]

    bounds = bound_motions(robot, X_WB, rows(slice(None, -1)), rows(slice(1, None)))
    begin, end = rows(slice(None, -1)), rows(slice(1, None))

    def places(t: float) -> list[np.ndarray]:
        """The pose of each link: 7 x segments."""
        between = [[(1 - t) * a + t * b for a, b in zip(*pair)] for pair in zip(begin, end)]
        poses = link_poses(robot, X_WB, between)
        return [np.array([np.broadcast_to(c, len(path) - 1) for c in pose]) for pose in poses]

    def moved(pose: np.ndarray, p: np.ndarray) -> np.ndarray:
        w, v = pose[0], pose[1:4]
        crossed = np.cross(v, p, axisb=0 if p.ndim > 1 else -1, axisa=0).T
        scale = 2 / (pose[:4] ** 2).sum(axis=0)
        return p[:, np.newaxis] + scale * (w * crossed + np.cross(v, crossed, axis=0)) + pose[4:]

    def unit(pose: np.ndarray) -> np.ndarray:
        return np.concatenate([pose[:4] / np.sqrt((pose[:4] ** 2).sum(axis=0)), pose[4:]])

    point = np.array([0.3, -0.4, 1.2])
    tightest = 0.0
    for duration in (0.125, 2.0**-6, 2.0**-12):
        first, last = places(0.625), places(0.625 + duration)
        for t in (0.25, 0.5, 1.0):
            now = places(0.625 + t * duration)
            for link, bound in enumerate(bounds):
                linear = (1 - t) * unit(first[link]) + t * unit(last[link])
                apart = np.linalg.norm(moved(now[link], point) - moved(linear, point), axis=0)
                most = np.broadcast_to(bound.deviation(duration, 1.3), apart.shape)
                counts = np.broadcast_to(bound.turn * duration <= MAX_TURN, apart.shape)
                assert (apart <= most)[counts].all()
                way = np.linalg.norm(moved(now[link], point) - moved(first[link], point), axis=0)
                assert (way <= bound.travel(duration, 1.3) + 1e-13).all()
                if counts.any() and duration == 2.0**-6:
                    tightest = max(tightest, float((apart / most)[counts].max()))
    # The bound is tight enough to matter.
    assert tightest > 0.05
