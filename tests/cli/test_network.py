"""Weights that a user brings, from the command line to the tables."""

from pathlib import Path

import pytest
import torch

from robojackson.clips.trim import trim
from robojackson.mocap.networks.hybrik_net import HybrikResNet
from robojackson.mocap.networks.network_config import NetworkConfig
from robojackson.mocap.networks.niki import TwistSwing
from tasks.runtime.stage import identity
from tests.fixtures.commands import in_process, robojackson

pytestmark = pytest.mark.xdist_group("network")

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with random weights in the official keys, and a clip of six frames."""
    folder = tmp_path_factory.mktemp("weights")
    torch.manual_seed(0)
    network = HybrikResNet()
    network.init_cam[:] = torch.tensor([0.9, 0.0, 0.0])
    torch.nn.init.normal_(network.final_layer.weight, std=3.0)
    torch.save({"model": network.state_dict()}, folder / "r34.pth")
    torch.save(TwistSwing().state_dict(), folder / "niki's.pth")
    trim(ROOT / "clips" / "hip_shake.mp4", 0.0, 0.2, folder / "short.mp4")
    return folder


@pytest.mark.slow
def test_a_video_goes_through_both_networks(weights: Path, tmp_path: Path) -> None:
    brought = ("--hybrik", weights / "r34.pth", "--niki", weights / "niki's.pth")
    result = robojackson("mocap", weights / "short.mp4", "-o", tmp_path, *brought, "--json")
    assert result.code == 0, result.err
    assert result.answer["frames"] == 6
    assert "hybrik_resnet34 (r34.pth), refined by niki_twist_swing" in result.answer["notes"][0]
    assert (tmp_path / "smpl.parquet").is_file()
    assert not result.loaded_prefect


@pytest.mark.medium
def test_weights_that_cannot_be_used_are_refused_in_one_line(weights: Path, tmp_path: Path) -> None:
    wrong = ("--hybrik", weights / "niki's.pth")
    result = in_process("mocap", weights / "short.mp4", "-o", tmp_path / "out", *wrong)
    assert result.code == 1
    assert "BadWeights" in result.err
    assert "expected weights of hybrik" in result.err
    assert not (tmp_path / "out").exists()


def test_the_path_of_weights_is_not_in_the_cache_key() -> None:
    """Their content is, through the task's models."""
    here, there = NetworkConfig(hybrik="a/w.pth"), NetworkConfig(hybrik="b/w.pth", batch=9)
    assert identity(here) == identity(there)
    assert identity(here) != identity(NetworkConfig(hybrik="a/w.pth", flip_test=False))
