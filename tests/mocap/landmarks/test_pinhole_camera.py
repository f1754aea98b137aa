"""Laws of the pinhole placement: projected points come back."""

import numpy as np
import pytest

from robojackson.mocap.landmarks.blazepose import BODY, repair
from robojackson.mocap.landmarks.pinhole_camera import (
    Pinhole,
    fit_root,
    guess_focal,
    place,
    turn_to_ray,
)
from robojackson.motion.landmark_track import LandmarkTrack

CAMERA = Pinhole(600.0, 640, 480)


def test_projected_points_are_placed_where_they_were() -> None:
    rng = np.random.default_rng(0)
    local = rng.normal(scale=0.4, size=(30, 12, 3))
    root = rng.uniform([-1, -1, 3], [1, 1, 6], size=(30, 3))
    rays = CAMERA.rays(CAMERA.project(local + root[:, None]))
    assert np.allclose(fit_root(local, rays), root, atol=1e-9)


def test_rays_undo_projection() -> None:
    points = np.random.default_rng(1).uniform([-1, -1, 2], [1, 1, 5], size=(20, 3))
    assert np.allclose(CAMERA.rays(CAMERA.project(points)), points[:, :2] / points[:, 2:])


def test_centre_of_the_image_is_on_the_axis() -> None:
    assert np.allclose(CAMERA.project(np.array([0.0, 0.0, 4.0])), [320, 240])


def test_a_person_on_the_axis_is_not_turned() -> None:
    local = np.random.default_rng(2).normal(size=(4, 33, 3))
    assert np.allclose(turn_to_ray(local, np.zeros((4, 2))), local)


def test_turning_to_the_ray_is_an_isometry_along_the_ray() -> None:
    ray = np.array([[0.3, -0.2]])
    forward = np.array([[[0.0, 0.0, 2.0]]])
    turned = turn_to_ray(forward, ray)[0, 0]
    assert np.linalg.norm(turned) == pytest.approx(2.0)
    assert np.allclose(turned[:2] / turned[2], ray[0])


def test_placed_landmarks_project_onto_what_was_seen(hip_shake: LandmarkTrack) -> None:
    landmarks = repair(hip_shake)
    camera = Pinhole(guess_focal(640, 480), 640, 480)
    placed = place(landmarks, camera, hip_shake.fps, 1.5)
    assert np.allclose(camera.project(placed), landmarks.image, atol=1e-6)


def test_a_dancer_stands_metres_before_the_camera(hip_shake: LandmarkTrack) -> None:
    camera = Pinhole(guess_focal(640, 480), 640, 480)
    placed = place(repair(hip_shake), camera, hip_shake.fps, 1.5)
    assert 3.0 < placed[:, BODY, 2].mean() < 8.0
