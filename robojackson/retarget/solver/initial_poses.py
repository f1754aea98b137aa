"""Starts of the whole-clip solver: the rest pose, and inverse kinematics of every frame by itself.

The second solves each frame from several poses at once and picks one a frame so that the picks make
the smoothest cheap motion (Viterbi); its keypoint error is the kinematic floor of the clip.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from robojackson.geometry.rotations import from_rotation
from robojackson.geometry.shortest_path import viterbi
from robojackson.metrics.retarget_error import keypoint_error_mm
from robojackson.retarget.solver.block_banded import Normal
from robojackson.retarget.solver.clip_problem import Problem
from robojackson.retarget.solver.cost_terms import keypoint_normal
from robojackson.retarget.solver.levenberg_marquardt import clip_to_limits, free_unknowns
from robojackson.robot.resampling import resample
from robojackson.robot.tree_kinematics import continuous, integrate, pose

_ITERATIONS = 15
_LARGEST_TURN = 0.7  # radians a step
_STILL = 3e-3  # radians and metres: a pose whose step is smaller has arrived
_LONG = 80  # frames from which every second one is enough
_JUMP_COST = 0.02  # m2/rad2: price of a hinge change between frames beside keypoint errors


def rest_start(problem: Problem) -> Float[np.ndarray, "N nq"]:
    """Return the rest pose in every frame, turned to the trunk and hung at the hip target."""
    robot, targets = problem.robot, problem.targets
    qpos = np.tile(robot.standing, (len(targets), 1))
    qpos[:, 3:7] = from_rotation(Rotation.from_matrix(targets.heading))
    hips = pose(problem.tree, qpos).site_pos[:, robot.keypoint_names.index("pelvis")]
    qpos[:, :3] += targets.keypoints_w[:, robot.keypoint_names.index("pelvis")] - hips
    return continuous(qpos)


@dataclass(frozen=True)
class FrameStart:
    """Inverse kinematics of every frame by itself.

    Attributes:
        qpos: A motion through the picked poses.
        floor_mm: Mean error of the best pose of each frame: the kinematic floor, millimetres.
    """

    qpos: Float[np.ndarray, "N nq"]
    floor_mm: float


def frame_start(problem: Problem, rng: np.random.Generator, seeds: int) -> FrameStart:
    """Return the best of several per-frame solutions, chosen along the clip.

    A long clip is solved in every second frame, with a spline between them.
    """
    stride = 2 if len(problem.targets) >= _LONG and not problem.ring else 1
    frames = np.arange(0, len(problem.targets), stride)
    rest = rest_start(problem)[frames]
    starts = np.repeat(rest[None], seeds, axis=0)
    spread = problem.robot.upper - problem.robot.lower
    starts[1:, :, 7:] += 0.5 * spread * rng.uniform(-1, 1, (seeds - 1, 1, len(spread)))
    poses, cost = _per_frame(
        problem, starts.reshape(seeds * len(frames), -1), np.tile(frames, seeds)
    )
    poses = poses.reshape(seeds, len(frames), -1)
    pick = viterbi(cost.reshape(seeds, -1).T, _jump_costs(poses[..., 7:].swapaxes(0, 1)))
    picked = continuous(poses[pick, np.arange(len(frames))])
    best = poses[cost.reshape(seeds, -1).argmin(axis=0), np.arange(len(frames))]
    at, target = pose(problem.tree, best).site_pos, problem.targets.keypoints_w[frames]
    floor = keypoint_error_mm(at, target, problem.robot.keypoint_weights > 0).mean()
    between = np.arange(len(problem.targets)) / stride
    motion = picked if stride == 1 else resample(picked, between, None)
    return FrameStart(motion, float(floor))


def _per_frame(
    problem: Problem, start: Float[np.ndarray, "P nq"], frames: Int[np.ndarray, " P"]
) -> tuple[Float[np.ndarray, "P nq"], Float[np.ndarray, " P"]]:
    """Return the damped Gauss-Newton on keypoints and posture, all poses at once, without
    coupling."""
    qpos, cost = clip_to_limits(problem.robot, start), np.zeros(len(start))
    moving = np.arange(len(start))
    for _ in range(_ITERATIONS):
        step, cost[moving] = _frame_step(problem, qpos[moving], frames[moving])
        qpos[moving] = clip_to_limits(problem.robot, integrate(qpos[moving], step))
        moving = moving[np.abs(step).max(axis=1) > _STILL]
        if not len(moving):
            break
    return qpos, cost


def _frame_step(
    problem: Problem, qpos: Float[np.ndarray, "P nq"], frames: Int[np.ndarray, " P"]
) -> tuple[Float[np.ndarray, "P nv"], Float[np.ndarray, " P"]]:
    """Return the step of each pose, and its keypoint cost before it."""
    weight, unknowns = problem.weights.posture, qpos.shape[1] - 1
    normal = Normal.empty(len(qpos), unknowns)
    cost = keypoint_normal(problem, pose(problem.tree, qpos), normal, frames)
    normal.gradient[:, 6:] += weight * (qpos[:, 7:] - problem.robot.rest)
    free = free_unknowns(problem.robot, qpos, normal.gradient)
    damping = np.concatenate([np.full(6, 1e-4), np.full(unknowns - 6, weight + 3e-3)])
    matrix = normal.blocks[0] * (free[:, :, None] & free[:, None, :]) + np.diag(damping)
    step = -np.linalg.solve(matrix, (normal.gradient * free)[..., None])[..., 0]
    return step * np.minimum(
        1.0, 0.7 / np.abs(step[:, 3:]).max(axis=1, keepdims=True).clip(1e-9)
    ), cost


def _jump_costs(hinges: Float[np.ndarray, "N M J"]) -> Iterator[Float[np.ndarray, "M M"]]:
    """Yield what a change from each candidate of a frame to each of the next one costs, m2."""
    for before, after in pairwise(hinges):
        yield _JUMP_COST * np.sum((before[:, None] - after[None]) ** 2, axis=-1)
