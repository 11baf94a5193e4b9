"""A robot, checked for collisions with itself and its surroundings."""

from __future__ import annotations

import collections
import copy
import os
import re
import secrets
import threading
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self, Union

import numpy as np
import numpy.typing as npt

from hulld import arguments
from hulld.answers.collisions import Batch, Relation
from hulld.calls.freshness import Freshness
from hulld.client import Client
from hulld.errors import NotFoundError
from hulld.geometry.placements import Placements, PlacementsLike, as_radii
from hulld.geometry.poses import PoseLike, pack_pose
from hulld.local_server import shared_client
from hulld.robot.answers import RobotCheck, collect
from hulld.robot.description import Description, PoseNumbers
from hulld.robot.kinematics import compose, joint_values, link_poses, stacked
from hulld.robot.meshes import MeshLoader, enclosed_volume, read_pieces
from hulld.robot.package_path import resolve_file
from hulld.robot.shapes import primitive_points
from hulld.robot.urdf import read_disabled_pairs, read_urdf

#: One configuration (dof), many (n x dof), or values by the names of variables.
Configurations = Union[npt.ArrayLike, Mapping[str, npt.ArrayLike]]

# Enough to amortize a round trip, and within the limits of a server with default settings.
_PAIRS_PER_CALL = 1 << 16
_PLACEMENTS_PER_CALL = 1 << 16
_SWELL_TO_WARN = 1.5


@dataclass(frozen=True)
class Part:
    """A hull of a robot: a shape, or a convex piece of a mesh. name: the link's name, followed by
    /1, /2, and so on if the link has several parts. points: n x 3, in the frame of the shape.
    X_LS: its pose in the frame of the link. radius: as in Placement. excess: the rounded hull
    extends at most this far beyond the shape. mesh_volume: 0 if it is unknown."""

    name: str
    link: int
    X_LS: PoseNumbers
    points: npt.NDArray[np.float64]
    radius: float = 0.0
    excess: float = 0.0
    mesh_volume: float = 0.0


