"""The collision model of a robot: links that form a tree of joints, and their shapes. Lengths are
meters and angles radians, as in URDF."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

#: A pose: a quaternion w x y z, then a translation x y z.
PoseNumbers = tuple[float, float, float, float, float, float, float]
NO_MOTION: PoseNumbers = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

ShapeKind = Literal["box", "cylinder", "sphere", "capsule", "mesh"]
JointKind = Literal["fixed", "revolute", "continuous", "prismatic", "planar", "floating"]

#: The variables of a joint by its kind: the suffix of the name, and the index in the joint's value.
#: The names are those of MoveIt.
VARIABLES: dict[JointKind, tuple[tuple[str, int], ...]] = {
    "fixed": (),
    "revolute": (("", 0),),
    "continuous": (("", 0),),
    "prismatic": (("", 0),),
    "planar": (("/x", 0), ("/y", 1), ("/theta", 2)),
    "floating": (
        ("/trans_x", 4),
        ("/trans_y", 5),
        ("/trans_z", 6),
        ("/rot_x", 1),
        ("/rot_y", 2),
        ("/rot_z", 3),
        ("/rot_w", 0),
    ),
}


@dataclass(frozen=True)
class Shape:
    """A collision shape. size: the edges of a box, otherwise the radius, then the length; the
    length of a capsule excludes the caps. mesh: the file name in the description. scale: the
    factors of its coordinates. X_LS: the pose in the frame of the link."""

    kind: ShapeKind
    X_LS: PoseNumbers
    line: int
    size: tuple[float, ...] = ()
    mesh: str = ""
    scale: tuple[Fraction, Fraction, Fraction] = (Fraction(1), Fraction(1), Fraction(1))


@dataclass(frozen=True)
class Link:
    name: str
    shapes: tuple[Shape, ...]
    #: The index of the parent joint; -1 for the root.
    parent_joint: int


@dataclass
class Joint:
    """X_PJ: the pose in the frame of the parent at value 0. axis: of unit length; the normal of a
    planar joint. limits: None if there are none. A mimic joint has the value multiplier * (value
    of the joint with the index `mimics`) + offset."""

    name: str
    kind: JointKind
    parent: int
    child: int
    X_PJ: PoseNumbers = NO_MOTION
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    limits: tuple[float, float] | None = None
    mimics: int = -1
    multiplier: float = 1.0
    offset: float = 0.0

    @property
    def is_loose(self) -> bool:
        """True if the motion of the child is unbounded."""
        return self.kind in ("planar", "floating")


@dataclass(frozen=True)
class Variable:
    """A column of configurations. place: the index within the joint's value."""

    name: str
    joint: int
    place: int


@dataclass(frozen=True)
class Description:
    """links: parents before children, depth first, siblings in the order of their joints' names.
    joints: in the order of their child links."""

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    variables: tuple[Variable, ...] = field(init=False)

    def __post_init__(self) -> None:
        variables = tuple(
            Variable(joint.name + suffix, index, place)
            for index, joint in enumerate(self.joints)
            if joint.mimics < 0
            for suffix, place in VARIABLES[joint.kind]
        )
        object.__setattr__(self, "variables", variables)

    def rest(self) -> list[float]:
        """0 for each variable, or the middle of its limits if they exclude 0; 1 for the w of a
        rotation."""
        values = []
        for variable in self.variables:
            joint = self.joints[variable.joint]
            lower, upper = joint.limits or (0.0, 0.0)
            is_w = joint.kind == "floating" and variable.place == 0
            values.append(lower / 2 + upper / 2 if lower > 0 or upper < 0 else float(is_w))
        return values

    def adjacent_pairs(self) -> set[tuple[int, int]]:
        """The pairs of links connected by a joint, or by a chain of joints through links without
        shapes. Planar and floating joints do not connect links here, because their links can move
        into each other."""
        # A group consists of links with shapes that are connected only through links without
        # shapes. Its key is the topmost link without shapes, or the lower link of a joint that
        # connects two links with shapes.
        groups: dict[int, set[int]] = {}
        key_of: list[int] = []
        for index, link in enumerate(self.links):
            joint = self.joints[link.parent_joint] if link.parent_joint >= 0 else None
            if joint is None or joint.is_loose:
                key_of.append(index)
                if link.shapes:
                    groups.setdefault(index, set()).add(index)
                continue
            parent_has_shapes = bool(self.links[joint.parent].shapes)
            key = index if parent_has_shapes else key_of[joint.parent]
            key_of.append(index if link.shapes else key)
            if parent_has_shapes:
                groups.setdefault(key, set()).add(joint.parent)
            if link.shapes:
                groups.setdefault(key, set()).add(index)
        return {(a, b) for near in groups.values() for a in near for b in near if a < b}
