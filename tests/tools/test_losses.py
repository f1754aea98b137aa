"""Laws of the losses: what is right costs least, and slow limbs cost."""

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from robojackson.mocap.temporal.features import INPUT_LANDMARKS
from robojackson.motion.smpl_sequence import AIR, PLANTED
from tools.temporal.batches import TWELVE, Batch
from tools.temporal.losses import losses_of
from tools.temporal.net import Found

WINDOWS, FRAMES = 3, 40
UP = Rotation.from_euler("xz", [30, 10], degrees=True).apply([0.0, -1.0, 0.0])


def batch() -> Batch:
    """Return windows of a body that swings, seen exactly."""
    rng = np.random.default_rng(4)
    still = rng.normal(0.0, 0.4, (WINDOWS, 1, len(INPUT_LANDMARKS), 3))
    swing = 0.3 * np.sin(np.arange(FRAMES) / 5.0)[:, None, None] * rng.normal(size=still.shape)
    truth = (still + swing).astype(np.float32)
    distance = np.full((WINDOWS, FRAMES), 4.0, np.float32)
    away = distance[..., None, None]
    parts = {
        "flat": truth[..., :2] * away / (away + truth[..., 2:]),
        "local": truth,
        "visibility": np.ones(truth.shape[:3], np.float32),
        "constant": np.zeros((WINDOWS, 1), np.float32),
        "distance": distance,
        "truth": truth,
        "good": np.ones((WINDOWS, FRAMES), np.float32),
        "up": np.tile(UP.astype(np.float32), (WINDOWS, FRAMES, 1)),
        "contact": np.tile(np.array([PLANTED, AIR, PLANTED, AIR]), (WINDOWS, FRAMES, 1)),
        "shown": np.zeros((WINDOWS, FRAMES, 3), np.float32),
    }
    return Batch(**{name: torch.from_numpy(values) for name, values in parts.items()})


def losses(depth_share: float = 1.0, tilt_deg: float = 0.0, feet: float = 4.0) -> dict[str, float]:
    """Return the losses of an answer whose depth moves by a share of the truth's, whose up is
    tilted and whose contacts are right (positive) or wrong."""
    windows = batch()
    correction = np.zeros((WINDOWS, FRAMES, 12, 3), np.float32)
    depth = windows.truth[:, :, TWELVE, 2].numpy()
    correction[..., 2] = (depth_share - 1.0) * (depth - depth.mean(1, keepdims=True))
    up = Rotation.from_euler("x", tilt_deg, degrees=True).apply(UP)
    right = (windows.contact.numpy() == PLANTED)[..., None] * np.ones(2)
    found = Found(
        torch.from_numpy(correction),
        torch.full((WINDOWS, FRAMES, 12, 2), -3.0),
        torch.from_numpy(feet * (2.0 * right - 1.0)),
        torch.from_numpy(np.tile(2.0 * up, (WINDOWS, FRAMES, 1)).astype(np.float32)),
        torch.full((WINDOWS, FRAMES, 2), -2.0),
    )
    return {name: value.item() for name, value in losses_of(found, windows)[0].items()}


def test_an_exact_answer_costs_nothing() -> None:
    exact = losses()
    assert exact["place"] < 1e-3
    assert exact["velocity"] < 1e-3
    assert exact["speed"] < 1e-3


def test_slow_and_fast_limbs_cost_as_much() -> None:
    slow, fast = losses(0.5)["speed"], losses(2.0)["speed"]
    assert slow > 0.05
    assert fast > 0.05


@pytest.mark.parametrize("degrees", [-8.0, 3.0, 20.0])
def test_tilt_costs_its_sine_over_the_spread(degrees: float) -> None:
    """Laplace: error over e^-2 radians, added to the sum of both logarithms, -4."""
    assert losses(tilt_deg=0.0)["tilt"] == pytest.approx(-4.0, abs=1e-3)
    turned = Rotation.from_euler("x", degrees, degrees=True).apply(UP)
    across = np.cross(UP, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    off = abs(turned @ across) + abs(turned @ np.cross(UP, across))
    assert losses(tilt_deg=degrees)["tilt"] == pytest.approx(-4.0 + off * np.e**2, abs=1e-3)


def test_wrong_contacts_cost_more_than_right_ones() -> None:
    assert losses(feet=4.0)["contact"] < 0.1
    assert losses(feet=-4.0)["contact"] > 3.0
