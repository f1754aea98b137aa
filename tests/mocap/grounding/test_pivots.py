"""Feet that turn on the floor: they keep their heading, and are not planted while they turn."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.body.smoothing import lowpass
from robojackson.geometry.frames import CAMERA_TO_WORLD
from robojackson.mocap.grounding.pivots import turning
from robojackson.mocap.grounding.stance import GroundingConfig, Stance, ground_body
from robojackson.mocap.landmarks.bone_lengths import fit_skeleton
from robojackson.mocap.pose.posed_body import pose_landmarks
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import PLANTED

FPS = 30.0
STANDS = 30
"""Frames before and after a turn."""
CAMERA_M = np.array([-4.0, 0.0, -1.0])


def headings(degrees: float, seconds: float) -> np.ndarray:
    """Return the heading of somebody who stands, turns and stands, degrees."""
    turn = np.linspace(0.0, degrees, round(seconds * FPS))
    return np.concatenate([np.zeros(STANDS), turn, np.full(STANDS, degrees)])


def feet_that_turn(degrees: np.ndarray) -> np.ndarray:
    """Return foot points, of which the left foot turns about its heel."""
    feet = np.zeros((len(degrees), 4, 3))
    feet[:, 1] = 0.2 * np.stack(
        [np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0 * degrees], -1
    )
    feet[:, 3, 0] = 0.2
    return feet


def turned(hip_shake: LandmarkTrack, degrees: np.ndarray) -> Stance:
    """Ground the first recorded frame, turned about its left toe, with noise of a detector."""
    marks = hip_shake.world_landmarks[0] @ CAMERA_TO_WORLD.T
    seen = np.repeat(hip_shake.visibility[:1], len(degrees), axis=0)
    one = pose_landmarks(marks[None], seen[:1], fit_skeleton(marks[None], 0.6), "adaptive")
    toe = one.feet[0, 1] * [1.0, 1.0, 0.0]
    turns = Rotation.from_euler("z", degrees[:, None], degrees=True)
    points = np.stack([turn.apply(marks - toe) + toe for turn in turns])
    noise = np.random.default_rng(0).normal(0.0, 0.015, points.shape)
    points = points + lowpass(noise, FPS, 4.0) + CAMERA_M
    body = pose_landmarks(points, seen, fit_skeleton(points, 0.6), "adaptive")
    return ground_body(body, FPS, GroundingConfig())


def heading_errors(found: Stance, degrees: np.ndarray) -> np.ndarray:
    """Return the error of the left foot's turn since the first stand, degrees."""
    sole = found.body.feet[:, 1] - found.body.feet[:, 0]
    heading = np.unwrap(np.arctan2(sole[:, 1], sole[:, 0]))
    return np.abs(np.degrees(heading - heading[:20].mean()) - degrees)


@pytest.mark.parametrize(
    ("degrees", "seconds"), [(70.0, 0.5), (90.0, 1.0), (180.0, 0.6), (180.0, 3.0), (360.0, 3.0)]
)
def test_a_pivot_turns_the_foot(hip_shake: LandmarkTrack, degrees: float, seconds: float) -> None:
    """The foot within 12 degrees on average, 5 of them noise; planted points do not slide."""
    goal = headings(degrees, seconds)
    found = turned(hip_shake, goal)
    error = heading_errors(found, goal)
    assert error[-20:].mean() < 12.0
    assert error.mean() < 12.0
    planted = found.contact == PLANTED
    step = np.linalg.norm(np.diff(found.body.feet[..., :2], axis=0), axis=-1)
    assert FPS * step[planted[1:] & planted[:-1]].mean() < 0.01
    assert planted[5:20, :2].any(1).all()
    assert planted[-20:-5, :2].any(1).all()


def test_a_foot_that_stands_keeps_one_heading(hip_shake: LandmarkTrack) -> None:
    found = turned(hip_shake, np.zeros(60))
    assert heading_errors(found, np.zeros(60))[5:-5].max() < 0.5
    assert (found.contact[5:-5] == PLANTED).any(1).all()


@pytest.mark.parametrize("degrees", [-70.0, 90.0, 360.0])
def test_only_the_foot_that_turns_turns(degrees: float) -> None:
    goal = headings(degrees, 0.5)
    found = turning(feet_that_turn(goal), np.ones((len(goal), 4), bool), FPS)
    frames = np.flatnonzero(found[:, 0])
    assert len(frames)
    assert frames[0] >= STANDS
    assert frames[-1] < len(goal) - STANDS
    assert np.ptp(frames) == len(frames) - 1
    assert not found[:, 1].any()


def test_a_foot_in_the_air_does_not_turn_on_the_floor() -> None:
    goal = headings(180.0, 0.5)
    planted = np.repeat((np.abs(np.arange(len(goal)) - 37) > 10)[:, None], 4, axis=1)
    assert not turning(feet_that_turn(goal), planted, FPS).any()


def test_a_heading_that_wavers_within_the_window_is_a_stand() -> None:
    goal = 12.0 * np.sin(np.arange(90) / 7.0)
    assert not turning(feet_that_turn(goal), np.ones((90, 4), bool), FPS).any()
