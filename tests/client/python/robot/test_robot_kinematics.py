"""Descriptions, kinematics, and shapes of robots, without a server."""

from __future__ import annotations

import pathlib
from collections.abc import Callable

import numpy as np
import pytest

import hulld
from hulld.geometry.poses import matrices_of
from hulld.robot.description import NO_MOTION, Shape
from hulld.robot.shapes import primitive_points
from hulld.robot.urdf import read_disabled_pairs, read_urdf

Write = Callable[..., pathlib.Path]

BOX = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
LIMIT = '<limit lower="-1" upper="2"/>'

# A joint of each kind.
ARM = f"""<robot name="arm">
  <link name="base">{BOX}</link>
  <joint name="j1" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 2" rpy="0.3 -0.2 0.5"/>
    <axis xyz="0 2 0"/>{LIMIT}
  </joint>
  <link name="upper">{BOX}</link>
  <joint name="j2" type="prismatic">
    <parent link="upper"/><child link="hand"/><axis xyz="0 0 3"/><limit lower="1" upper="3"/>
  </joint>
  <link name="hand">{BOX}</link>
  <joint name="j3" type="continuous">
    <parent link="hand"/><child link="finger"/><axis xyz="1 1 0"/>
    <mimic joint="j1" multiplier="-2" offset="0.5"/>
  </joint>
  <link name="finger">{BOX}</link>
  <joint name="cart" type="planar">
    <parent link="base"/><child link="wagon"/><axis xyz="0 0 1"/>
  </joint>
  <link name="wagon">{BOX}</link>
  <joint name="free" type="floating"><parent link="base"/><child link="ball"/></joint>
  <link name="ball">{BOX}</link>
  <joint name="weld" type="fixed">
    <parent link="finger"/><child link="tip"/><origin xyz="0 0 1" rpy="0 1.5 0"/>
  </joint>
  <link name="tip">{BOX}</link>
</robot>"""


@pytest.fixture
def write(tmp_path: pathlib.Path) -> Write:
    def to_file(text: str, name: str = "arm.urdf") -> pathlib.Path:
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return to_file


