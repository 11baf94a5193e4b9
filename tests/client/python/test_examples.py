"""The examples run, and print known results."""

from __future__ import annotations

import pathlib
import re
import subprocess
import sys

from conftest import SOURCE

EXAMPLES = SOURCE / "client/python/examples"


def run(name: str, *arguments: object, cwd: pathlib.Path) -> str:
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / name), *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_each_example_has_a_test() -> None:
    assert {path.name for path in EXAMPLES.iterdir() if path.suffix == ".py"} == {
        "depth_frame.py",
        "robot_self_collision.py",
        "trade_plot.py",
    }


def test_the_gripper_stops_above_the_egg(tmp_path: pathlib.Path) -> None:
    said = run("depth_frame.py", cwd=tmp_path)
    assert "at 0.2 m: SEPARATED, 0.1150 m apart" in said
    stop = re.search(r"stop at ([0-9.]+) m: within 2 mm, SEPARATED", said)
    # The egg's top is at 0.08, and the gripper is 0.01 high.
    assert stop and 0.085 < float(stop.group(1)) < 0.088


def test_a_robot_of_two_links_hits_its_base(tmp_path: pathlib.Path) -> None:
    said = run("robot_self_collision.py", "--samples", 100, cwd=tmp_path)
    assert re.search(r"^[1-9][0-9]* of 100 configurations collide$", said, re.M)
    assert re.search(r"^[0-9]+ configurations a second, 1 pairs each$", said, re.M)
    assert "base - lower: " in said


def test_a_ur5_hits_itself(tmp_path: pathlib.Path, data: pathlib.Path) -> None:
    folder = data / "example-robot-data/robots/ur_description"
    files = [folder / "urdf/ur5_robot.urdf", folder / "srdf/ur5.srdf"]
    said = run("robot_self_collision.py", *files, "--samples", 100, cwd=tmp_path)
    assert "Robot(ur5: 6 variables, 8 parts, 18 pairs)" in said
    assert re.search(r"^[1-9][0-9]* of 100 configurations collide$", said, re.M)
    # Pairs that the SRDF disables are left out.
    assert "base_link - shoulder_link" not in said and "wrist_1_link - wrist_2_link" not in said


def test_a_larger_tolerance_leaves_more_pairs_undecided(tmp_path: pathlib.Path) -> None:
    said = run("trade_plot.py", "trade.png", cwd=tmp_path)
    rows = re.findall(r"^ *([0-9.e-]+) +[0-9.]+ +[0-9.]+x +([0-9.]+)%$", said, re.M)
    assert [row[0] for row in rows] == ["0", "1e-15", "1e-12", "1e-09", "1e-06", "0.001"]
    assert rows[0][1] == "0.0" and float(rows[-1][1]) > 10
    assert (tmp_path / "trade.png").exists() or "matplotlib is not installed" in said
