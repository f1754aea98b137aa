"""Laws of step 3: what goes in, what comes out, what a mirror and a hidden limb do to it."""

import os
import re
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file
from scipy.spatial.transform import Rotation

from robojackson.errors import BadWeights
from robojackson.mocap.landmarks import pinhole_camera
from robojackson.mocap.landmarks.blazepose import BODY, Landmarks, landmark, repair
from robojackson.mocap.temporal import features, temporal_lift, temporal_network
from robojackson.mocap.temporal.temporal_lift import WEIGHTS, Lifted, TemporalConfig
from robojackson.motion.landmark_track import LandmarkTrack

MOST_BYTES = 10_000_000
BODY_HIPS, SHOULDERS = (
    [list(BODY).index(landmark(f"{side}_{name}")) for side in ("left", "right")]
    for name in ("hip", "shoulder")
)


@pytest.fixture(scope="module")
def seen(hip_shake: LandmarkTrack) -> Landmarks:
    return repair(hip_shake)


@pytest.fixture(scope="module")
def placed(seen: Landmarks, hip_shake: LandmarkTrack) -> np.ndarray:
    focal = pinhole_camera.guess_focal(hip_shake.width, hip_shake.height)
    lens = pinhole_camera.Pinhole(focal, hip_shake.width, hip_shake.height)
    return pinhole_camera.place(seen, lens, hip_shake.fps, 1.5)


def lifted(seen: Landmarks, placed: np.ndarray, **settings: object) -> Lifted:
    return temporal_lift.lift(placed, seen.local, seen.visibility, 30.0, TemporalConfig(**settings))


def masked(seen: Landmarks) -> Landmarks:
    visibility = np.array(seen.visibility)
    columns = [landmark(f"left_{n}") for n in ("elbow", "wrist", "pinky", "index", "thumb")]
    visibility[40:60, columns] = 0.0
    return Landmarks(seen.image, seen.local, visibility, seen.valid)


def test_the_weights_that_ship_are_small() -> None:
    assert WEIGHTS.stat().st_size <= MOST_BYTES


def test_the_weights_that_ship_load() -> None:
    assert temporal_network.load(WEIGHTS)["mean"].shape == (features.COUNT,)


def test_lifting_twice_gives_the_same(seen: Landmarks, placed: np.ndarray) -> None:
    assert np.array_equal(lifted(seen, placed).points, lifted(seen, placed).points)


def test_a_sure_detector_is_left_as_it_is(seen: Landmarks, placed: np.ndarray) -> None:
    image = lifted(seen, placed, detector_m=0.0).points[:, BODY]
    assert np.allclose(image[..., :2] / image[..., 2:], _rays(placed), atol=2e-3)


def test_the_less_sure_the_network_is_the_less_it_is_believed() -> None:
    spread = np.array([0.02, 0.05, 0.1, 0.3])[:, None, None] * np.ones((4, 12, 2))
    share = temporal_lift.believed(spread, TemporalConfig())[:, 0]
    assert (np.diff(share) < 0.0).all()
    assert share[0] > 0.9
    assert share[-1] < 0.3


def test_the_mirrored_person_is_lifted_to_the_mirror_image(
    seen: Landmarks, placed: np.ndarray
) -> None:
    weights = temporal_network.load(WEIGHTS)
    sight = features.view_clip(placed, seen.local, seen.visibility)
    plain = temporal_lift.correct(sight, weights)
    other = temporal_lift.correct(features.mirror(sight), weights)
    back = features.mirror_body(other.correction) * [-1.0, 1.0, 1.0]
    assert np.allclose(back, plain.correction, atol=1e-4)
    assert np.allclose(features.mirror_body(other.spread), plain.spread, rtol=1e-3)


def test_a_known_up_turns_the_lifted_body(seen: Landmarks, placed: np.ndarray) -> None:
    """The same pictures of a camera that looks down by 30 degrees: the body leans more with it."""
    level, down = (
        temporal_lift.lift(
            placed, seen.local, seen.visibility, 30.0, TemporalConfig(),
            Rotation.from_euler("x", angle, degrees=True).apply([0.0, -1.0, 0.0]),
        ).points[:, BODY]
        for angle in (0.0, -30.0)
    )  # fmt: skip
    trunk = [
        (body[:, SHOULDERS].mean(1) - body[:, BODY_HIPS].mean(1)).mean(0) for body in (level, down)
    ]
    pitch = [np.degrees(np.arctan2(each[2], -each[1])) for each in trunk]
    assert abs(pitch[1] - pitch[0]) > 3.0


