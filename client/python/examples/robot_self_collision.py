"""Does a robot hit itself?

    python robot_self_collision.py [FOLDER] [--samples N]

FOLDER holds a UR5 as example-robot-data has it (robots/ur_description with urdf, srdf and meshes).
Without one, a robot of two links and a base is made up here. Random joint angles are asked about
one after another over one stream: only pairs that may collide, and that the robot's makers did not
exclude. The hull of each link is asked about, which encloses it.
"""

from __future__ import annotations

import argparse
import pathlib
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

import hulld

Array = npt.NDArray[np.float64]


@dataclass
class Joint:
    """A joint turns its child about an axis of its own frame; a fixed one has no axis."""

    parent: str
    child: str
    X_PJ: Array
    axis: Array | None
    limits: tuple[float, float]


@dataclass
class Robot:
    """Joints, parents before children; points of each link in its frame."""

    joints: list[Joint]
    points: dict[str, Array]
    ignored: set[frozenset[str]] = field(default_factory=set)

    def poses(self, angles: Array) -> dict[str, Array]:
        """4 x 4 of each link, the first link standing still."""
        poses = {self.joints[0].parent: np.eye(4)}
        moving = iter(angles)
        for joint in self.joints:
            turn = np.eye(4)
            if joint.axis is not None:
                turn[:3, :3] = rotation(joint.axis, next(moving))
            poses[joint.child] = poses[joint.parent] @ joint.X_PJ @ turn
        return poses

    def pairs(self) -> list[tuple[str, str]]:
        """Pairs of links that are neither excluded nor joined."""
        links = list(self.points)
        joined = {frozenset((joint.parent, joint.child)) for joint in self.joints} | self.ignored
        return [
            (a, b)
            for i, a in enumerate(links)
            for b in links[i + 1 :]
            if frozenset((a, b)) not in joined
        ]


def rotation(axis: Array, angle: float) -> Array:
    """3 x 3, by Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turned: Array = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return turned


def frame(xyz: str | None, rpy: str | None) -> Array:
    """4 x 4 of URDF's origin: roll, pitch and yaw about fixed axes, then the translation."""
    roll, pitch, yaw = (float(word) for word in (rpy or "0 0 0").split())
    X = np.eye(4)
    X[:3, :3] = (
        rotation(np.array([0.0, 0, 1]), yaw)
        @ rotation(np.array([0.0, 1, 0]), pitch)
        @ rotation(np.array([1.0, 0, 0]), roll)
    )
    X[:3, 3] = [float(word) for word in (xyz or "0 0 0").split()]
    return X


def read_stl(path: pathlib.Path) -> Array:
    """The corners of the triangles of a binary STL: n x 3."""
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    triangle = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    corners: Array = (
        np.frombuffer(data, triangle, count, 84)["corners"].reshape(-1, 3).astype(float)
    )
    return corners


def read_ur5(folder: pathlib.Path) -> Robot:
    """Links, joints, meshes and excluded pairs."""
    description = folder / "robots/ur_description"
    urdf = ElementTree.parse(description / "urdf/ur5_robot.urdf").getroot()
    joints = []
    for joint in urdf.findall("joint"):
        origin, axis, limit = joint.find("origin"), joint.find("axis"), joint.find("limit")
        parent, child = joint.find("parent"), joint.find("child")
        assert parent is not None and child is not None
        turns = joint.get("type") in ("revolute", "continuous")
        direction = axis.get("xyz", "1 0 0") if axis is not None else "1 0 0"
        joints.append(
            Joint(
                parent.attrib["link"],
                child.attrib["link"],
                frame(origin.get("xyz"), origin.get("rpy")) if origin is not None else np.eye(4),
                np.array([float(word) for word in direction.split()]) if turns else None,
                (
                    (float(limit.attrib["lower"]), float(limit.attrib["upper"]))
                    if turns and limit is not None
                    else (0.0, 0.0)
                ),
            )
        )
    points = {}
    for link in urdf.findall("link"):
        for collision in link.findall("collision"):
            mesh = collision.find("geometry/mesh")
            if mesh is None:
                continue
            name = pathlib.PurePosixPath(mesh.attrib["filename"]).name
            corners = read_stl(description / "meshes/ur5/collision" / name)
            origin = collision.find("origin")
            if origin is not None:
                X = frame(origin.get("xyz"), origin.get("rpy"))
                corners = corners @ X[:3, :3].T + X[:3, 3]
            points[link.attrib["name"]] = corners
    srdf = ElementTree.parse(description / "srdf/ur5.srdf").getroot()
    ignored = {
        frozenset((pair.attrib["link1"], pair.attrib["link2"]))
        for pair in srdf.findall("disable_collisions")
    }
    return Robot(in_order(joints), points, ignored)


def in_order(joints: list[Joint]) -> list[Joint]:
    """Parents before children."""
    children = {joint.child for joint in joints}
    known = {joint.parent for joint in joints if joint.parent not in children}
    ordered: list[Joint] = []
    while len(ordered) < len(joints):
        ready = [joint for joint in joints if joint.parent in known and joint.child not in known]
        ordered += ready
        known |= {joint.child for joint in ready}
    return ordered


def two_links() -> Robot:
    """A base, and two beams of 0.5 m that turn about y."""

    def beam(length: float, width: float) -> Array:
        corners = [[x, y, z] for x in (0, 1) for y in (-1, 1) for z in (-1, 1)]
        return np.array(corners, float) * [length, width / 2, width / 2]

    y = np.array([0.0, 1, 0])
    joints = [
        Joint("base", "upper", frame("0 0 0.3", None), y, (-np.pi, np.pi)),
        Joint("upper", "lower", frame("0.5 0 0", None), y, (-np.pi, np.pi)),
    ]
    base = beam(0.2, 0.2) @ rotation(y, -np.pi / 2).T
    return Robot(joints, {"base": base, "upper": beam(0.5, 0.05), "lower": beam(0.5, 0.05)})


def main() -> None:
    parser = argparse.ArgumentParser(description="Does a robot hit itself?")
    parser.add_argument("folder", nargs="?", type=pathlib.Path)
    parser.add_argument("--samples", type=int, default=200)
    arguments = parser.parse_args()
    robot = two_links() if arguments.folder is None else read_ur5(arguments.folder)
    links, pairs = list(robot.points), robot.pairs()
    rng = np.random.default_rng(1)
    limits = np.array([joint.limits for joint in robot.joints if joint.axis is not None])

    with hulld.local() as client:
        for link in links:
            made = client.append_points(f"robot/{link}", robot.points[link], create=True)
            print(f"{link}: {made.points} points, {made.vertex_count} vertices")
        asked = [(links.index(a), links.index(b)) for a, b in pairs]
        hits: dict[tuple[str, str], int] = {}
        colliding = 0
        with client.stream_collisions([f"robot/{link}" for link in links], asked) as stream:
            for _ in range(arguments.samples):
                poses = robot.poses(rng.uniform(limits[:, 0], limits[:, 1]))
                stacked = np.stack([poses[link] for link in links])
                answer = stream.update(np.arange(len(links)), stacked)
                found = answer.pairs[answer.answers.colliding]
                colliding += len(found) > 0
                for a, b in found:
                    hits[links[a], links[b]] = hits.get((links[a], links[b]), 0) + 1
        print(f"{colliding} of {arguments.samples} poses collide; {len(pairs)} pairs asked about")
        for (a, b), count in sorted(hits.items(), key=lambda item: -item[1]):
            print(f"  {a} - {b}: {count}")


if __name__ == "__main__":
    main()
