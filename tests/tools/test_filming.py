"""Laws of filming motions without pictures: exact images, proportions, up, constants."""

import numpy as np
import torch

from robojackson.mocap.landmarks.blazepose import landmark
from robojackson.mocap.temporal import features
from robojackson.mocap.temporal.features import ClipView
from robojackson.motion.smpl_sequence import PLANTED
from tools.temporal.depth_errors import ORDER
from tools.temporal.filming import HIPS, SHOULDERS, film, proportioned, with_constants
from tools.temporal.random_numbers import RandomNumbers
from tools.temporal.truths import FRAMES, Bank


def bank() -> Bank:
    """Return one motion of a person who sways."""
    rng = np.random.default_rng(8)
    still = rng.uniform(-0.1, 0.1, (len(features.INPUT_LANDMARKS), 3))
    sway = 0.02 * np.sin(np.arange(FRAMES) / 7.0)[:, None, None] * [1.0, 0.0, 0.0]
    points = (still + sway)[None].astype(np.float32)
    contact = torch.full((1, FRAMES, 4), PLANTED)
    return Bank(torch.from_numpy(points), torch.tensor([FRAMES]), contact)


def rows(count: int) -> torch.Tensor:
    """Return the index of the one motion, repeated."""
    return torch.zeros(count, dtype=torch.long)


def test_filmed_windows_are_seen_exactly() -> None:
    """From any camera: the image is that of the truth, bones have one length in a window."""
    truth = film(bank(), rows(6), 30, torch.full((6,), 4.0), RandomNumbers([3])).truth.numpy()
    assert np.abs(truth[:, :, HIPS].mean(2)).max() < 1e-4
    bones = np.linalg.norm(truth[:, :, 3] - truth[:, :, 5], axis=-1)
    still = bank().points[0].numpy()
    length = 4.0 * np.linalg.norm(still[0, 3] - still[0, 5])
    assert np.ptp(bones, axis=1).max() < 1e-3 * length
    assert np.allclose(bones, length, rtol=0.25)
    assert np.ptp(truth[:, 0, 3], axis=0).min() > 0.05  # the cameras stand elsewhere


def test_filmed_up_is_the_worlds_z_along_the_rays() -> None:
    """The nose stands straight over a heel: up in every frame and window."""
    made = bank()
    nose, heel = (ORDER.index(landmark(name)) for name in ("nose", "left_heel"))
    made.points[:, :, [nose, *SHOULDERS]] = made.points[:, :, [heel, *SHOULDERS]]
    made.points[:, :, nose, 2] += 1.0
    people = film(made, rows(5), 30, torch.full((5,), 1.7), RandomNumbers([5]))
    exact = proportioned(made.points, RandomNumbers([1]))
    assert not torch.allclose(exact, made.points)
    assert torch.allclose(torch.linalg.norm(people.up, dim=-1), torch.ones(5, 30), atol=1e-5)
    across = people.truth[:, :, nose] - people.truth[:, :, heel]
    height = (across * people.up).sum(-1)
    assert height.min() > 1.0
    assert (across - height[..., None] * people.up).abs().max() < 0.2
    assert (people.contact == PLANTED).all()


def test_proportions_change_lengths_of_bones_alike_on_both_sides() -> None:
    whole = bank().points.repeat(4, 1, 1, 1)
    points, changed = whole.numpy(), proportioned(whole, RandomNumbers([6])).numpy()
    ratios = []
    for side in ("left", "right"):
        ends = [ORDER.index(landmark(f"{side}_{name}")) for name in ("knee", "ankle")]
        before, after = (np.linalg.norm(p[:, :, ends[0]] - p[:, :, ends[1]], axis=-1)
                         for p in (points, changed))  # fmt: skip
        ratios.append(after / before)
    assert np.allclose(*ratios, rtol=1e-3)
    assert np.ptp(ratios[0], axis=1).max() < 1e-3
    assert np.ptp(ratios[0][:, 0]) > 0.01
    middle = changed[:, :, HIPS].mean(2) - points[:, :, HIPS].mean(2)
    assert np.abs(middle).max() < 1e-6


def test_filmed_constants_are_those_of_the_stage() -> None:
    filmed = film(bank(), rows(2), 30, torch.ones(2), RandomNumbers([4]))
    blank = np.zeros((30, 33, 3))
    root = np.outer(filmed.distance[1].numpy(), [0.0, 0.0, 1.0])
    sight = ClipView(blank[..., :2].copy(), blank, blank[..., 0], blank, root, blank[:, 0])
    sight.flat[:, features.INPUT_LANDMARKS] = filmed.flat[1].numpy()
    sight.local[:, features.INPUT_LANDMARKS] = filmed.local[1].numpy()
    result = with_constants(filmed).constant[1].numpy()
    assert np.allclose(result, features.constants(sight), rtol=1e-3)