@pytest.mark.parametrize(("share", "same"), [(1.0, True), (0.3, False)])
def test_an_answer_without_depth_does_not_depend_on_the_detectors(
    seen: Landmarks, placed: np.ndarray, share: float, same: bool
) -> None:
    weights = temporal_network.load(WEIGHTS)
    places = []
    for depth in (1.0, -0.5):
        local = seen.local * [1.0, 1.0, depth]
        sight = features.view_clip(placed, local, seen.visibility)
        change = temporal_lift.blended(sight, weights, share).correction
        places.append(temporal_lift.corrected(sight, change))
    assert np.allclose(*places, atol=1e-4) == same


def test_a_hidden_limb_is_less_certain(seen: Landmarks, placed: np.ndarray) -> None:
    wrist = list(BODY).index(landmark("left_wrist"))
    hidden = lifted(masked(seen), placed).spread[45:55, wrist]
    plain = lifted(seen, placed).spread[45:55, wrist]
    assert (hidden.mean(0) > [1.5, 1.05] * plain.mean(0)).all()


def test_hypotheses_differ_only_where_a_limb_is_hidden(seen: Landmarks, placed: np.ndarray) -> None:
    first, second = (
        lifted(masked(seen), placed, hypothesis=number).points[:, BODY] for number in (1, 2)
    )
    moved = np.linalg.norm(first - second, axis=-1)
    wrist, knee = (list(BODY).index(landmark(f"left_{name}")) for name in ("wrist", "knee"))
    assert moved[45:55, wrist].max() > 0.005
    assert moved[:, knee].max() < 1e-6
    assert moved[:30].max() < 1e-6


def test_a_hypothesis_is_fixed_by_its_number_and_seed(seen: Landmarks, placed: np.ndarray) -> None:
    once, again, other = (
        lifted(masked(seen), placed, hypothesis=1, seed=seed).points for seed in (3, 3, 4)
    )
    assert np.array_equal(once, again)
    assert not np.array_equal(once, other)


@pytest.mark.parametrize("fps", [8.0, 24.0, 30.0, 60.0])
def test_any_frame_rate_gives_a_row_a_frame(
    seen: Landmarks, placed: np.ndarray, fps: float
) -> None:
    out = temporal_lift.lift(placed, seen.local, seen.visibility, fps, TemporalConfig())
    assert out.points.shape == placed.shape
    assert np.isfinite(out.points).all()


@pytest.mark.parametrize("frames", [2, 3])
def test_very_short_clips_are_lifted(seen: Landmarks, placed: np.ndarray, frames: int) -> None:
    args = (placed[:frames], seen.local[:frames], seen.visibility[:frames])
    assert np.isfinite(temporal_lift.lift(*args, 30.0, TemporalConfig()).points).all()


def test_a_file_that_is_no_weights_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "notes.safetensors"
    path.write_text("not weights")
    with pytest.raises(BadWeights, match=r"notes\.safetensors: not a weights file"):
        temporal_network.load(path)


def test_weights_of_another_network_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.safetensors"
    save_file({"layer.weight": np.zeros((3, 3), np.float32)}, path)
    with pytest.raises(BadWeights, match="mean"):
        temporal_network.load(path)


def test_weights_for_other_numbers_are_refused(tmp_path: Path) -> None:
    arrays = load_file(WEIGHTS)
    arrays["mean"] = np.zeros(7, np.float32)
    save_file(arrays, tmp_path / "old.safetensors")
    with pytest.raises(BadWeights, match="reads 7 numbers"):
        temporal_network.load(tmp_path / "old.safetensors")


@pytest.mark.parametrize(
    "name", ["blocks.3.spread.weight", "also.1.leave.bias", "flow.couplings.5.2.weight"]
)
def test_weights_of_which_an_array_is_cut_or_not_finite_are_refused(
    tmp_path: Path, name: str
) -> None:
    whole = load_file(WEIGHTS)
    for said, damaged in (
        ("has the shape", whole[name][1:].copy()),
        ("holds NaN", np.full_like(whole[name], np.nan)),
    ):
        path = tmp_path / f"{said}.safetensors"
        save_file({**whole, name: damaged}, path)
        with pytest.raises(BadWeights, match=f"{re.escape(name)} {said}"):
            temporal_network.load(path)


def test_weights_that_were_trained_again_are_read_again(tmp_path: Path) -> None:
    path, weights = tmp_path / "temporal.safetensors", load_file(WEIGHTS)
    for factor in (1, 2):
        save_file({**weights, "mean": factor * weights["mean"]}, path)
        os.utime(path, ns=(0, factor))
        np.testing.assert_array_equal(temporal_network.load(path)["mean"], factor * weights["mean"])


def _rays(placed: np.ndarray) -> np.ndarray:
    return placed[:, BODY, :2] / placed[:, BODY, 2:]
