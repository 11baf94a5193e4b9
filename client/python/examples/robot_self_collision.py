"""Does a robot hit itself?

    python robot_self_collision.py [URDF [SRDF]] [--samples N]

Random configurations are checked in one call. Without a URDF, the robot is an arm of two links on a
base. The SRDF lists the pairs of links to skip; without one, adjacent links are skipped.
"""

from __future__ import annotations

import argparse
import pathlib
import tempfile
import time

import numpy as np

import hulld

ARM = """<robot name="arm">
  <link name="base"><collision>
    <origin xyz="0 0 0.1"/><geometry><box size="0.2 0.2 0.2"/></geometry>
  </collision></link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3"/><axis xyz="0 1 0"/><limit lower="-3.14" upper="3.14"/>
  </joint>
  <link name="upper"><collision>
    <origin xyz="0.25 0 0"/><geometry><box size="0.5 0.05 0.05"/></geometry>
  </collision></link>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="lower"/>
    <origin xyz="0.5 0 0"/><axis xyz="0 1 0"/><limit lower="-3.14" upper="3.14"/>
  </joint>
  <link name="lower"><collision>
    <origin xyz="0.25 0 0"/><geometry><box size="0.5 0.05 0.05"/></geometry>
  </collision></link>
</robot>"""


def read_arm() -> hulld.Robot:
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "arm.urdf"
        path.write_text(ARM, encoding="utf-8")
        return hulld.Robot.from_urdf(path)


def main() -> None:
    parser = argparse.ArgumentParser(description="Does a robot hit itself?")
    parser.add_argument("urdf", nargs="?", type=pathlib.Path)
    parser.add_argument("srdf", nargs="?", type=pathlib.Path)
    parser.add_argument("--samples", type=int, default=1000)
    arguments = parser.parse_args()
    robot = (
        read_arm()
        if arguments.urdf is None
        else hulld.Robot.from_urdf(arguments.urdf, srdf=arguments.srdf)
    )
    print(robot)
    # The first check starts a server and registers the hulls.
    at_rest = robot.check(robot.rest, separation=True)
    print("at rest:", at_rest)

    lower, upper = np.clip(robot.limits, -np.pi, np.pi).T
    q = np.random.default_rng(1).uniform(lower, upper, (arguments.samples, robot.dof))
    start = time.perf_counter()
    check = robot.check(q)
    seconds = time.perf_counter() - start
    print(f"{int(check.colliding.sum())} of {len(check)} configurations collide")
    print(f"{len(check) / seconds:.0f} configurations a second, {len(robot.pairs)} pairs each")
    hits = (check.pair_relations >= hulld.Relation.TOUCHING).sum(axis=0)
    for row in np.argsort(-hits, kind="stable")[: np.count_nonzero(hits)]:
        a, b = check.names_of(int(row))
        print(f"  {a} - {b}: {hits[row]}")


if __name__ == "__main__":
    main()
