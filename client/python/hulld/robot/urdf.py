"""Robot descriptions (URDF), and the pairs of links that a semantic description (SRDF) disables."""

from __future__ import annotations

import math
import os
from fractions import Fraction
from typing import cast, get_args

from hulld.robot.description import (
    NO_MOTION,
    Description,
    Joint,
    JointKind,
    Link,
    PoseNumbers,
    Shape,
    ShapeKind,
)
from hulld.robot.xml_tree import Element, read_xml


def read_urdf(path: str | os.PathLike[str]) -> Description:
    """Links, joints, and collision shapes of a file. Other elements are ignored.

    ValueError names file and line: malformed XML, a malformed number, a link or joint without a
    name or with a duplicate name, a repeated element, a shape without a size or with a negative
    one, links that form no tree, a joint that mimics itself, or a planar joint without an axis.
    """
    robot = read_xml(path, "robot")
    name = robot.require("name")
    links: dict[str, Element] = _by_name(robot, "link")
    if not links:
        raise robot.error("<robot> has no <link>")
    joints: dict[str, Element] = _by_name(robot, "joint")
    shapes = {link: tuple(_shapes_of(element)) for link, element in links.items()}
    ends: dict[str, tuple[str, str]] = {}
    joint_above: dict[str, str] = {}
    for joint, element in joints.items():
        if element.get("type") not in get_args(JointKind):
            raise element.error(
                f"joint {joint!r} has type {element.get('type')!r}; types are "
                f"{', '.join(get_args(JointKind))}"
            )
        parent, child = (_end_of(element, end, links) for end in ("parent", "child"))
        if child in joint_above:
            raise element.error(
                f"link {child!r} is the child of two joints; the second is {joint!r}"
            )
        ends[joint], joint_above[child] = (parent, child), joint
    _check_mimics(joints)

    order = _ordered(links, ends, joint_above)
    link_index = {link: index for index, link in enumerate(order)}
    joint_order = [joint_above[link] for link in order if link in joint_above]
    joint_index = {joint: index for index, joint in enumerate(joint_order)}
    made_joints = []
    for joint in joint_order:
        parent, child = ends[joint]
        made = _joint_of(joints[joint], link_index[parent], link_index[child])
        mimic = joints[joint].only("mimic")
        if mimic is not None and made.kind != "fixed":
            made.mimics = joint_index[mimic.get("joint")]
            made.multiplier, made.offset = mimic.number("multiplier", 1), mimic.number("offset", 0)
        made_joints.append(made)
    made_links = [
        Link(link, shapes[link], joint_index[joint_above[link]] if link in joint_above else -1)
        for link in order
    ]
    return Description(name, tuple(made_links), tuple(made_joints))


def _by_name(robot: Element, tag: str) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for element in robot.all(tag):
        name = element.require("name")
        if name in found:
            raise element.error(
                f"{tag} {name!r} is defined twice; the first definition is in line "
                f"{found[name].line}"
            )
        found[name] = element
    return found


def _end_of(joint: Element, end: str, links: dict[str, Element]) -> str:
    element, name = joint.only(end), joint.get("name")
    if element is None or not element.get("link"):
        raise joint.error(f'joint {name!r} lacks <{end} link="">')
    if element.get("link") not in links:
        raise element.error(
            f"joint {name!r} has a {end} that does not exist: {element.get('link')!r}"
        )
    return element.get("link")


def _ordered(
    links: dict[str, Element], ends: dict[str, tuple[str, str]], joint_above: dict[str, str]
) -> list[str]:
    """The links, depth first, siblings in the order of their joints' names."""
    roots = [link for link in links if link not in joint_above]
    if len(roots) > 1:
        raise links[roots[1]].error(
            f"link {roots[1]!r} has no parent joint, like {roots[0]!r}; exactly one link may be "
            "the root"
        )
    children: dict[str, list[str]] = {link: [] for link in links}
    for joint in sorted(ends, reverse=True):
        children[ends[joint][0]].append(ends[joint][1])
    order: list[str] = []
    pending = roots
    while pending:
        order.append(pending.pop())
        pending += children[order[-1]]
    if len(order) < len(links):
        lost = next(link for link in links if link not in set(order))
        raise links[lost].error(f"link {lost!r} is part of a cycle of joints, or below one")
    return order


def _origin_of(element: Element) -> PoseNumbers:
    origin = element.only("origin")
    if origin is None:
        return NO_MOTION
    for name in origin.attributes:
        # An ignored attribute would result in another pose.
        if name not in ("xyz", "rpy", "quat_xyzw"):
            raise origin.error(
                f"<origin> has no attribute {name!r}; attributes are xyz, rpy, and quat_xyzw"
            )
    x, y, z = origin.numbers("xyz", 3) if "xyz" in origin.attributes else (0.0, 0.0, 0.0)
    if "quat_xyzw" in origin.attributes:
        if "rpy" in origin.attributes:
            raise origin.error("<origin> has both rpy and quat_xyzw; remove one")
        i, j, k, w = origin.numbers("quat_xyzw", 4)
    else:
        i, j, k, w = _rotation_of(
            *(origin.numbers("rpy", 3) if "rpy" in origin.attributes else (0.0, 0.0, 0.0))
        )
    length = math.sqrt(i * i + j * j + k * k + w * w)
    if not 0 < length < math.inf:
        raise origin.error("<origin> quat_xyzw is not a unit quaternion")
    return (w / length, i / length, j / length, k / length, x, y, z)


