"""Laws of the analytic solve: FK(IK(x)) = x, twists kept, frames irrelevant, degenerate bones."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.body.analytic_solve import solve, solve_with
from robojackson.body.forward_kinematics import forward, split
from robojackson.body.skeleton import AIM_CHILD, PARENTS, REST_JOINTS

FRAMES = 40
NO_TWIST = np.broadcast_to([1.0, 0.0], (FRAMES, 23, 2))
METHODS = ["adaptive", "naive"]
SAFEGUARDED = 5e-4
"""How far HybrIK's safeguard moves rotations and points of these poses (naive)."""


def random_rotations(seed: int, shape: tuple[int, int], largest: float) -> np.ndarray:
    rng = np.random.default_rng(seed)
    vectors = Rotation.random(shape[0] * shape[1], rng=rng).as_rotvec()
    vectors *= rng.uniform(0.0, largest, size=(len(vectors), 1)) / np.pi
    return Rotation.from_rotvec(vectors).as_matrix().reshape(*shape, 3, 3)


def pose_and_twist(seed: int, largest: float = 1.2) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return local rotations, the points that they pose, and the twists in them."""
    local = random_rotations(seed, (FRAMES, 24), largest)
    points = forward(local, REST_JOINTS[None], np.zeros((FRAMES, 3))).points
    twists = np.empty((FRAMES, 23, 2))
    for joint in range(1, 24):
        bone = REST_JOINTS[AIM_CHILD[joint]] - REST_JOINTS[joint]
        twists[:, joint - 1] = split(local[:, joint], bone)[1]
    return local, points, twists


def within(method: str, exact: float) -> float:
    return exact if method == "adaptive" else SAFEGUARDED


@pytest.mark.parametrize("method", METHODS)
def test_solving_a_posed_skeleton_restores_its_rotations(method: str) -> None:
    local, points, twists = pose_and_twist(0)
    solved = solve(points, REST_JOINTS[None], twists, method)
    assert np.allclose(solved, local, atol=within(method, 1e-8))


@pytest.mark.parametrize("method", METHODS)
def test_the_solution_poses_the_skeleton_onto_the_keypoints(method: str) -> None:
    _, points, twists = pose_and_twist(1, largest=3.0)
    local = solve(points, REST_JOINTS[None], twists, method)
    reached = forward(local, REST_JOINTS[None], points[:, 0]).points
    assert np.allclose(reached, points, atol=within(method, 1e-7))


@pytest.mark.parametrize("method", METHODS)
def test_every_bone_gets_the_twist_that_was_requested(method: str) -> None:
    _, points, _ = pose_and_twist(2)
    angle = np.random.default_rng(2).uniform(-1.0, 1.0, size=(FRAMES, 23))
    expected = np.stack([np.cos(angle), np.sin(angle)], -1)
    local = solve(points, REST_JOINTS[None], expected, method)
    for joint in range(1, 24):
        bone = REST_JOINTS[AIM_CHILD[joint]] - REST_JOINTS[joint]
        assert np.allclose(
            split(local[:, joint], bone)[1], expected[:, joint - 1], atol=within(method, 1e-7)
        )


@pytest.mark.parametrize("method", METHODS)
def test_turning_the_keypoints_turns_only_the_root(method: str) -> None:
    _, points, twists = pose_and_twist(3)
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    before = solve(points, REST_JOINTS[None], twists, method)
    after = solve(points @ turn.T, REST_JOINTS[None], twists, method)
    assert np.allclose(after[:, 0], turn @ before[:, 0], atol=within(method, 1e-9))
    assert np.allclose(after[:, 1:], before[:, 1:], atol=within(method, 1e-9))


def test_a_shift_of_the_keypoints_changes_nothing() -> None:
    _, points, twists = pose_and_twist(4)
    moved = solve(points + [3.0, -2.0, 5.0], REST_JOINTS[None], twists)
    assert np.allclose(moved, solve(points, REST_JOINTS[None], twists), atol=1e-9)


def test_one_rest_pose_and_one_a_frame_agree() -> None:
    _, points, twists = pose_and_twist(5)
    many = np.broadcast_to(REST_JOINTS, (FRAMES, 29, 3))
    assert np.array_equal(solve(points, many, twists), solve(points, REST_JOINTS[None], twists))


def test_adaptive_ends_nearer_to_noisy_keypoints_than_naive() -> None:
    _, points, twists = pose_and_twist(6)
    noisy = points + np.random.default_rng(6).normal(scale=0.008, size=points.shape)
    ends = []
    for method in METHODS:
        local = solve(noisy, REST_JOINTS[None], twists, method)
        reached = forward(local, REST_JOINTS[None], noisy[:, 0]).points
        ends.append(np.linalg.norm(reached - noisy, axis=-1)[:, 18:24].mean())
    assert ends[0] < 0.85 * ends[1]


def test_a_target_too_far_is_aimed_at_with_the_predicted_bone() -> None:
    """Over the carry-over limit adaptive follows the direction of the prediction, as naive does."""
    _, points, twists = pose_and_twist(7)
    moved = points.copy()
    below = [4, 7, 10, 27]
    moved[:, below] += [1.0, 0.0, 0.0]
    local = solve(moved, REST_JOINTS[None], twists)
    reached = forward(local, REST_JOINTS[None], moved[:, 0]).points
    shin, expected = reached[:, 7] - reached[:, 4], moved[:, 7] - moved[:, 4]
    assert np.allclose(np.cross(shin, expected), 0.0, atol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_bones_of_no_length_give_rotations_and_no_nan(method: str) -> None:
    points = np.zeros((3, 29, 3))
    local = solve(points, REST_JOINTS[None], NO_TWIST[:3], method)
    assert np.allclose(local @ local.swapaxes(-1, -2), np.eye(3), atol=1e-9)


@pytest.mark.parametrize("bend", [np.pi, np.pi - 1e-8, 1e-8])
def test_a_shin_folded_onto_the_thigh_is_reached(bend: float) -> None:
    local = np.broadcast_to(np.eye(3), (1, 24, 3, 3)).copy()
    bone = REST_JOINTS[7] - REST_JOINTS[4]
    across = np.cross(bone, [0.0, 0.0, 1.0])
    local[0, 4] = Rotation.from_rotvec(bend * across / np.linalg.norm(across)).as_matrix()
    points = forward(local, REST_JOINTS[None], np.zeros((1, 3))).points
    solved = solve(points, REST_JOINTS[None], NO_TWIST[:1])
    reached = forward(solved, REST_JOINTS[None], points[:, 0]).points
    assert np.allclose(reached[:, 7], points[:, 7], atol=1e-6)


def test_the_tree_lists_parents_before_children() -> None:
    assert all(parent < child for child, parent in enumerate(PARENTS))


@pytest.mark.parametrize("method", METHODS)
def test_a_joint_is_visited_once_however_many_frames_there_are(method: str) -> None:
    visits: list[int] = []

    def no_twist(joint: int, swung: np.ndarray) -> np.ndarray:
        visits.append(joint)
        return np.broadcast_to([1.0, 0.0], (len(swung), 2))

    points = np.broadcast_to(REST_JOINTS, (500, 29, 3))
    solve_with(points, REST_JOINTS[None], no_twist, method)
    assert sorted(visits) == list(range(1, 24))


@pytest.mark.parametrize("angle", [1e-9, 1e-4, np.pi - 1e-4, np.pi - 1e-9])
def test_bones_near_their_own_and_near_the_opposite_direction_are_reached(angle: float) -> None:
    """Every limb joint swung by nearly nothing or nearly half a turn about a random axis."""
    rng = np.random.default_rng(8)
    local = np.broadcast_to(np.eye(3), (FRAMES, 24, 3, 3)).copy()
    for joint in (1, 4, 7, 16, 18, 20):
        bone = REST_JOINTS[AIM_CHILD[joint]] - REST_JOINTS[joint]
        axis = np.cross(bone, rng.normal(size=(FRAMES, 3)))
        axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
        local[:, joint] = Rotation.from_rotvec(angle * axis).as_matrix()
    points = forward(local, REST_JOINTS[None], np.zeros((FRAMES, 3))).points
    solved = solve(points, REST_JOINTS[None], NO_TWIST)
    reached = forward(solved, REST_JOINTS[None], points[:, 0]).points
    assert np.abs(reached - points).max() < 1e-5
