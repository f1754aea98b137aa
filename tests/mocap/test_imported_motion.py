"""HybrIK's and NIKI's files: a known motion seen by a camera comes back, on the floor."""

import pickle
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.body.skeleton import keypoint, pair
from robojackson.errors import BadTable
from robojackson.formats import hybrik_output
from robojackson.formats.hybrik_output import METRE
from robojackson.metrics.pose_error import rr_mpjpe
from robojackson.mocap import imported_motion
from robojackson.mocap.recover import MocapConfig
from robojackson.motion.smpl_sequence import AIR
from tests.fixtures.person import person

WIDTH, HEIGHT, FOCAL, BOX = 640, 480, 680.0, 360.0
TO_CAMERA = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
DISTANCE, EYE = 4.0, 1.0
WORLD = person(legs=0.1, speed=0.0)
"""Somebody who stands and waves."""
FRAMES = len(WORLD)


def seen(tilt_deg: float = 0.0) -> np.ndarray:
    """Return keypoints before a camera that stands on +x and looks down by an angle, metres."""
    points = WORLD.keypoints_w @ TO_CAMERA.T + [0.0, EYE, DISTANCE]
    return points @ Rotation.from_euler("x", tilt_deg, degrees=True).as_matrix().T


def res_pk(tilt_deg: float = 0.0, **more: Any) -> dict[str, Any]:
    """Return a file as HybrIK's demo saves it; its boxes breathe, and so does its focal length."""
    points = seen(tilt_deg)
    pixels = points[..., :2] / points[..., 2:] * FOCAL + [WIDTH / 2, HEIGHT / 2]
    side = BOX * (1.0 + 0.1 * np.sin(np.arange(FRAMES)))
    centre = pixels.mean(1)
    box = np.concatenate([centre - side[:, None] / 2, centre + side[:, None] / 2], axis=1)
    uv = (pixels - centre[:, None]) / side[:, None, None]
    relative = (points - points[:, :1]) / METRE
    vectors = np.concatenate([WORLD.global_orient, WORLD.body_pose], 1).reshape(-1, 3)
    matrices = Rotation.from_rotvec(vectors).as_matrix().reshape(FRAMES, 24, 3, 3)
    tilt = Rotation.from_euler("x", tilt_deg, degrees=True).as_matrix()
    matrices[:, 0] = tilt @ TO_CAMERA @ matrices[:, 0]
    content = {
        "pred_uvd": np.concatenate([uv, relative[..., 2:]], -1),
        "pred_xyz_29": relative,
        "pred_scores": np.full((FRAMES, 29), 0.02),
        "pred_betas": np.ones((FRAMES, 10)),
        "pred_thetas": matrices.reshape(FRAMES, 216),
        "pred_phi": np.tile([1.0, 0.0], (FRAMES, 23, 1)),
        "pred_cam_root": points[:, 0],
        "bbox": box,
        "height": np.full(FRAMES, HEIGHT),
        "width": np.full(FRAMES, WIDTH),
        "img_path": [f"clip7/{frame + 5:06d}.png" for frame in range(FRAMES)],
    }
    return content | more


def read(content: dict[str, Any]) -> hybrik_output.HybrikMotion:
    return hybrik_output.read(pickle.dumps(content))


def test_rotation_matrices_pose_the_joints_of_the_file() -> None:
    """`pred_thetas` are matrices; our kinematics gives the file's joints from them."""
    assert imported_motion.kinematics_error_mm(read(res_pk())) == pytest.approx(0.0, abs=1e-6)


def test_axis_angle_in_the_place_of_matrices_is_refused() -> None:
    with pytest.raises(BadTable, match="pred_thetas"):
        read(res_pk(pred_thetas=np.zeros((FRAMES, 72))))


def test_a_file_without_rotations_has_no_kinematics_error() -> None:
    content = res_pk()
    del content["pred_thetas"]
    assert imported_motion.kinematics_error_mm(read(content)) is None


CONFIG = MocapConfig(focal_px=FOCAL)


