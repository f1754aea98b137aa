"""Laws of what the network finds of gravity: its axes, its mirror image, its weights."""

import re
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file
from scipy.spatial.transform import Rotation

from robojackson.errors import BadWeights
from robojackson.mocap.landmarks import pinhole_camera
from robojackson.mocap.landmarks.blazepose import repair
from robojackson.mocap.temporal import features, temporal_lift, temporal_network
from robojackson.mocap.temporal.features import ClipView
from robojackson.mocap.temporal.ground_evidence import GroundEvidence, ground_evidence
from robojackson.mocap.temporal.temporal_lift import WEIGHTS
from robojackson.mocap.temporal.temporal_network import Output
from robojackson.motion.landmark_track import LandmarkTrack

FRAMES = 12


def found_in(axes: np.ndarray, up_c: np.ndarray) -> GroundEvidence:
    """Return the evidence of a clip whose rays have `axes` and whose up is always `up_c`."""
    output = Output(
        correction=np.zeros((FRAMES, 12, 3)),
        spread=np.ones((FRAMES, 12, 2)),
        features=np.zeros((FRAMES, 4)),
        up=1.7 * up_c @ axes,
        tilt=np.full((FRAMES, 2), [0.02, 0.06]),
    )
    blank = np.zeros((FRAMES, 33, 3))
    sight = ClipView(blank[..., :2], blank, blank[..., 0], axes, blank[:, 0], blank[:, 0])
    return ground_evidence(output, sight, np.arange(FRAMES))


def test_answers_along_moving_rays_are_one_direction_of_the_camera() -> None:
    up = Rotation.from_euler("xz", [25, -10], degrees=True).apply([0.0, -1.0, 0.0])
    ray = np.stack([np.linspace(-0.4, 0.4, FRAMES), np.full(FRAMES, 0.1), np.ones(FRAMES)], -1)
    assert np.allclose(found_in(features.axes_along(ray), up).up, up, atol=1e-9)


def test_a_small_turn_costs_its_square_over_that_of_its_spread() -> None:
    """In the image the spread is that of roll, out of it that of pitch."""
    up = np.array([0.0, -1.0, 0.0])
    evidence = found_in(np.tile(np.eye(3), (FRAMES, 1, 1)), up)
    for axis, spread in (("z", evidence.roll_sd), ("x", evidence.pitch_sd)):
        turned = Rotation.from_euler(axis, 0.01).apply(up)
        assert turned @ evidence.information() @ turned == pytest.approx(
            (0.01 / spread) ** 2, rel=1e-3
        )
    assert evidence.pitch_sd == pytest.approx(0.075)


def test_the_mirrored_person_stands_on_the_mirrored_ground(hip_shake: LandmarkTrack) -> None:
    seen = repair(hip_shake)
    focal = pinhole_camera.guess_focal(hip_shake.width, hip_shake.height)
    lens = pinhole_camera.Pinhole(focal, hip_shake.width, hip_shake.height)
    placed = pinhole_camera.place(seen, lens, hip_shake.fps, 1.5)
    sight = features.view_clip(placed, seen.local, seen.visibility)
    weights = temporal_network.load(WEIGHTS)
    plain, other = (temporal_lift.correct(s, weights) for s in (sight, features.mirror(sight)))
    assert np.allclose(other.up * [-1.0, 1.0, 1.0], plain.up, atol=1e-4)
    assert np.abs(plain.up[:, 0]).max() > 1e-4


@pytest.mark.parametrize("name", ["ground.weight", "also.1.ground.weight", "also.1.leave.weight"])
def test_weights_of_which_a_network_lacks_a_head_are_refused(tmp_path: Path, name: str) -> None:
    arrays = load_file(WEIGHTS)
    del arrays[name]
    save_file(arrays, tmp_path / "old.safetensors")
    with pytest.raises(BadWeights, match=f"{re.escape(name)} missing.*train_temporal"):
        temporal_network.load(tmp_path / "old.safetensors")
