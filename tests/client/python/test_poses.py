"""Poses: accepted forms, conversion of matrices, and refusals."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import hulld
from hulld.geometry.placements import as_pairs
from hulld.geometry.poses import matrices_of

IDENTITY = [1, 0, 0, 0, 0, 0, 0]


def matrix(rotation: object, translation: object = (0, 0, 0)) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3] = rotation
    X[:3, 3] = translation
    return X


def test_each_form_of_a_pose_is_taken() -> None:
    for form in (None, hulld.Pose(), np.eye(4), IDENTITY, (0, 0, 0)):
        assert hulld.pack_poses([form]).tolist() == [IDENTITY]
    assert hulld.pack_poses([None, (1, 2, 3), np.eye(4)])[1].tolist() == [1, 0, 0, 0, 1, 2, 3]
    assert hulld.pack_poses(np.zeros((5, 3))).tolist() == [IDENTITY] * 5
    assert hulld.pack_poses(np.tile(np.eye(4), (5, 1, 1))).tolist() == [IDENTITY] * 5
    assert hulld.pack_poses([]).shape == (0, 7)


def test_packed_doubles_pass_as_they_are(rng: np.random.Generator) -> None:
    numbers = rng.normal(size=(100, 7)) * 10.0 ** rng.integers(-300, 300, (100, 1))
    assert hulld.pack_poses(numbers).tobytes() == numbers.tobytes()
    pose = hulld.Pose.from_packed(numbers[0])
    assert pose.packed().tobytes() == numbers[0].tobytes()


@pytest.mark.parametrize("shape", [(4,), (3, 4), (2, 5), (2, 3, 3)])
def test_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="poses have the shape"):
        hulld.pack_poses(np.zeros(shape))
    with pytest.raises(ValueError, match=r"poses\[1\]: a pose has the shape"):
        hulld.pack_poses([None, np.zeros(shape)])


def test_quarter_turns_are_exact() -> None:
    turns = 0
    for axes in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            R = np.zeros((3, 3))
            R[range(3), axes] = signs
            if np.linalg.det(R) < 0:
                continue
            turns += 1
            w, x, y, z = hulld.Pose.from_matrix(matrix(R)).rotation
            # The rotation of an unnormalized quaternion, in integers: no rounding anywhere.
            norm = w * w + x * x + y * y + z * z
            exact = np.array(
                [
                    [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
                    [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
                    [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
                ]
            )
            assert (exact == norm * R).all()
    assert turns == 24


def test_a_rotation_comes_back_within_rounding(rng: np.random.Generator) -> None:
    packed = rng.normal(size=(2000, 7))
    # Near half turns, where each of the four components is the largest in turn, and small ones.
    packed[:400, 0] *= 1e-9
    packed[400:800, 1:4] *= 1e-9
    matrices = matrices_of(packed)
    again = matrices_of(hulld.pack_poses(matrices))
    assert np.abs(again - matrices).max() < 2e-15
    assert {int(i) for i in np.argmax(np.abs(packed[:, :4]), axis=1)} == {0, 1, 2, 3}


def test_the_error_states_how_far_a_matrix_is_from_orthogonal() -> None:
    with pytest.raises(ValueError, match=r"from the identity by 0\.0201, and at most 1e-09"):
        hulld.Pose.from_matrix(matrix(np.diag([1.01, 1, 1])))
    many = np.tile(np.eye(4), (10, 1, 1))
    many[7, 0, 1] = 1e-3
    with pytest.raises(ValueError, match=r"poses\[7\]: the rotation is not orthogonal.*by 0\.001,"):
        hulld.pack_poses(many)
    with pytest.raises(ValueError, match=r"poses\[1\]: the rotation is not orthogonal"):
        hulld.pack_poses([None, many[7]])


def test_the_caller_chooses_the_tolerance() -> None:
    rough = matrix(np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0])
    rough[:3, :3] *= np.sign(np.linalg.det(rough[:3, :3]))
    rough = rough.astype(np.float32).astype(float)
    with pytest.raises(ValueError, match="orthogonal"):
        hulld.Pose.from_matrix(rough)
    pose = hulld.Pose.from_matrix(rough, tolerance=1e-6)
    assert np.abs(pose.matrix() - rough).max() < 1e-6


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (np.diag([1.0, 1, -1, 1]), "contains a reflection"),
        (np.diag([1.0, 1, 1, 2]), "last row"),
        (np.full((4, 4), np.nan), "not finite"),
        (np.zeros((4, 4)), "last row"),
        (np.diag([0.0, 0, 0, 1]), "deviates from the identity by 1,"),
        (np.diag([1e200, 1, 1, 1]), "deviates from the identity by inf"),
    ],
)
def test_invalid_matrices_are_refused(bad: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hulld.Pose.from_matrix(bad)


def test_numbers_that_no_double_represents_are_refused() -> None:
    with pytest.raises(ValueError, match=rf"pose\[0\] is {2**53 + 1}, which no double represents"):
        hulld.pack_poses([np.array([2**53 + 1, 0, 0])])
    with pytest.raises(ValueError, match="no double represents"):
        hulld.pack_poses(np.ones((1, 7), np.longdouble) / 3)
    with pytest.raises(TypeError, match="not numbers"):
        hulld.pack_poses([("a", "b", "c")])
    assert hulld.pack_poses(np.ones((1, 3), np.float32)).dtype == np.float64


def test_a_pose_has_four_and_three_numbers() -> None:
    with pytest.raises(ValueError, match="rotation has 3 numbers"):
        hulld.Pose((1, 0, 0))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="seven"):
        hulld.Pose.from_packed([1, 2, 3])


def test_placements_are_packed_with_each_id_once() -> None:
    packed = hulld.Placements.of(["a", ("b", (1, 0, 0)), hulld.Placement("a", (2, 0, 0))])
    assert packed.ids == ["a", "b"] and packed.indices.tolist() == [0, 1, 0]
    assert packed[2] == hulld.Placement("a", hulld.Pose((1, 0, 0, 0), (2, 0, 0)))
    assert len(hulld.Placements("a", np.zeros((5, 3)))) == 5
    assert len(hulld.Placements(["a", "b"])) == 2
    assert len(hulld.Placements.of([])) == 0


def test_lists_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="3 poses for 2 placements"):
        hulld.Placements(["a", "b"], np.zeros((3, 3)))
    with pytest.raises(ValueError, match=r"indices\[1\] is 2; indices start at 0"):
        hulld.Placements(["a", "b"], np.zeros((2, 3)), [0, 2])
    with pytest.raises(TypeError, match="one ID"):
        hulld.Placements.of("a")
    with pytest.raises(TypeError, match="not a placement"):
        hulld.Placements.of([3])  # type: ignore[list-item]


def test_pairs_are_two_indices_each() -> None:
    assert hulld.all_pairs(4).tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
    assert as_pairs([], 0).shape == (0, 2)
    with pytest.raises(ValueError, match=r"pairs\[1\]\[0\] is -1"):
        as_pairs([(0, 1), (-1, 0)], 2)
    with pytest.raises(ValueError, match=r"\(m, 2\)"):
        as_pairs([0, 1], 2)
    with pytest.raises(TypeError, match="not integers"):
        as_pairs([(0.5, 1)], 2)
