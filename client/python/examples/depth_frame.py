"""Turns a depth frame into a hull, and lowers a gripper toward it.

    python depth_frame.py

A synthetic camera looks down on a table with an egg on it. The pixels above the table become
points, the points become a hull, and a box is lowered until it is 2 mm away. The hull covers only
the visible side of the egg.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import hulld

Array = npt.NDArray[np.float64]

WIDTH, HEIGHT, FOCAL = 320, 240, 300.0  # pixels
CAMERA_HEIGHT = 0.6  # meters above the table
EGG_CENTER, EGG_RADII = np.array([0.02, -0.01, 0.04]), np.array([0.03, 0.03, 0.04])
# The camera looks down: its z axis is the world's -z.
X_WC = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, CAMERA_HEIGHT], [0, 0, 0, 1]])


def render() -> npt.NDArray[np.float32]:
    """Depth along the camera's z axis in meters: HEIGHT x WIDTH, NaN for pixels without a
    measurement."""
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    rays_C = np.stack([(u - WIDTH / 2) / FOCAL, (v - HEIGHT / 2) / FOCAL, np.ones(u.shape)], -1)
    rays = rays_C @ X_WC[:3, :3].T / EGG_RADII
    origin = (X_WC[:3, 3] - EGG_CENTER) / EGG_RADII
    # |origin + depth ray| = 1 where the egg is hit.
    a, b, c = (rays * rays).sum(-1), rays @ origin, origin @ origin - 1
    with np.errstate(invalid="ignore"):
        egg = (-b - np.sqrt(b * b - a * c)) / a
    depth = np.where(np.isnan(egg), CAMERA_HEIGHT, egg)
    depth[::37, ::41] = np.nan  # as real sensors have it
    return depth.astype(np.float32)


def to_points(depth: npt.NDArray[np.float32]) -> Array:
    """The points of a frame in the world, n x 3, without the table."""
    v, u = np.nonzero(np.isfinite(depth))
    z = depth[v, u].astype(float)
    points_C = np.stack([(u - WIDTH / 2) / FOCAL * z, (v - HEIGHT / 2) / FOCAL * z, z], axis=1)
    points: Array = points_C @ X_WC[:3, :3].T + X_WC[:3, 3]
    above: Array = points[points[:, 2] > 0.005]
    return above


def box(size: tuple[float, float, float]) -> Array:
    """Corners of a box around the origin: 8 x 3."""
    return np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size / 2


def main() -> None:
    points = to_points(render())
    with hulld.local() as client:
        egg = client.append_points("egg", points, create=True)
        print(f"egg: {egg.points} points, {egg.vertex_count} vertices")
        client.append_points("gripper", box((0.02, 0.08, 0.01)), create=True)

        # A single query: how far away is it, accurately enough for planning?
        above = client.check_collision(
            ("gripper", (0.02, -0.01, 0.2)), "egg", separation=True, witness=True
        )
        assert above.separation is not None
        print(f"at 0.2 m: {above.relation.name}, {above.separation.value:.4f} m apart")

        # Many queries: lower it by a millimeter each time, and stop when it touches.
        heights = np.arange(0.2, 0.0, -0.001)
        with client.stream_collisions(["gripper", "egg"], [(0, 1)], clearance=0.002) as stream:
            for height in heights:
                answer = stream.update([0], [(0.02, -0.01, height)]).answers
                assert answer.within_clearance is not None
                if answer.within_clearance[0]:
                    print(f"stop at {height:.3f} m: within 2 mm, {answer_name(answer)}")
                    break


def answer_name(answers: hulld.Answers) -> str:
    """The relation of the only pair."""
    return hulld.Relation(answers.relations[0]).name


if __name__ == "__main__":
    main()