class Robot:
    """A robot description with a hull for each shape: converts joint values to poses, and answers
    exactly for these poses. Created by from_urdf. Thread-safe.

    The first check registers the hulls. `close`, or the end of a `with` block, deletes them.
    """

    def __init__(
        self,
        description: Description,
        parts: Sequence[Part],
        left_out: set[tuple[int, int]],
        client: Client | None,
        prefix: str | None,
    ) -> None:
        """left_out: unchecked pairs of links, the lower index first."""
        self._description = description
        self.parts = tuple(parts)
        self._radii = np.array([part.radius for part in parts])
        self._pairs = [
            (a, b)
            for a, part in enumerate(parts)
            for b, other in enumerate(parts[a + 1 :], a + 1)
            if part.link != other.link and (part.link, other.link) not in left_out
        ]
        self._client = client
        self._prefix = prefix
        self._lock = threading.Lock()
        self._hull_ids: list[str] = []

    @classmethod
    def from_urdf(
        cls,
        path: str | os.PathLike[str],
        *,
        srdf: str | os.PathLike[str] | None = None,
        packages: Mapping[str, str | os.PathLike[str]] | None = None,
        adjacent: bool = False,
        split: bool = True,
        load_mesh: MeshLoader | None = None,
        client: Client | None = None,
        prefix: str | None = None,
    ) -> Self:
        """Reads a URDF file and its meshes, without a server.

        Boxes, spheres, and capsules are exact. Meshes become their convex hulls, and cylinders
        become enclosing polyhedra. Shapes of the same link are not checked against each other.
        Without `srdf`, adjacent links are not checked either, that is, links connected by a joint,
        or by joints through links without shapes; `adjacent` includes them. srdf: a file; exactly
        the pairs that it disables are skipped.

        packages: folders by the name in package://NAME/. Other packages are searched in
        ROS_PACKAGE_PATH, AMENT_PREFIX_PATH, and the folders above the file. split: a mesh file of
        several named convex parts, as V-HACD and CoACD write OBJ, becomes one hull per part.
        load_mesh: reads mesh files, as trimesh.load_mesh; None: reads STL and OBJ.

        client: for the server that answers; None: a private in-memory server, shared by all robots
        of this process. prefix: keeps the hulls under this ID prefix, such as "arm/"; None:
        `close` deletes them.

        ValueError: the description, the SRDF, or a mesh is malformed; the message names file and
        line. OSError: a file is missing.
        """
        if not isinstance(client, (Client, type(None))):
            raise TypeError(f"client is {client!r}; it must be a hulld.Client")
        description = read_urdf(path)
        left_out = set() if adjacent else description.adjacent_pairs()
        if srdf is not None:
            left_out = read_disabled_pairs(srdf, description)
        parts: list[Part] = []
        for index, link in enumerate(description.links):
            found: list[Part] = []
            for shape in link.shapes:
                if shape.kind != "mesh":
                    found.append(Part(link.name, index, shape.X_LS, *primitive_points(shape)))
                    continue
                try:
                    file = resolve_file(shape.mesh, path, packages or {})
                    pieces = read_pieces(file, shape.scale, split, load_mesh)
                except (OSError, ValueError) as error:
                    place = f"{os.fspath(path)}:{shape.line}: link {link.name!r}"
                    raise type(error)(f"{place}: {error}") from None
                found += [Part(link.name, index, shape.X_LS, p, mesh_volume=v) for p, v in pieces]
            if len(found) > 1:
                found = [replace(part, name=f"{link.name}/{i + 1}") for i, part in enumerate(found)]
            parts += found
        if not parts:
            raise ValueError(
                f"{os.fspath(path)}: no link has a <collision> element, so nothing can collide"
            )
        return cls(description, parts, left_out, client, prefix)

    # --- Kinematics ---

    @property
    def name(self) -> str:
        return self._description.name

    @property
    def links(self) -> tuple[str, ...]:
        """The names of the links, parents before children."""
        return tuple(link.name for link in self._description.links)

    @property
    def variables(self) -> tuple[str, ...]:
        """The names of the columns of configurations: a joint, radians or meters; J/x, J/y, and
        J/theta of a planar joint J; J/trans_x, J/trans_y, J/trans_z, J/rot_x, J/rot_y, J/rot_z, and
        J/rot_w of a floating one. Fixed joints and joints that mimic have none."""
        return tuple(variable.name for variable in self._description.variables)

    @property
    def dof(self) -> int:
        """The number of variables."""
        return len(self._description.variables)

    @property
    def limits(self) -> npt.NDArray[np.float64]:
        """dof x 2: lower and upper limits; infinite if there is no limit."""
        joints = self._description.joints
        rows = [joints[v.joint].limits for v in self._description.variables]
        return np.array([row or (-np.inf, np.inf) for row in rows]).reshape(-1, 2)

    @property
    def rest(self) -> npt.NDArray[np.float64]:
        """dof: 0 for each variable, or the middle of its limits if they exclude 0; 1 for the w of a
        rotation."""
        return np.array(self._description.rest())

    def link_poses(self, q: Configurations, *, base: PoseLike = None) -> npt.NDArray[np.float64]:
        """Forward kinematics: the poses of all links as w x y z x y z, n x links x 7, or links x 7
        for one configuration. q, base: as in `check`. The quaternions are not normalized."""
        values = self._configurations(q)
        poses = link_poses(
            self._description, pack_pose(base).tolist(), joint_values(self._description, values)
        )
        array = stacked(poses, len(values))
        is_single = not isinstance(q, Mapping) and np.ndim(q) == 1
        poses_of_links: npt.NDArray[np.float64] = array[0] if is_single else array
        return poses_of_links

    def _configurations(self, q: Configurations) -> npt.NDArray[np.float64]:
        """n x dof finite numbers. ValueError, TypeError: q has another form."""
        if isinstance(q, Mapping):
            return self._by_name(q)
        array = arguments.as_floats(arguments.as_array(q, "q"), "q").astype(np.float64, copy=False)
        rows = array[np.newaxis] if array.ndim == 1 else array
        if rows.ndim != 2 or rows.shape[1] != self.dof:
            raise ValueError(
                f"q has the shape {array.shape}; {self.name} expects ({self.dof},) or (n, "
                f"{self.dof}): {', '.join(self.variables)}"
            )
        finite = np.isfinite(array)
        if not finite.all():
            at = tuple(int(index) for index in np.argwhere(~finite)[0])
            raise ValueError(f"q{arguments.place(at)} is {array[at]}")
        for index, joint in enumerate(self._description.joints):
            if joint.kind == "floating":
                w = [c for c, v in enumerate(self._description.variables) if v.joint == index]
                zero = ~rows[:, w[3:]].any(axis=1)
                if zero.any():
                    raise ValueError(
                        f"q[{int(np.argmax(zero))}]: the quaternion of {joint.name} is zero; use "
                        "1 0 0 0 for no rotation"
                    )
        return rows

    def _by_name(self, q: Mapping[str, npt.ArrayLike]) -> npt.NDArray[np.float64]:
        columns = {name: arguments.as_array(values, f"q[{name!r}]") for name, values in q.items()}
        unknown = [name for name in columns if name not in self.variables]
        if unknown:
            raise ValueError(
                f"{unknown[0]!r} is not a variable of {self.name}, which has "
                f"{', '.join(self.variables)}"
            )
        sizes = {column.size for column in columns.values() if column.ndim > 0}
        if len(sizes) > 1 or any(column.ndim > 1 for column in columns.values()):
            raise ValueError(
                "q must have one number, or n numbers, for each name, with the same n for all"
            )
        rows = np.tile(self.rest, (sizes.pop() if sizes else 1, 1))
        for name, column in columns.items():
            floats = arguments.as_floats(column, f"q[{name!r}]")
            rows[:, self.variables.index(name)] = floats
        return self._configurations(rows)

    # --- Checks ---

    def check(
        self,
        q: Configurations,
        *,
        scene: PlacementsLike | None = None,
        ignore: Iterable[tuple[str, str]] = (),
        base: PoseLike = None,
        separation: bool = False,
        clearance: float | None = None,
        tolerance: float = 0.0,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> RobotCheck:
        """Checks configurations for collisions of the robot with itself and with a scene.

        q: one configuration (dof), many (n x dof), in the order of `variables`, or values by name,
        as in {"elbow": 1.5}, with the other variables at rest. Values beyond limits cause a
        warning, but are used. scene: placements of hulls and bodies on the server of `client`.
        ignore: pairs of names of links, parts, or IDs of the scene. base: the pose of the root
        link. separation, clearance, tolerance: as in Client.check_collision. timeout: of each call,
        which covers a few thousand configurations.

        Poses are computed in floating point, and answers are exact for these poses. The motion
        between configurations is not checked; `hullctl robot check --continuous` checks it.

        ValueError: q has another shape, or no pair is left. NotFoundError: a hull of the scene is
        missing.
        """
        values = self._configurations(q)
        self._warn_of_limits(values)
        around = Placements.of([] if scene is None else scene)
        names = [part.name for part in self.parts] + _names_of(around)
        pairs = self._pairs_to_check(names, ignore)
        ids = self._registered() + around.ids
        X_WB: list[float] = pack_pose(base).tolist()
        per_call = min(_PAIRS_PER_CALL // len(pairs), _PLACEMENTS_PER_CALL // len(self.parts))
        batches = []
        for first in range(0, max(1, len(values)), max(1, per_call)):
            poses = self._part_poses(values[first : first + max(1, per_call)], X_WB)
            batch = self.client.check_collisions(
                *_many_robots(ids, self._radii, poses, around, pairs),
                separation=separation,
                clearance=clearance,
                tolerance=tolerance,
                freshness=freshness,
                timeout=timeout,
            )
            _require_answers(batch, first, names, pairs)
            batches.append(batch.answers)
        return collect(names, pairs, batches)

    def _part_poses(
        self, values: npt.NDArray[np.float64], X_WB: Sequence[float]
    ) -> npt.NDArray[np.float64]:
        """n x parts x 7."""
        X_WL = link_poses(self._description, X_WB, joint_values(self._description, values))
        return stacked([compose(X_WL[part.link], part.X_LS) for part in self.parts], len(values))

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """The pairs of parts that `check` queries, by name."""
        return [(self.parts[a].name, self.parts[b].name) for a, b in self._pairs]

    def _pairs_to_check(
        self, names: Sequence[str], ignore: Iterable[tuple[str, str]]
    ) -> npt.NDArray[np.uint32]:
        """Indices into `names`."""
        moving = len(self.parts)
        aliases = [{part.name, self._description.links[part.link].name} for part in self.parts]
        aliases += [{name, name.partition("[")[0]} for name in names[moving:]]
        pairs = [*self._pairs]
        pairs += [(a, b) for a in range(moving) for b in range(moving, len(names))]
        for one, other in ignore:
            kept = [
                (a, b)
                for a, b in pairs
                if not (
                    (one in aliases[a] and other in aliases[b])
                    or (other in aliases[a] and one in aliases[b])
                )
            ]
            if len(kept) == len(pairs):
                raise ValueError(
                    f"ignore: {(one, other)!r} is not a checked pair; pass names of links, parts, "
                    "or IDs of the scene"
                )
            pairs = kept
        if not pairs:
            hint = (
                "a pair needs two links with shapes, or a scene"
                if len({part.link for part in self.parts}) < 2
                else "the others are adjacent (adjacent=True includes them), disabled by the SRDF, "
                "or ignored"
            )
            raise ValueError(f"no pair of {self.name} is left to check; {hint}")
        return np.array(pairs, np.uint32)

    def _warn_of_limits(self, values: npt.NDArray[np.float64]) -> None:
        count = len(values)
        columns = joint_values(self._description, values)
        for joint, (value, *_) in zip(self._description.joints, columns):
            if joint.limits is None or joint.kind == "fixed":
                continue
            lower, upper = joint.limits
            column = np.broadcast_to(value, count)
            beyond = np.flatnonzero(~((lower <= column) & (column <= upper)))
            if beyond.size:
                of_many = f", in {beyond.size} of {count} configurations" if count > 1 else ""
                warnings.warn(
                    f"{joint.name} is at {column[beyond[0]]}, beyond its limits {lower} to {upper}"
                    + of_many,
                    stacklevel=3,
                )

    # --- Hulls on the server ---

    @property
    def client(self) -> Client:
        """The client of the server that answers. Hulls of a scene are registered with it."""
        return self._client or shared_client()

    def _registered(self) -> list[str]:
        """The IDs of the parts' hulls. The hulls exist when this returns."""
        with self._lock:
            if self._hull_ids:
                return self._hull_ids
            client = self.client
            root = self._prefix
            if root is None:
                root = f"robot/{secrets.token_hex(6)}/"
            ids: list[str] = []
            for part in self.parts:
                name = re.sub(r"[^A-Za-z0-9._-]", "_", part.name[:100])
                name = name if name[0].isalnum() else "x" + name
                count = sum(one.startswith(root + name) for one in ids)
                ids.append(f"{root}{name}" + (f"-{count + 1}" if root + name in ids else ""))
            try:
                for hull_id, part in zip(ids, self.parts):
                    client.replace_hull(hull_id, part.points, create=True)
            except BaseException:
                self._delete(ids)
                raise
            self._hull_ids = ids
            for hull_id, part in zip(ids, self.parts):
                self._warn_of_swell(hull_id, part)
            return ids

    def _warn_of_swell(self, hull_id: str, part: Part) -> None:
        if part.mesh_volume == 0:
            return
        hull = self.client.get_hull_mesh(hull_id)
        ratio = enclosed_volume(hull.vertices, hull.triangles) / part.mesh_volume
        if ratio >= _SWELL_TO_WARN:
            warnings.warn(
                f"the hull of {part.name} has {ratio:.4g} times the volume of its mesh and may "
                "collide where the mesh does not; use a convex decomposition of the mesh",
                stacklevel=4,
            )

    def _delete(self, ids: Iterable[str]) -> None:
        for hull_id in ids if self._prefix is None else ():
            try:
                self.client.delete_hull(hull_id)
            except NotFoundError:
                pass

    def close(self) -> None:
        """Deletes the hulls, unless a prefix keeps them. The next check registers them."""
        with self._lock:
            ids, self._hull_ids = self._hull_ids, []
            self._delete(ids)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        counts = {"variable": self.dof, "part": len(self.parts), "pair": len(self._pairs)}
        texts = [f"{count} {name}{'' if count == 1 else 's'}" for name, count in counts.items()]
        return f"Robot({self.name}: {', '.join(texts)})"


def _many_robots(
    ids: Sequence[str],
    radii: npt.NDArray[np.float64],
    poses: npt.NDArray[np.float64],
    scene: Placements,
    pairs: npt.NDArray[np.uint32],
) -> tuple[Placements, npt.NDArray[np.uint32]]:
    """The placements of n robots, then of the scene, and the pairs of each robot. ids: of the
    parts, then of the scene. radii: of the parts. poses: n x parts x 7. pairs: of one robot, with
    the scene after its parts."""
    count, parts = poses.shape[:2]
    robots = np.arange(count, dtype=np.uint32)[:, np.newaxis, np.newaxis]
    # The scene follows all robots.
    robot = np.where(pairs < parts, robots, np.uint32(max(0, count - 1)))
    shifted = pairs + robot * np.uint32(parts)
    of_parts = np.tile(np.arange(parts, dtype=np.uint32), count)
    placements = copy.copy(scene)
    placements.ids = [*ids]
    placements.poses = np.concatenate([poses.reshape(-1, 7), scene.poses])
    placements.indices = np.concatenate([of_parts, scene.indices + np.uint32(parts)])
    around = np.zeros(len(scene)) if scene.radii is None else scene.radii
    all_radii = np.concatenate([np.tile(radii, count), around])
    placements.radii = as_radii(all_radii, len(all_radii))
    return placements, shifted.reshape(-1, 2)


def _require_answers(
    batch: Batch, first: int, names: Sequence[str], pairs: npt.NDArray[np.uint32]
) -> None:
    """Raises the error of the first pair without an answer. first: the first configuration."""
    unanswered = np.flatnonzero(batch.answers.relations == Relation.UNSPECIFIED)
    if not unanswered.size:
        return
    row = int(unanswered[0])
    a, b = pairs[row % len(pairs)]
    raise batch.error(
        row, f"{names[a]} with {names[b]} in configuration {first + row // len(pairs)}: "
    )


def _names_of(scene: Placements) -> list[str]:
    """The ID of each placement, followed by its index if the ID has several."""
    # Points in place of an ID have no name.
    ids = [scene[index].id or "points" for index in range(len(scene))]
    counts = collections.Counter(ids)
    return [f"{one}[{i}]" if counts[one] > 1 else one for i, one in enumerate(ids)]