def _rotation_of(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Rz(yaw) Ry(pitch) Rx(roll) as x y z w, in liburdfdom's order of operations, so that poses
    agree with it."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def _shapes_of(link: Element) -> list[Shape]:
    shapes = []
    for collision in link.all("collision"):
        X_LS = _origin_of(collision)
        geometry = collision.only("geometry")
        if geometry is None:
            raise collision.error("<collision> lacks <geometry>")
        element = next(iter(geometry.children), None)
        if len(geometry.children) > 1:
            raise geometry.error(
                "<geometry> contains several shapes; write one <collision> for each"
            )
        if element is None or element.tag not in get_args(ShapeKind):
            raise (element or geometry).error(
                f"<geometry> contains {repr(element.tag) if element else 'nothing'}; it must "
                "contain a box, cylinder, sphere, capsule or mesh"
            )
        kind = cast(ShapeKind, element.tag)
        if kind == "mesh":
            shapes.append(
                Shape(kind, X_LS, collision.line, (), element.require("filename"), _scale(element))
            )
            continue
        sizes = {"box": [("size", 3)], "sphere": [("radius", 1)]}.get(
            kind, [("radius", 1), ("length", 1)]
        )
        size = [number for name, count in sizes for number in element.numbers(name, count)]
        if not all(number >= 0 for number in size):
            names = " and ".join(name for name, _ in sizes)
            raise element.error(f"<{kind}> {names} must not be negative")
        shapes.append(Shape(kind, X_LS, collision.line, tuple(size)))
    return shapes


def _scale(mesh: Element) -> tuple[Fraction, Fraction, Fraction]:
    if "scale" not in mesh.attributes:
        return (Fraction(1), Fraction(1), Fraction(1))
    if not all(mesh.numbers("scale", 3)):
        raise mesh.error("<mesh> scale must not be 0")
    x, y, z = (Fraction(word) for word in mesh.get("scale").split())
    return (x, y, z)


def _joint_of(element: Element, parent: int, child: int) -> Joint:
    name, kind = element.get("name"), cast(JointKind, element.get("type"))
    joint = Joint(name, kind, parent, child, _origin_of(element))
    if kind in ("fixed", "floating"):
        return joint
    axis = element.only("axis")
    if axis is None and kind == "planar":
        # URDF's default, x, is rarely intended.
        raise element.error(f'joint {name!r} lacks <axis xyz="0 0 1"/>, the normal of its plane')
    if axis is not None:
        x, y, z = axis.numbers("xyz", 3)
        length = math.hypot(x, y, z)
        if length == 0:
            raise axis.error("<axis> xyz must not be 0 0 0")
        joint.axis = (x / length, y / length, z / length) if length != 1 else (x, y, z)
    if kind in ("continuous", "planar"):
        return joint
    limit = element.only("limit")
    if limit is not None:
        joint.limits = (limit.number("lower", 0), limit.number("upper", 0))
    elif element.only("mimic") is None:
        raise element.error(f'joint {name!r} lacks <limit lower="" upper="" ...>')
    return joint


def _check_mimics(joints: dict[str, Element]) -> None:
    for name, element in joints.items():
        seen = {name}
        mimic = element.only("mimic")
        while mimic is not None:
            leader = mimic.get("joint")
            if leader not in joints:
                raise mimic.error(f"joint {name!r} mimics a joint that does not exist: {leader!r}")
            for one in (name, leader):
                if joints[one].get("type") in ("planar", "floating"):
                    raise mimic.error(
                        f"joint {one!r} is {joints[one].get('type')}; a mimic joint and its leader "
                        "must have one value each"
                    )
            if leader in seen:
                raise element.error(f"joint {name!r} mimics itself through other joints")
            seen.add(leader)
            mimic = joints[leader].only("mimic")


def read_disabled_pairs(path: str | os.PathLike[str], robot: Description) -> set[tuple[int, int]]:
    """Returns the pairs of links that an SRDF file disables, the lower index first:
    disable_collisions, and disable_default_collisions minus enable_collisions. ValueError, with
    file and line: malformed XML, or an unknown link."""
    links = {link.name: index for index, link in enumerate(robot.links)}
    root = read_xml(path, "robot")

    def link_of(element: Element, attribute: str) -> int:
        name = element.require(attribute)
        if name not in links:
            raise element.error(
                f"<{element.tag}> names the link {name!r}, which robot {robot.name!r} does not have"
            )
        return links[name]

    def pair_of(element: Element) -> tuple[int, int]:
        a, b = link_of(element, "link1"), link_of(element, "link2")
        return (min(a, b), max(a, b))

    pairs: set[tuple[int, int]] = set()
    for element in root.all("disable_default_collisions"):
        link = link_of(element, "link")
        pairs |= {(min(link, i), max(link, i)) for i in range(len(robot.links)) if i != link}
    pairs -= set(map(pair_of, root.all("enable_collisions")))
    return pairs | set(map(pair_of, root.all("disable_collisions")))
