"""The truths of the bundled clips: whole, upright, human."""

import numpy as np
import pytest

from benchmarks.mocap.truth import HELD_OUT, HIPS, JOINTS, REAL, RENDERED, load_truth, video_path
from robojackson.clips.video import VideoLimits, probe


@pytest.mark.parametrize("clip", [*RENDERED, *HELD_OUT, *REAL])
def test_every_frame_of_the_video_has_a_truth(clip: str) -> None:
    truth = load_truth(clip)
    assert truth.joints.shape == (probe(video_path(clip), VideoLimits()).frames, 12, 3)


@pytest.mark.parametrize("clip", [*RENDERED, *HELD_OUT, *REAL])
def test_the_person_of_the_truth_is_upright_and_human(clip: str) -> None:
    joints = load_truth(clip).joints
    shoulders = joints[:, [JOINTS.index("left_shoulder"), JOINTS.index("right_shoulder")]].mean(1)
    ankles = joints[:, [JOINTS.index("left_ankle"), JOINTS.index("right_ankle")]].mean(1)
    height = (shoulders - ankles)[:, 2]
    assert 0.9 < np.median(height) < 1.6
    width = np.linalg.norm(joints[:, HIPS[0]] - joints[:, HIPS[1]], axis=-1)
    assert 0.1 < width.mean() < 0.35


@pytest.mark.parametrize("clip", [*RENDERED, *HELD_OUT, *REAL])
def test_vertical_of_the_camera_is_a_direction_that_points_up_in_the_image(clip: str) -> None:
    up = load_truth(clip).up_c
    assert np.linalg.norm(up) == pytest.approx(1.0, abs=1e-4)
    assert up[1] < -0.7