@pytest.mark.parametrize("tilt_deg", [0.0, 15.0])
@pytest.mark.parametrize("thetas", [True, False])
def test_the_motion_stands_in_our_world(tilt_deg: float, thetas: bool) -> None:
    content = res_pk(tilt_deg)
    if not thetas:
        del content["pred_thetas"]
    sequence = imported_motion.ground_hybrik_motion(read(content), 30.0, CONFIG)
    trunk = sequence.joints[:, keypoint("neck")] - sequence.joints[:, 0]
    expected = WORLD.joints[:, keypoint("neck")] - WORLD.joints[:, 0]
    assert trunk[:, 2].min() > 0.3
    turn = Rotation.align_vectors(trunk, expected)[0]
    assert np.degrees(turn.magnitude()) < 8.0
    left, right = pair("hip")
    across = sequence.joints[:, left] - sequence.joints[:, right]
    assert (across[:, 1] > 0.0).all()
    lowest = sequence.keypoints_w[..., 2].min(1)
    assert np.abs(lowest).max() < 0.06
    assert not (sequence.contact == AIR).all(1).any()


def test_joints_are_those_of_the_file_but_for_the_feet() -> None:
    sequence = imported_motion.ground_hybrik_motion(read(res_pk()), 30.0, CONFIG, cutoff_hz=14.9)
    upper = [keypoint(n) for n in ("left_hip", "right_hip", "neck", "left_elbow", "right_wrist")]
    error = rr_mpjpe(sequence.keypoints_w[:, upper], WORLD.keypoints_w[:, upper], (0, 1))
    assert 1e3 * error < 10.0


def test_the_path_comes_from_one_focal_length_and_not_from_the_boxes() -> None:
    points = imported_motion.before_camera(read(res_pk()), 30.0, CONFIG)
    np.testing.assert_allclose(points[:, 0], seen()[:, 0], atol=0.03)


def test_frames_without_a_person_are_filled_and_reported() -> None:
    kept = np.delete(np.arange(FRAMES), [6, 7, 8])
    content = {
        key: [value[i] for i in kept] if isinstance(value, list) else value[kept]
        for key, value in res_pk().items()
    }
    sequence = imported_motion.ground_hybrik_motion(read(content), 30.0, CONFIG)
    assert len(sequence) == FRAMES
    np.testing.assert_array_equal(np.flatnonzero(~sequence.valid), [6, 7, 8])
    assert (sequence.confidence[6:9] == 0.0).all()
    assert "no person in 3 of" in " ".join(sequence.notes)


@pytest.mark.parametrize("name", ["pred_xyz_29", "pred_uvd", "pred_phi", "bbox", "width"])
def test_a_missing_array_is_named(name: str) -> None:
    content = res_pk()
    del content[name]
    with pytest.raises(BadTable, match=name):
        read(content)


@pytest.mark.parametrize("name", ["pred_xyz_29", "pred_uvd", "bbox", "pred_thetas"])
def test_numbers_that_are_not_finite_are_named(name: str) -> None:
    content = res_pk()
    content[name] = np.array(content[name])
    content[name][3] = np.nan
    with pytest.raises(BadTable, match=f"{name}.*not finite"):
        read(content)


def test_mirrored_matrices_are_no_rotations() -> None:
    content = res_pk()
    content["pred_thetas"] = -content["pred_thetas"]
    with pytest.raises(BadTable, match="not rotations"):
        read(content)


def test_matrices_that_stretch_are_no_rotations() -> None:
    with pytest.raises(BadTable, match="not rotations"):
        read(res_pk(pred_thetas=np.zeros((FRAMES, 216))))


def test_joints_without_extent_are_no_person() -> None:
    motion = read(res_pk(pred_xyz_29=np.zeros((FRAMES, 29, 3))))
    with pytest.raises(BadTable, match="not a person, its legs are 0 m"):
        imported_motion.ground_hybrik_motion(motion, 30.0, CONFIG)


@pytest.mark.parametrize("names", [[["a"], ["b", "c"]], {"a": 1}, "x", 3])
def test_names_of_pictures_that_say_nothing_count_the_rows(names: object) -> None:
    np.testing.assert_array_equal(read(res_pk(img_path=names)).frame, np.arange(FRAMES))


def test_a_box_without_width_is_reported() -> None:
    with pytest.raises(BadTable, match="box"):
        read(res_pk(bbox=np.zeros((FRAMES, 4))))
