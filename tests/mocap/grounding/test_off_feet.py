"""A body that does not stand on its feet: its hands, head or back are on the floor, its feet are in
the air."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.body.feet import foot_points
from robojackson.body.skeleton import REST_JOINTS, keypoint, pair
from robojackson.formats.foreign_motion import ForeignMotion
from robojackson.geometry.frames import CAMERA_TO_WORLD
from robojackson.mocap.grounding import floor
from robojackson.mocap.grounding.stance import GroundingConfig, ground_body
from robojackson.mocap.imported_motion import ground_foreign_motion
from robojackson.mocap.landmarks.bone_lengths import fit_skeleton
from robojackson.mocap.pose.posed_body import Body, pose_landmarks, pose_sequence
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import AIR, PLANTED
from tests.fixtures.person import UPRIGHT

FPS = 30.0
CAMERA_M = np.array([-4.0, 0.0, -1.0])
"""The standing person in front of the camera."""
OVER = np.concatenate(
    [np.zeros(30), np.linspace(0.0, 180.0, 20), np.full(40, 180.0), np.linspace(180.0, 0.0, 20)]
)
AROUND = np.concatenate([np.zeros(30), np.linspace(0.0, 360.0, 40), np.full(30, 360.0)])
LEGS_UP = np.full(60, -130.0)
HANDSTAND = np.full(60, 180.0)
TURNS = {"over": (OVER, "x"), "around": (AROUND, "x"), "legs up": (LEGS_UP, "y"),
         "handstand": (HANDSTAND, "x")}  # fmt: skip


def turned(axis: str, degrees: np.ndarray) -> Rotation:
    """Return rotations about an axis of the world."""
    return Rotation.from_euler(axis, degrees[:, None], degrees=True)


def turned_body(hip_shake: LandmarkTrack, turn: Rotation) -> Body:
    """Return the first recorded frame turned, its lowest part at one height."""
    marks = hip_shake.world_landmarks[0] @ CAMERA_TO_WORLD.T
    points = np.stack([each.apply(marks) for each in turn])
    seen = np.repeat(hip_shake.visibility[:1], len(points), axis=0)
    rest = fit_skeleton(points, 0.6)
    body = pose_landmarks(points, seen, rest, "adaptive")
    lowest = np.minimum(floor.lowest_part(body.pose.points), body.feet[..., 2].min(1))
    return body.shifted(CAMERA_M - np.outer(lowest, [0.0, 0.0, 1.0]))


@pytest.mark.parametrize("name", TURNS)
def test_a_turned_body_stands_on_what_is_lowest(hip_shake: LandmarkTrack, name: str) -> None:
    degrees, axis = TURNS[name]
    seen = turned_body(hip_shake, turned(axis, degrees))
    found = ground_body(seen, FPS, GroundingConfig())
    points, feet = found.body.pose.points, found.body.feet
    expected = seen.pose.points[:, 0, 2] - CAMERA_M[2]
    assert points[..., 2].min() > -0.1
    assert np.abs(points[:, 0, 2] - expected).max() < 0.12
    assert feet[found.contact == PLANTED][:, 2].max(initial=0.0) < 0.5
    assert (found.contact[np.cos(np.radians(degrees)) < -0.5] == AIR).mean() > 0.9
    if name in ("over", "around"):
        assert (found.contact[:25] == PLANTED).all()


@pytest.mark.parametrize("name", TURNS)
def test_an_imported_body_stands_on_what_is_lowest(name: str) -> None:
    """Its arms are over its head."""
    degrees, axis = TURNS[name]
    turns = np.tile(np.eye(3), (len(degrees), 24, 1, 1))
    for joint, way in zip(pair("shoulder"), (1.0, -1.0), strict=True):
        turns[:, joint] = Rotation.from_euler("z", 90.0 * way, degrees=True).as_matrix()
    turns[:, 0] = (turned(axis, degrees) * UPRIGHT).as_matrix()
    loose = ground_foreign_motion(ForeignMotion(FPS, turns, np.zeros((len(turns), 3))), FPS)
    lowest = pose_sequence(loose).points[..., 2].min(1) - loose.joints[:, 0, 2]
    pelvis = np.outer(-lowest, [0.0, 0.0, 1.0])
    found = ground_foreign_motion(ForeignMotion(FPS, turns, pelvis), FPS)
    feet = foot_points(pose_sequence(found), found.rest_joints)
    assert found.keypoints_w[..., 2].min() > -0.1
    assert feet[found.contact == PLANTED][:, 2].max(initial=0.0) < 0.5
    assert (found.contact[np.cos(np.radians(degrees)) < -0.5] == AIR).all()


def test_whoever_turns_over_in_the_air_is_not_carried_by_his_hands() -> None:
    """A hand under both feet, but half a metre over the floor on which they stood."""
    points, feet = np.zeros((60, 29, 3)), np.zeros((60, 4, 3))
    points[..., 2] = 1.0
    points[:, keypoint("left_middle"), 2] = 0.5
    feet[25:35, :, 2] = 1.2
    still = np.zeros(60, bool)
    assert not floor.off_feet(points, feet, still, FPS).any()
    points[25:35, keypoint("left_middle"), 2] = 0.05
    assert np.flatnonzero(floor.off_feet(points, feet, still, FPS)).tolist() == [*range(25, 35)]


def test_a_foot_a_little_over_a_hand_still_carries() -> None:
    points, feet = np.ones((60, 29, 3)), np.zeros((60, 4, 3))
    points[:, keypoint("left_middle"), 2] = 0.0
    feet[20:40, :, 2] = 0.1
    assert not floor.off_feet(points, feet, np.zeros(60, bool), FPS).any()


def test_radii_are_of_parts_that_are_no_feet() -> None:
    names = [*pair("ankle"), *pair("foot"), *pair("big_toe"), keypoint("pelvis")]
    assert sorted({*range(len(REST_JOINTS))} - set(names)) == sorted(floor.RADII)
