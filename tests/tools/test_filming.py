"""Laws of filming motions without pictures: exact images, proportions, up, constants."""

import numpy as np

from robojackson.mocap.landmarks.blazepose import landmark
from robojackson.mocap.temporal import features
from robojackson.mocap.temporal.features import ClipView
from robojackson.motion.smpl_sequence import PLANTED
from tools.temporal.depth_errors import ORDER
from tools.temporal.filming import HIPS, SHOULDERS, film, proportioned, with_constants
from tools.temporal.truths import FRAMES, Bank


def bank() -> Bank:
    """Return one motion of a person who sways."""
    rng = np.random.default_rng(8)
    still = rng.uniform(-0.1, 0.1, (len(features.INPUT_LANDMARKS), 3))
    sway = 0.02 * np.sin(np.arange(FRAMES) / 7.0)[:, None, None] * [1.0, 0.0, 0.0]
    points = (still + sway)[None].astype(np.float32)
    return Bank(points, np.array([FRAMES]), np.full((1, FRAMES, 4), PLANTED))


def test_filmed_windows_are_seen_exactly() -> None:
    """From any camera: the image is that of the truth, bones have one length in a window."""
    rows, sizes = np.zeros(6, int), np.full(6, 4.0)
    filmed = film(bank(), rows, 30, sizes, np.random.default_rng(3))
    hips = filmed.truth[:, :, HIPS].mean(2)
    assert np.abs(hips).max() < 1e-4
    bones = np.linalg.norm(filmed.truth[:, :, 3] - filmed.truth[:, :, 5], axis=-1)
    still = bank().points[0]
    length = 4.0 * np.linalg.norm(still[0, 3] - still[0, 5])
    assert np.ptp(bones, axis=1).max() < 1e-3 * length
    assert np.allclose(bones, length, rtol=0.25)
    assert np.ptp(filmed.truth[:, 0, 3], axis=0).min() > 0.05  # the cameras stand elsewhere


def test_filmed_up_is_the_worlds_z_along_the_rays() -> None:
    """The nose stands straight over a heel: up in every frame and window."""
    made = bank()
    nose, heel = (ORDER.index(landmark(name)) for name in ("nose", "left_heel"))
    made.points[:, :, [nose, *SHOULDERS]] = made.points[:, :, [heel, *SHOULDERS]]
    made.points[:, :, nose, 2] += 1.0
    people = film(made, np.zeros(5, int), 30, np.full(5, 1.7), np.random.default_rng(5))
    exact = proportioned(made.points, np.random.default_rng(1))
    assert not np.allclose(exact, made.points)
    assert np.allclose(np.linalg.norm(people.up, axis=-1), 1.0, atol=1e-5)
    across = people.truth[:, :, nose] - people.truth[:, :, heel]
    height = (across * people.up).sum(-1)
    assert height.min() > 1.0
    assert np.abs(across - height[..., None] * people.up).max() < 0.2
    assert (people.contact == PLANTED).all()


def test_proportions_change_lengths_of_bones_alike_on_both_sides() -> None:
    points = np.repeat(bank().points, 4, axis=0)
    changed = proportioned(points, np.random.default_rng(6))
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
    filmed = film(bank(), np.zeros(2, int), 30, np.ones(2), np.random.default_rng(4))
    blank = np.zeros((30, 33, 3))
    root = np.outer(filmed.distance[1], [0.0, 0.0, 1.0])
    sight = ClipView(blank[..., :2].copy(), blank, blank[..., 0], blank, root, blank[:, 0])
    sight.flat[:, features.INPUT_LANDMARKS] = filmed.flat[1]
    sight.local[:, features.INPUT_LANDMARKS] = filmed.local[1]
    result = with_constants(filmed).constant[1]
    assert np.allclose(result, features.constants(sight), rtol=1e-3)
