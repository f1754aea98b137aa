"""The naive solve against HybrIK's formulas, joint by joint, with their safeguard.

HybrIK adds 1e-8 to each denominator. Denominators are products of two bones in square metres, and
the error grows along a limb where a bone turns by nearly pi: this, and not single precision, is how
formulas without it differ.
"""

import numpy as np
import pytest

from robojackson.body.analytic_solve import solve
from robojackson.body.forward_kinematics import forward
from robojackson.body.skeleton import AIM_CHILD, PARENTS, REST_JOINTS, keypoint
from tests.body.test_analytic_solve import random_rotations

SKELETONS = 16
SAFEGUARD = 1e-8
LARGEST = 1e-6
SPINE, LEFT, RIGHT = (keypoint(name) for name in ("spine1", "left_hip", "right_hip"))


def rodrigues(axis: np.ndarray, cosine: float, sine: float) -> np.ndarray:
    """Return I + sin K + (1 - cos) K K."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + sine * cross + (1.0 - cosine) * cross @ cross)


def swing(start: np.ndarray, end: np.ndarray, safeguard: float) -> np.ndarray:
    """Return the shortest turn from one vector to another."""
    normal = np.cross(start, end)
    sine = np.linalg.norm(normal)
    size = np.linalg.norm(start) * np.linalg.norm(end) + safeguard
    return rodrigues(normal / (sine + safeguard), start @ end / size, sine / size)


def root(points: np.ndarray, safeguard: float) -> np.ndarray:
    """Return the swing of the spine, then the turn about it that aligns the hips' centre."""
    rest, posed = REST_JOINTS - REST_JOINTS[0], points - points[0]
    swung = swing(rest[SPINE], posed[SPINE], safeguard)
    axis = posed[SPINE] / (np.linalg.norm(posed[SPINE]) + safeguard)
    before, after = swung @ (rest[LEFT] + rest[RIGHT]) / 2, (posed[LEFT] + posed[RIGHT]) / 2
    before, after = before - before @ axis * axis, after - after @ axis * axis
    return swing(before, after, safeguard) @ swung


def naive(points: np.ndarray, twists: np.ndarray, safeguard: float) -> np.ndarray:
    """Return the local rotations of one skeleton, (24, 3, 3)."""
    world = [root(points, safeguard)]
    local = list(world)
    for joint in range(1, 24):
        child, above = AIM_CHILD[joint], world[PARENTS[joint]]
        bone = REST_JOINTS[child] - REST_JOINTS[joint]
        swung = swing(bone, above.T @ (points[child] - points[joint]), safeguard)
        cosine, sine = twists[joint - 1] / (np.linalg.norm(twists[joint - 1]) + safeguard)
        local.append(swung @ rodrigues(bone / np.linalg.norm(bone), cosine, sine))
        world.append(above @ local[-1])
    return np.array(local)


@pytest.mark.parametrize("turn", [1.2, np.pi])
def test_our_naive_solve_is_hybriks(turn: float) -> None:
    """Every one of 16 x 24 rotations, also of poses of up to half a turn a joint."""
    local = random_rotations(11, (SKELETONS, 24), turn)
    points = forward(local, REST_JOINTS[None], np.zeros((SKELETONS, 3))).points
    angles = np.random.default_rng(11).uniform(-np.pi, np.pi, size=(SKELETONS, 23))
    twists = np.stack([np.cos(angles), np.sin(angles)], -1)
    ours = solve(points, REST_JOINTS[None], twists, "naive")
    pairs = list(zip(points, twists, strict=True))
    theirs = np.array([naive(each, turns, SAFEGUARD) for each, turns in pairs])
    plain = np.array([naive(each, turns, 0.0) for each, turns in pairs])
    assert np.abs(ours - theirs).max() < LARGEST
    assert np.abs(ours - theirs).max() < np.abs(plain - theirs).max()
