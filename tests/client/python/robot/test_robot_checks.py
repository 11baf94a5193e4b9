"""Checks of robots: the same answers as `hullctl robot check`, for many configurations at once."""

from __future__ import annotations

import json
import pathlib
import subprocess
import threading
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import hulld
from conftest import CUBE
from test_robot_meshes import TRIANGLES, binary_stl, box_obj

# Three shapes in a row on two joints; the last folds back onto the first.
CHAIN = """<robot name="chain">
  <link name="a"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <joint name="i" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="1 0 0"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="1"/></joint>
  <link name="b"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <joint name="j" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="1 0 0"/>
    <axis xyz="1 0 0"/><limit lower="-3" upper="1"/></joint>
  <link name="c"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
</robot>"""

# Every kind of joint and shape, a mimic joint, a bare link, and pieces of a mesh.
ALL_KINDS = """<robot name="all">
  <link name="base"><collision><origin rpy="0.1 0.2 0.3"/>
    <geometry><box size="0.4 0.3 0.2"/></geometry></collision></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.2" rpy="0 0.4 0"/><axis xyz="1 2 0"/><limit lower="-3" upper="3"/></joint>
  <link name="upper">
    <collision><origin xyz="0 0 0.4"/><geometry><cylinder radius="0.05" length="0.6"/></geometry>
    </collision>
    <collision><origin xyz="0 0 0.8"/><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="bare"/>
    <origin xyz="0 0 0.9"/><axis xyz="0 1 0"/><mimic joint="shoulder" multiplier="1.5" offset="1"/>
  </joint>
  <link name="bare"/>
  <joint name="weld" type="fixed"><parent link="bare"/><child link="lower"/>
    <origin xyz="0.1 0 0" rpy="0 0 1"/></joint>
  <link name="lower"><collision><origin xyz="0 0 0.3"/>
    <geometry><capsule radius="0.04" length="0.4"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="lower"/><child link="hand"/>
    <origin xyz="0 0 0.6"/><axis xyz="0 0 2"/><limit lower="0.05" upper="0.3"/></joint>
  <link name="hand"><collision>
    <geometry><mesh filename="parts.obj" scale="0.1 0.1 0.1"/></geometry></collision></link>
  <joint name="cart" type="planar"><parent link="base"/><child link="wagon"/><axis xyz="0 0 1"/>
  </joint>
  <link name="wagon"><collision>
    <geometry><mesh filename="part.stl" scale="0.2 0.2 -0.254"/></geometry></collision></link>
  <joint name="free" type="floating"><parent link="base"/><child link="ball"/></joint>
  <link name="ball"><collision><geometry><sphere radius="0.2"/></geometry></collision></link>
</robot>"""

ALL_SRDF = """<robot name="all">
  <disable_collisions link1="upper" link2="base"/><disable_collisions link1="hand" link2="lower"/>
</robot>"""


@pytest.fixture
def chain(tmp_path: pathlib.Path, client: hulld.Client) -> Iterator[hulld.Robot]:
    (tmp_path / "chain.urdf").write_text(CHAIN)
    with hulld.Robot.from_urdf(tmp_path / "chain.urdf", client=client) as robot:
        yield robot


@pytest.fixture
def all_kinds(tmp_path: pathlib.Path) -> pathlib.Path:
    (tmp_path / "all.urdf").write_text(ALL_KINDS)
    (tmp_path / "all.srdf").write_text(ALL_SRDF)
    (tmp_path / "parts.obj").write_text(box_obj("o a", 0, 1) + box_obj("o b", 1.5, 9))
    solid = np.concatenate([TRIANGLES, TRIANGLES[:, ::-1]])
    (tmp_path / "part.stl").write_bytes(binary_stl(solid))
    return tmp_path / "all.urdf"


