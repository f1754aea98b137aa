"""The task that runs a user's networks: its result, and what its cache key is made of."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from robojackson.clips.trim import trim
from robojackson.errors import BadWeights
from robojackson.mocap.networks.hybrik_net import HybrikResNet
from robojackson.mocap.networks.network_config import NetworkConfig
from robojackson.mocap.recover import MocapConfig
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence
from storage import artifact_tables
from storage.store import Store
from tasks.recover_motion_by_networks import _models, recover_motion_by_networks

ROOT = Path(__file__).parents[2]
FRAMES = 6


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Store:
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "store"))
    return Store.from_environment()


def track() -> LandmarkTrack:
    with np.load(ROOT / "tests" / "golden" / "hip_shake_track.npz") as data:
        rows = [data[n][:FRAMES].astype(float) for n in ("landmarks", "world_landmarks")]
        size = (int(data["width"]), int(data["height"]))
        return LandmarkTrack(
            float(data["fps"]), *size, *rows, data["visibility"][:FRAMES].astype(float)
        )


@pytest.mark.medium
def test_the_task_keeps_the_motion_of_the_networks(store: Store, tmp_path: Path) -> None:
    torch.manual_seed(0)
    network = HybrikResNet()
    network.init_cam[:] = torch.tensor([0.9, 0.0, 0.0])
    torch.save(network.state_dict(), tmp_path / "r34.pth")
    clip = trim(ROOT / "clips" / "hip_shake.mp4", 0.0, FRAMES / 30.0, tmp_path / "short.mp4")
    video = store.save("clip", "clip.mp4", clip.read_bytes())
    seen = artifact_tables.save(store, "landmarks", "landmarks.parquet", track())
    config = NetworkConfig(hybrik=str(tmp_path / "r34.pth"), flip_test=False)
    made = recover_motion_by_networks.fn(video, seen, config, MocapConfig())
    found = artifact_tables.read(SmplSequence, store, made)
    assert len(found) == FRAMES
    assert "hybrik_resnet34" in found.notes[0]


def test_other_weights_under_the_same_name_are_another_key(tmp_path: Path) -> None:
    path = tmp_path / "w.pth"
    config = NetworkConfig(hybrik=str(path))
    path.write_bytes(b"first")
    before = _models({"network": config})
    path.write_bytes(b"other")
    assert _models({"network": config}) != before


def test_the_same_weights_under_another_name_are_the_same_key(tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("a.pth", "b.pth")]
    for path in paths:
        path.write_bytes(b"same")
    keys = [_models({"network": NetworkConfig(hybrik=str(path))}) for path in paths]
    assert keys[0] == keys[1]


def test_missing_weights_are_reported_before_anything_runs(tmp_path: Path) -> None:
    config = replace(NetworkConfig(), hybrik=str(tmp_path / "gone.pth"))
    with pytest.raises(BadWeights, match="no such file"):
        _models({"network": config})
