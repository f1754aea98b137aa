"""Laws of `mocap --hypotheses`: named files, seeded, refused where there is nothing to sample."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.api.hypotheses import hypothesis_files, sample_hypotheses
from robojackson.errors import BadConfiguration
from robojackson.mocap.landmarks.blazepose import landmark
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.pipeline.pipeline_config import PipelineConfig


@pytest.fixture(scope="module")
def hidden_arm() -> LandmarkTrack:
    from pathlib import Path

    path = Path(__file__).parents[1] / "golden" / "hip_shake_track.npz"
    with np.load(path) as data:
        visibility = data["visibility"].astype(float)
        visibility[20:40, [landmark("left_elbow"), landmark("left_wrist")]] = 0.0
        return LandmarkTrack(
            float(data["fps"]), int(data["width"]), int(data["height"]),
            data["landmarks"].astype(float), data["world_landmarks"].astype(float), visibility,
        )  # fmt: skip


def test_files_are_numbered_from_one() -> None:
    assert hypothesis_files(PipelineConfig(), 2) == ["smpl_1.parquet", "smpl_2.parquet"]


def test_none_are_made_unless_requested() -> None:
    assert hypothesis_files(PipelineConfig(), 0) == []


def test_without_the_temporal_network_there_is_nothing_to_sample() -> None:
    settings = PipelineConfig()
    temporal = replace(settings.mocap.temporal, enabled=False)
    plain = replace(settings, mocap=replace(settings.mocap, temporal=temporal))
    with pytest.raises(BadConfiguration, match="temporal"):
        hypothesis_files(plain, 1)


@pytest.mark.medium
def test_hypotheses_of_a_hidden_arm_differ(hidden_arm: LandmarkTrack) -> None:
    first, second = (motion for _, motion in sample_hypotheses(hidden_arm, PipelineConfig(), 2))
    assert np.abs(first.joints - second.joints).max() > 0.01