@pytest.fixture
def hullctl(server: hulld.LocalServer) -> Callable[..., list[dict[str, Any]]]:
    """Runs `hullctl robot check`, and returns its answers."""

    def run(*arguments: object) -> list[dict[str, Any]]:
        command = [str(hulld.find_program("hullctl")), "robot", "check", *map(str, arguments)]
        done = subprocess.run(
            [*command, "--server", server.address, "--output", "json"],
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return [json.loads(line) for line in done.stdout.splitlines()]

    return run


def assert_same(check: hulld.RobotCheck, row: int, rows: list[dict[str, Any]]) -> None:
    """Compares one configuration with the answers of hullctl."""
    assert [check.names_of(i) for i in range(len(check.pairs))] == [(r["a"], r["b"]) for r in rows]
    assert check.pair_separations is not None
    for i, one in enumerate(rows):
        name = hulld.Relation(int(check.pair_relations[row, i])).name
        assert f"RELATION_{name}" == one["relation"]
        separation = one["separation"]["value"]
        # Sine and cosine of numpy and of the C library may differ in the last place.
        assert check.pair_separations[row, i] == pytest.approx(separation, rel=1e-9, abs=1e-13)
    strongest = min(rows, key=lambda one: float(one["separation"]["value"]))
    assert check[row].pair == (strongest["a"], strongest["b"])
    assert f"RELATION_{check[row].relation.name}" == strongest["relation"]


@pytest.mark.parametrize("options", [{}, {"srdf": True}, {"adjacent": True}, {"split": False}])
def test_answers_are_those_of_hullctl(
    all_kinds: pathlib.Path,
    client: hulld.Client,
    hullctl: Callable[..., list[dict[str, Any]]],
    rng: np.random.Generator,
    options: dict[str, Any],
) -> None:
    flags: list[object] = []
    if options.pop("srdf", False):
        options["srdf"] = all_kinds.with_suffix(".srdf")
        flags += ["--srdf", options["srdf"]]
    flags += ["--adjacent"] if "adjacent" in options else []
    flags += ["--split", "none"] if "split" in options else []
    with hulld.Robot.from_urdf(all_kinds, client=client, **options) as robot:
        base = (0.9, 0.1, -0.2, 0.4, 1, 2, 3)
        q = rng.uniform(-1, 1, (4, robot.dof))
        q[:, robot.variables.index("slide")] = (0.05, 0.1, 0.2, 0.3)
        q[3] = robot.rest
        check = robot.check(q, base=base, separation=True)
        assert len(set(check.relations.tolist())) > 1 or "adjacent" in options
        for row, values in enumerate(q.tolist()):
            joints = [f"{name}={value!r}" for name, value in zip(robot.variables, values)]
            given = [part for joint in joints for part in ("--joint", joint)]
            where = ["--base", ",".join(map(str, base))]
            assert_same(check, row, hullctl(all_kinds, *flags, *where, *given))


def test_a_ur5_is_that_of_hullctl(
    data: pathlib.Path,
    client: hulld.Client,
    hullctl: Callable[..., list[dict[str, Any]]],
    rng: np.random.Generator,
) -> None:
    folder = data / "example-robot-data/robots/ur_description"
    urdf, srdf = folder / "urdf/ur5_robot.urdf", folder / "srdf/ur5.srdf"
    with warnings.catch_warnings(record=True) as caught, hulld.Robot.from_urdf(
        urdf, srdf=srdf, client=client
    ) as robot:
        warnings.simplefilter("always")
        q = rng.uniform(*robot.limits.T, (100, robot.dof))
        check = robot.check(q, separation=True)
        for row in range(3):
            joints = [f"--joint={name}={x!r}" for name, x in zip(robot.variables, q[row].tolist())]
            assert_same(check, row, hullctl(urdf, "--srdf", srdf, *joints))
        quick = robot.check(q)
        assert (quick.relations == check.relations).all()
        assert (quick.pair_relations == check.pair_relations).all()
    assert [str(one.message)[:56] for one in caught] == [
        "the hull of forearm_link has 1.551 times the volume of i"
    ]


def random_urdf(rng: np.random.Generator) -> str:
    """A tree of 3 to 11 links with up to two shapes each, some of them bare, and joints of any
    kind, some of which mimic."""

    def numbers(count: int, low: float, high: float) -> str:
        return " ".join(map(repr, rng.uniform(low, high, count).tolist()))

    def origin() -> str:
        return f'<origin xyz="{numbers(3, -1, 1)}" rpy="{numbers(3, -1, 1)}"/>'

    shapes = (
        lambda: f'<box size="{numbers(3, 0.1, 0.6)}"/>',
        lambda: f'<sphere radius="{numbers(1, 0.1, 0.6)}"/>',
        lambda: f'<cylinder radius="{numbers(1, 0.1, 0.6)}" length="{numbers(1, 0.1, 0.6)}"/>',
        lambda: f'<capsule radius="{numbers(1, 0.1, 0.6)}" length="{numbers(1, 0.1, 0.6)}"/>',
    )
    links = [f"link{i}" for i in rng.permutation(int(rng.integers(3, 12)))]
    text, leaders = '<robot name="random">', []
    for index, link in enumerate(links):
        text += f'<link name="{link}">'
        for _ in range(int(rng.choice([0, 1, 1, 2]))):
            shape = shapes[int(rng.integers(len(shapes)))]()
            text += f"<collision>{origin()}<geometry>{shape}</geometry></collision>"
        text += "</link>"
        if index == 0:
            continue
        kinds = ["fixed", "fixed", "revolute", "continuous", "prismatic", "planar", "floating"]
        kind, name = str(rng.choice(kinds)), f"joint{rng.integers(1000)}-{index}"
        text += (
            f'<joint name="{name}" type="{kind}"><parent link="{links[int(rng.integers(index))]}"/>'
            f'<child link="{link}"/>{origin()}<axis xyz="{numbers(3, -1, 1)}"/>'
            '<limit lower="-1" upper="1"/>'
        )
        if kind in ("revolute", "continuous", "prismatic"):
            if leaders and rng.random() < 0.3:
                leader, (a, b) = rng.choice(leaders), rng.uniform(-1, 1, 2).tolist()
                text += f'<mimic joint="{leader}" multiplier="{a}" offset="{b}"/>'
            leaders.append(name)
        text += "</joint>"
    return text + "</robot>"


def test_random_robots_are_those_of_hullctl(
    tmp_path: pathlib.Path,
    client: hulld.Client,
    hullctl: Callable[..., list[dict[str, Any]]],
    rng: np.random.Generator,
) -> None:
    path, compared = tmp_path / "random.urdf", 0
    while compared < 12:
        path.write_text(random_urdf(rng))
        try:
            robot = hulld.Robot.from_urdf(path, client=client)
        except ValueError as error:
            assert "no link has a <collision> element" in str(error)
            continue
        if not robot.pairs:
            continue
        with robot:
            q = rng.uniform(-1, 1, robot.dof)
            joints = [f"--joint={name}={x!r}" for name, x in zip(robot.variables, q.tolist())]
            with warnings.catch_warnings():
                # Joints that mimic may be beyond their limits.
                warnings.simplefilter("ignore")
                check = robot.check(q, separation=True)
            assert_same(check, 0, hullctl(path, *joints))
        compared += 1


# --- Answers ---


def value_of(check: hulld.RobotCheck) -> float:
    assert check.separation is not None
    return check.separation.value


def test_one_configuration_has_a_relation_a_separation_and_a_pair(chain: hulld.Robot) -> None:
    check = chain.check([0, 0], separation=True)
    assert (check.relation.name, check.pair) == ("SEPARATED", ("a", "c"))
    assert value_of(check) == pytest.approx(1)
    assert repr(check) == f"RobotCheck(SEPARATED, separation={value_of(check)!r}, a with c)"
    assert chain.pairs == [("a", "c")] and check.first_contact is None
    touching = chain.check({"j": -1})
    assert (touching.relation.name, touching.separation, touching.pair) == (
        "TOUCHING", None, ("a", "c"),
    )  # fmt: skip
    quick = chain.check({"j": 0})
    assert quick.pair is None and quick.deciding.tolist() == [-1]
    with pytest.raises(TypeError, match="neither true nor false"):
        bool(check)


def test_a_trajectory_has_a_first_contact(chain: hulld.Robot) -> None:
    j = [0, -0.5, -1, -2, 0]
    for separation in (False, True):
        check = chain.check({"j": j}, separation=separation)
        assert [one.relation.name for one in check] == [
            "SEPARATED", "SEPARATED", "TOUCHING", "OVERLAPPING", "SEPARATED",
        ]  # fmt: skip
        assert check.first_contact == 2 and check.colliding.tolist() == [False] * 2 + [True] * 2 + [
            False
        ]
        assert (check.relation.name, check.pair) == ("OVERLAPPING", ("a", "c"))
    assert check.separations is not None
    assert check.separations.tolist() == pytest.approx([1, 0.5, 0, -1, 1])
    assert check[-1].relation.name == "SEPARATED" and value_of(check[-1]) == pytest.approx(1)
    assert repr(check).endswith("a with c, 2 of 5 configurations colliding)")
    with pytest.raises(IndexError):
        check[5]


def test_many_configurations_are_split_over_several_calls(
    chain: hulld.Robot, monkeypatch: pytest.MonkeyPatch, client: hulld.Client, name: str
) -> None:
    client.append_points(name, CUBE, create=True)
    q = np.zeros((100, 2))
    q[:, 1] = np.linspace(0, -2, 100)
    scene = [(name, (1.2, -0.5, -0.5))]
    whole = chain.check(q, scene=scene, separation=True, clearance=0.25)
    monkeypatch.setattr("hulld.robot.robot._PAIRS_PER_CALL", 30)
    parts = chain.check(q, scene=scene, separation=True, clearance=0.25)
    for column in ("relations", "deciding", "separations", "within_clearance", "pair_separations"):
        assert (getattr(whole, column) == getattr(parts, column)).all(), column
    assert whole.separations is not None and whole.within_clearance is not None
    assert (whole.within_clearance == (whole.separations <= 0.25)).all()
    nothing = chain.check(np.empty((0, 2)), scene=scene, separation=True)
    assert len(nothing) == 0 and nothing.first_contact is None
    assert repr(nothing) == "RobotCheck(0 configurations)"
    with pytest.raises(ValueError, match="no configuration"):
        _ = nothing.relation


def test_a_scene_surrounds_the_robot(chain: hulld.Robot, client: hulld.Client, name: str) -> None:
    client.append_points(name, CUBE, create=True)
    scene = [(name, (0, 0, 0.5)), (name, (9, 0, 0))]
    check = chain.check([[0, 0], [0, -2]], scene=scene, separation=True)
    assert [check.names_of(i) for i in range(7)] == [
        ("a", "c"),
        *((part, f"{name}[{i}]") for part in "abc" for i in (0, 1)),
    ]
    assert check[0].relation.name == "TOUCHING" and check[0].pair == ("a", f"{name}[0]")
    assert check[1].relation.name == "OVERLAPPING" and check[1].pair == ("a", "c")
    without = [("a", f"{name}[0]"), ("b", name), (name, "c"), ("c", "a")]
    left = chain.check([0, 0], scene=scene, ignore=without, separation=True)
    assert left.pair == ("a", f"{name}[1]") and left.relation.name == "SEPARATED"
    moved = chain.check([0, 0], scene=scene, base=(0, 0, -3), separation=True)
    assert moved.pair == ("a", "c") and value_of(moved) == pytest.approx(1)
    with pytest.raises(ValueError, match=r"ignore: \('a', 'x'\) is not a checked pair"):
        chain.check([0, 0], scene=scene, ignore=[("a", "x")])
    with pytest.raises(ValueError, match="no pair of chain is left"):
        chain.check([0, 0], ignore=[("a", "c")])
    with pytest.raises(
        hulld.NotFoundError, match='a with nowhere in configuration 0: hull "nowhere"'
    ):
        chain.check([[0, 0], [1, 1]], scene=["nowhere"])


def test_bodies_surround_the_robot(chain: hulld.Robot, client: hulld.Client, name: str) -> None:
    client.append_points(name, CUBE, create=True)
    client.put_body(f"{name}/body", [(name, (9, 9, 9)), (name, (-0.5, 0, 0.25))])
    check = chain.check([0, 0], scene=[f"{name}/body"], separation=True)
    assert check.relation.name == "OVERLAPPING" and check.pair == ("a", f"{name}/body")


def test_values_beyond_limits_are_used_with_a_warning(chain: hulld.Robot) -> None:
    with pytest.warns(UserWarning, match=r"^j is at 5.0, beyond its limits -3.0 to 1.0$") as caught:
        assert value_of(chain.check([0, 5], separation=True)) == pytest.approx(6)
    assert caught[0].filename == __file__
    with pytest.warns(UserWarning, match="j is at 2.0, .*, in 2 of 3 configurations"):
        chain.check({"j": [0, 2, 3]})


# --- Hulls on the server ---


def test_hulls_are_deleted_unless_a_prefix_keeps_them(
    tmp_path: pathlib.Path, client: hulld.Client, name: str
) -> None:
    def ids(prefix: str) -> list[str]:
        return [hull.hull_id for hull in client.list_hulls(prefix)]

    (tmp_path / "chain.urdf").write_text(CHAIN.replace('link name="b"', 'link name="b"'))
    with hulld.Robot.from_urdf(tmp_path / "chain.urdf", client=client) as robot:
        assert ids("robot/") == []
        robot.check([0, 0])
        assert [one.rpartition("/")[2] for one in ids("robot/")] == ["a", "b", "c"]
        robot.close()
        assert ids("robot/") == []
        assert robot.check([0, 0]).relation.name == "SEPARATED"
    assert ids("robot/") == []
    for _ in range(2):
        with hulld.Robot.from_urdf(
            tmp_path / "chain.urdf", client=client, prefix=f"{name}/"
        ) as kept:
            kept.check([0, 0])
    assert ids(f"{name}/") == [f"{name}/a", f"{name}/b", f"{name}/c"]


def test_names_that_are_not_ids_are_registered(
    tmp_path: pathlib.Path, client: hulld.Client, name: str
) -> None:
    text = CHAIN.replace('"a"', '"ä 1"').replace('"b"', '"ö 1"').replace('"c"', '"_c"')
    (tmp_path / "names.urdf").write_text(text)
    robot = hulld.Robot.from_urdf(tmp_path / "names.urdf", client=client, prefix=f"{name}/")
    assert robot.check([0, 0], separation=True).pair == ("ä 1", "_c")
    hulls = [hull.hull_id for hull in client.list_hulls(f"{name}/")]
    assert hulls == [f"{name}/x__1", f"{name}/x__1-2", f"{name}/x_c"]


def test_threads_share_a_robot_of_the_private_server(tmp_path: pathlib.Path) -> None:
    (tmp_path / "chain.urdf").write_text(CHAIN)
    robots = [hulld.Robot.from_urdf(tmp_path / "chain.urdf") for _ in range(2)]
    found: list[str] = []

    def count() -> int:
        return len(list(robots[0].client.list_hulls("robot/")))

    before = count()

    def ask(robot: hulld.Robot) -> None:
        found.append(robot.check({"j": [0, -2]}).relation.name)

    threads = [threading.Thread(target=ask, args=(robots[i % 2],)) for i in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == ["OVERLAPPING"] * 6
    assert robots[0].client is robots[1].client
    assert count() == before + 6
    for robot in robots:
        robot.close()
    assert count() == before