def turn(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    """4 x 4, by Rodrigues' formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    X = np.eye(4)
    X[:3, :3] += np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    return X


def shift(x: float, y: float, z: float) -> np.ndarray:
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


def test_variables_are_those_of_the_free_joints(write: Write) -> None:
    robot = hulld.Robot.from_urdf(write(ARM))
    # Depth first, siblings in the order of their joints' names.
    assert robot.links == ("base", "wagon", "ball", "upper", "hand", "finger", "tip")
    free = [
        f"free/{n}" for n in ("trans_x", "trans_y", "trans_z", "rot_x", "rot_y", "rot_z", "rot_w")
    ]
    assert list(robot.variables) == ["cart/x", "cart/y", "cart/theta", *free, "j1", "j2"]
    assert robot.dof == 12 and robot.limits[10:].tolist() == [[-1, 2], [1, 3]]
    assert np.isinf(robot.limits[:10]).all()
    assert robot.rest.tolist() == [0] * 9 + [1, 0, 2]
    assert repr(robot) == "Robot(arm: 12 variables, 7 parts, 17 pairs)"


def test_joints_move_their_descendants(write: Write, rng: np.random.Generator) -> None:
    robot = hulld.Robot.from_urdf(write(ARM))
    q = rng.uniform(-2, 2, (50, robot.dof))
    base = hulld.Pose((0.5, 0.1, -0.7, 0.3), (1, 2, 3))
    found = robot.link_poses(q, base=base)
    assert found.shape == (50, 7, 7)
    assert (robot.link_poses(q[7], base=base) == found[7]).all()
    X_WB = base.matrix()
    for row, poses in zip(q, found):
        x, y, theta, tx, ty, tz, rx, ry, rz, rw, j1, j2 = row
        free = hulld.Pose((rw, rx, ry, rz), (tx, ty, tz)).matrix()
        rpy = turn((0, 0, 1), 0.5) @ turn((0, 1, 0), -0.2) @ turn((1, 0, 0), 0.3)
        upper = shift(0, 0, 2) @ rpy @ turn((0, 1, 0), j1)
        hand = upper @ shift(0, 0, j2)
        finger = hand @ turn((1, 1, 0), -2 * j1 + 0.5)
        tip = finger @ shift(0, 0, 1) @ turn((0, 1, 0), 1.5)
        wagon = shift(x, y, 0) @ turn((0, 0, 1), theta)
        expected = [np.eye(4), wagon, free, upper, hand, finger, tip]
        assert np.allclose(matrices_of(poses), [X_WB @ X for X in expected], atol=1e-12)


@pytest.mark.parametrize("axis", ["0 0 -1", "0 1 0", "1 2 3"])
def test_planar_joints_move_in_the_plane_of_their_axis(write: Write, axis: str) -> None:
    text = ARM.replace(
        '<child link="wagon"/><axis xyz="0 0 1"/>', f'<child link="wagon"/><axis xyz="{axis}"/>'
    )
    robot = hulld.Robot.from_urdf(write(text))
    n = np.array([float(word) for word in axis.split()])
    poses = robot.link_poses(
        {"cart/x": [3.0, 0, 0], "cart/y": [0, 4.0, 0], "cart/theta": [0, 0, 1.0]}
    )
    x, y, turned = matrices_of(poses[:, robot.links.index("wagon")])
    for moved, length in ((x, 3), (y, 4)):
        assert abs(n @ moved[:3, 3]) < 1e-12
        assert np.linalg.norm(moved[:3, 3]) == pytest.approx(length)
    n /= np.linalg.norm(n)
    # x, y, and the normal are right-handed.
    assert np.cross(x[:3, 3] / 3, y[:3, 3] / 4) @ n == pytest.approx(1)
    assert np.allclose(turned, turn(tuple(n), 1.0))


def test_configurations_are_checked(write: Write) -> None:
    robot = hulld.Robot.from_urdf(write(ARM))
    rest = robot.rest
    for q, message in (
        (rest[:5], r"q has the shape \(5,\); arm expects \(12,\) or \(n, 12\): cart/x, "),
        (np.tile(rest, (2, 2, 1)), r"q has the shape \(2, 2, 12\)"),
        (np.where(np.arange(12) == 3, np.nan, rest), r"q\[3\] is nan"),
        (np.zeros((2, 12)), r"q\[0\]: the quaternion of free is zero"),
        (np.ma.array(rest, mask=rest == 1), "masked"),
        ({"elbow": 1}, "'elbow' is not a variable of arm, which has cart/x"),
        ({"j3": 1}, "'j3' is not a variable"),
        ({"j1": [1, 2], "j2": [1, 2, 3]}, "the same n for all"),
        ({"j1": np.inf}, "inf"),
    ):
        with pytest.raises(ValueError, match=message):
            robot.link_poses(q)
    with pytest.raises(TypeError):
        robot.link_poses(["a"] * 12)
    assert robot.link_poses({"j1": [0, 1], "j2": 2}).shape == (2, 7, 7)


# --- Descriptions ---


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
def test_names_are_read_in_any_encoding(tmp_path: pathlib.Path, encoding: str) -> None:
    path = tmp_path / "a.urdf"
    path.write_bytes('<robot name="r"><link name="Körper"/></robot>'.encode(encoding))
    assert read_urdf(path).links[0].name == "Körper"


# Atlas has spheres of radius 0, and the Kinova arms have a box of size 0.
@pytest.mark.parametrize("shape", ['<box size="0 0 0"/>', '<sphere radius="0"/>'])
def test_sizes_may_be_zero(write: Write, shape: str) -> None:
    description = read_urdf(write(ARM.replace('<box size="1 1 1"/>', shape, 1)))
    assert set(description.links[0].shapes[0].size) == {0}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("</robot>", "", "[0-9]+: not valid XML"),
        ("<robot", '<!DOCTYPE r [<!ENTITY a "b">]><robot', "1: document types are not supported"),
        (
            '<link name="hand">',
            '<xacro:m name="hand"/><link name="hand">',
            "11: <xacro:m> is a mac",
        ),
        ('<link name="hand">', '<include filename="a"/><link name="hand">', "<include> is a macro"),
        ('"0 0 3"', '"0 0 ${z}"', "'\\${z}' is not a finite number; expand .* with 'xacro'"),
        ("robot", "scene", "1: the outermost element is <scene>, not <robot>"),
        (' name="arm"', "", '1: <robot> lacks name="..."'),
        (
            'name="wagon"',
            'name="ball"',
            "22: link 'ball' is defined twice; the first .* in line 20",
        ),
        ('"j2" type', '"j1" type', "8: joint 'j1' is defined twice"),
        ('type="prismatic"', 'type="screw"', "8: joint 'j2' has type 'screw'; types are fixed"),
        ('<child link="hand"/>', "", "8: joint 'j2' lacks <child"),
        ('<child link="hand"/>', '<child link="x"/>', "9: joint 'j2' has a child .* 'x'"),
        (
            '<child link="hand"/>',
            '<child link="ball"/>',
            "21: link 'ball' is the child of two joints",
        ),
        ('<parent link="upper"/>', '<parent link="tip"/>', "11: link 'hand' is part of a cycle"),
        ('"0 0 3"', '"0 0 0"', "9: <axis> xyz must not be 0 0 0"),
        ('"0 0 3"', '"0 0"', "9: <axis> xyz needs 3 numbers, got 2"),
        ('"0 0 3"', '"0 0 nan"', "9: <axis> xyz: 'nan' is not a finite number"),
        ('"0 0 3"', '"0 0 1e999"', "'1e999' is not a finite number"),
        ('"0 0 3"', '"0 0 1_0"', "'1_0' is not a finite number"),
        (LIMIT, "", "3: joint 'j1' lacks <limit"),
        ('<axis xyz="0 0 1"/>', "", "17: joint 'cart' lacks <axis"),
        ('joint="j1"', 'joint="j9"', "14: joint 'j3' mimics a joint that does not exist: 'j9'"),
        ('joint="j1"', 'joint="j3"', "12: joint 'j3' mimics itself"),
        ('joint="j1"', 'joint="cart"', "14: joint 'cart' is planar"),
        ('<box size="1 1 1"/>', '<box size="1 -1 1"/>', "2: <box> size must not be negative"),
        ('<box size="1 1 1"/>', '<box size="1 1"/>', "2: <box> size needs 3 numbers, got 2"),
        (
            '<box size="1 1 1"/>',
            '<cone size="1 1"/>',
            "2: <geometry> contains 'cone'; it must contain a box",
        ),
        (
            "</geometry></collision>",
            '</geometry><geometry><sphere radius="1"/></geometry></collision>',
            "2: <collision> contains <geometry> twice; remove one of them",
        ),
        (LIMIT, LIMIT + LIMIT, "5: <joint> contains <limit> twice"),
        ('<box size="1 1 1"/>', "", "2: <geometry> contains nothing"),
        (
            '<box size="1 1 1"/>',
            '<box size="1 1 1"/><sphere radius="1"/>',
            "2: <geometry> contains several shapes",
        ),
        (
            "<geometry><box",
            '<origin rot="1 0 0"/><geometry><box',
            "<origin> has no attribute 'rot'",
        ),
        (
            "<geometry><box",
            '<origin rpy="0 0 0" quat_xyzw="0 0 0 1"/><geometry><box',
            "<origin> has both rpy and quat_xyzw",
        ),
        (
            "<geometry><box",
            '<origin quat_xyzw="0 0 0 0"/><geometry><box',
            "quat_xyzw is not a unit quaternion",
        ),
        ('<box size="1 1 1"/>', '<cylinder radius="1"/>', '2: <cylinder> lacks length="..."'),
        ('<box size="1 1 1"/>', '<mesh scale="1 1 1"/>', '2: <mesh> lacks filename="..."'),
        (
            '<box size="1 1 1"/>',
            '<mesh filename="a" scale="1 0 1"/>',
            "2: <mesh> scale must not be",
        ),
        (BOX, "", "arm.urdf: no link has a <collision> element"),
    ],
)
def test_defects_of_a_description_are_named(write: Write, old: str, new: str, message: str) -> None:
    assert old in ARM
    with pytest.raises(ValueError, match=message) as refused:
        hulld.Robot.from_urdf(write(ARM.replace(old, new)))
    assert "arm.urdf:" in str(refused.value)


def test_origins_may_have_quaternions(write: Write) -> None:
    origin = '<origin quat_xyzw="0 0 3 4" xyz="1 2 3"/><geometry><box'
    robot = read_urdf(write(ARM.replace("<geometry><box", origin, 1)))
    assert robot.links[0].shapes[0].X_LS == (0.8, 0, 0, 0.6, 1, 2, 3)


def test_other_arguments_are_checked(write: Write) -> None:
    with pytest.raises(FileNotFoundError):
        hulld.Robot.from_urdf("/nowhere/arm.urdf")
    for client in (hulld.AsyncClient(), "localhost"):
        with pytest.raises(TypeError, match="it must be a hulld.Client"):
            hulld.Robot.from_urdf(write(ARM), client=client)  # type: ignore[arg-type]


def test_joints_that_mimic_need_no_limit(write: Write) -> None:
    text = ARM.replace('"j3" type="continuous"', '"j3" type="revolute"')
    assert len(hulld.Robot.from_urdf(write(text)).limits) == 12


def test_neighbors_are_found_through_bare_links(write: Write) -> None:
    def link(name: str, has_shape: bool) -> str:
        return f'<link name="{name}">{BOX if has_shape else ""}</link>'

    def joint(parent: str, child: str, kind: str = "fixed") -> str:
        return (
            f'<joint name="{parent}{child}" type="{kind}"><parent link="{parent}"/>'
            f'<child link="{child}"/></joint>'
        )

    # A bare root with two branches; b carries two bare links, with d and e below them.
    text = (
        '<robot name="r">'
        + "".join(link(name, name in "abdefg") for name in "rabcde" + "xfg")
        + joint("r", "a") + joint("r", "b") + joint("b", "c") + joint("c", "d") + joint("b", "x")
        + joint("x", "e") + joint("c", "f") + joint("r", "g", "floating") + "</robot>"
    )  # fmt: skip
    robot = read_urdf(write(text))
    names = [one.name for one in robot.links]
    found = {"".join(sorted(names[a] + names[b])) for a, b in robot.adjacent_pairs()}
    assert found == {"ab", "bd", "bf", "df", "be"}


def test_disabled_pairs_are_read(write: Write) -> None:
    robot = read_urdf(write(ARM))
    names = [link.name for link in robot.links]
    path = write(
        '<robot name="arm">\n<disable_default_collisions link="ball"/>\n'
        '<enable_collisions link1="hand" link2="ball"/>\n'
        '<disable_collisions link1="tip" link2="base" reason="Never"/>\n</robot>',
        "arm.srdf",
    )
    pairs = {tuple(sorted((names[a], names[b]))) for a, b in read_disabled_pairs(path, robot)}
    others = {tuple(sorted(("ball", name))) for name in names if name not in ("ball", "hand")}
    assert pairs == others | {("base", "tip")}
    for bad, message in (
        ('<disable_collisions link1="tip"/>', 'arm.srdf:1: <disable_collisions> lacks link2="..."'),
        (
            '<disable_default_collisions link="x"/>',
            "names the link 'x', which robot 'arm' does not",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            read_disabled_pairs(write(f'<robot name="arm">{bad}</robot>', "arm.srdf"), robot)


# --- Shapes ---


def test_boxes_spheres_and_capsules_are_exact() -> None:
    points, radius, excess = primitive_points(Shape("box", NO_MOTION, 1, (1.0, 2.0, 0.1)))
    assert (radius, excess) == (0, 0)
    assert np.unique(np.abs(points), axis=0).tolist() == [[0.5, 1, 0.05]]
    assert len(np.unique(points, axis=0)) == 8
    points, radius, excess = primitive_points(Shape("sphere", NO_MOTION, 1, (0.7,)))
    assert (points.tolist(), radius, excess) == ([[0, 0, 0]], 0.7, 0)
    points, radius, excess = primitive_points(Shape("capsule", NO_MOTION, 1, (0.2, 1.5)))
    assert (points.tolist(), radius, excess) == ([[0, 0, -0.75], [0, 0, 0.75]], 0.2, 0)


def test_cylinders_are_enclosed_within_their_excess(rng: np.random.Generator) -> None:
    radius, half = 0.3, 1.0
    points, grown, excess = primitive_points(Shape("cylinder", NO_MOTION, 1, (radius, 2 * half)))
    assert len(points) == 64 and grown == 0
    # The support function decides: the hull reaches at least as far in every direction.
    directions = rng.normal(size=(2000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    reach = (directions @ points.T).max(axis=1)
    around = np.linalg.norm(directions[:, :2], axis=1)
    shape = radius * around + half * np.abs(directions[:, 2])
    assert (reach >= shape * (1 - 1e-15)).all()
    # No point is farther from the axis than this.
    distance = np.linalg.norm(points[:, :2], axis=1)
    assert distance.max() <= radius + excess + 1e-15
    assert excess < 0.06 * radius
