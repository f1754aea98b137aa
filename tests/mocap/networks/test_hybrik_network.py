"""HybrIK's network: the official keys, the integral over volumes, and the flip test."""

from collections.abc import Mapping
from pathlib import Path

import pytest
import torch
from torch import Tensor

from robojackson.body.skeleton import keypoint
from robojackson.errors import BadWeights
from robojackson.mocap.networks import hybrik_net
from robojackson.mocap.networks.hybrik_net import (
    MIRROR_29,
    HybrikHRNet,
    HybrikNet,
    HybrikResNet,
    NetworkOutput,
    expectation,
    flip_twist,
    flip_volume,
    hybrik_network,
    probability,
)
from robojackson.mocap.networks.weight_files import Weights

SMPL_KEYS = 9
"""Tables of SMPL in an official file, beside the network's own keys."""


def volume_of(uvd: Tensor, spread: float = 1.0) -> Tensor:
    """Return volumes whose softmax is a Gaussian of that many cells around (B, J, 3) points."""
    cells = torch.arange(64.0)
    u, v, d = ((uvd[..., axis, None] + 0.5) * 64.0 for axis in range(3))
    exponents = [-(((cells - place) / spread) ** 2) / 2.0 for place in (d, v, u)]
    depth, height, width = exponents
    return depth[..., None, None] + height[..., None, :, None] + width[..., None, None, :]


def points(count: int, seed: int = 0) -> Tensor:
    return torch.rand(count, 29, 3, generator=torch.Generator().manual_seed(seed)) * 0.8 - 0.4


class Painted(HybrikNet):
    """Sees in a crop what one pixel's number says: its own points, or their mirror image."""

    def __init__(self, uvd: Tensor) -> None:
        torch.manual_seed(0)
        super().__init__(features=8, camera=1)
        self.uvd = uvd
        self.init_cam[:] = 0.9

    def run_backbone(self, crop: Tensor) -> tuple[Tensor, Tensor]:
        mirrored = crop[0, 0, 0, 0] < crop[0, 0, 0, -1]
        uvd = self.uvd
        if mirrored:
            uvd = uvd[:, MIRROR_29] * torch.tensor([-1.0, 1.0, 1.0])
        side = torch.where(mirrored, -1.0, 1.0)
        return volume_of(uvd), side * torch.linspace(-0.1, 0.1, 8)[None]


@pytest.fixture(scope="module")
def resnet_state() -> Mapping[str, Tensor]:
    torch.manual_seed(0)
    return HybrikResNet().state_dict()


@pytest.fixture
def seen_pair() -> tuple[NetworkOutput, NetworkOutput]:
    """Return a crop and its mirror image, each with the flip test."""
    network = Painted(points(1))
    crop = torch.zeros(1, 3, 256, 256)
    crop[..., 0] = 1.0
    with torch.inference_mode():
        return network(crop, flip_test=True), network(crop.flip(3), flip_test=True)


def test_hrnet_has_the_published_keys_and_parameters() -> None:
    with torch.device("meta"):
        network = HybrikHRNet()
    parameters = sum(p.numel() for p in network.parameters())
    assert len(network.state_dict()) + SMPL_KEYS == 1975
    assert parameters == pytest.approx(75.7e6, rel=1e-3)


@pytest.mark.parametrize(
    "key",
    [
        "preact.layer1.0.downsample.1.running_var",
        "preact.transition1.1.0.0.weight",
        "preact.transition3.3.0.1.bias",
        "preact.stage2.0.branches.1.3.bn2.weight",
        "preact.stage3.3.fuse_layers.2.0.0.0.weight",
        "preact.stage4.2.fuse_layers.0.3.1.num_batches_tracked",
        "preact.incre_modules.3.0.conv3.weight",
        "preact.downsamp_modules.2.0.bias",
        "preact.final_feat_layer.0.weight",
        "preact.final_layer.bias",
        "decsigma.weight",
        "init_shape",
    ],
)
def test_hrnet_has_the_official_key(key: str) -> None:
    with torch.device("meta"):
        assert key in HybrikHRNet().state_dict()


@pytest.mark.parametrize(
    ("key", "shape"),
    [
        ("preact.conv1.weight", (64, 3, 7, 7)),
        ("preact.layer4.0.downsample.0.weight", (512, 256, 1, 1)),
        ("deconv_layers.0.weight", (512, 256, 4, 4)),
        ("deconv_layers.7.running_mean", (256,)),
        ("final_layer.weight", (29 * 64, 256, 1, 1)),
        ("fc1.weight", (1024, 512)),
        ("deccam.weight", (3, 1024)),
    ],
)
def test_resnet_has_the_official_key(
    resnet_state: Mapping[str, Tensor], key: str, shape: tuple[int, ...]
) -> None:
    assert tuple(resnet_state[key].shape) == shape


@pytest.mark.medium
def test_hrnet_loads_strictly_and_looks_at_a_crop() -> None:
    torch.manual_seed(0)
    with torch.device("meta"):
        empty = HybrikHRNet().state_dict()
    state = {key: _filled(key, value) for key, value in empty.items()}
    network = hybrik_network(Weights(Path("w48.pth"), "hybrik_hrnet48", state, {}))
    with torch.inference_mode():
        volume, features = network.run_backbone(torch.zeros(1, 3, 256, 256))
    assert volume.shape == (1, 29, 64, 64, 64)
    assert features.shape == (1, 2048)
    assert volume.isfinite().all()


def test_weights_without_a_key_are_not_loaded(resnet_state: Mapping[str, Tensor]) -> None:
    short = {k: v for k, v in resnet_state.items() if k != "preact.layer2.1.bn1.bias"}
    with pytest.raises(BadWeights, match=r"1 missing \(preact\.layer2\.1\.bn1\.bias\)"):
        hybrik_network(Weights(Path("r34.pth"), "hybrik_resnet34", short, {}))


def test_an_older_resnet_without_scores_trusts_every_keypoint(
    resnet_state: Mapping[str, Tensor],
) -> None:
    older = {k: v for k, v in resnet_state.items() if not k.startswith("decsigma")}
    network = hybrik_network(Weights(Path("r34.pth"), "hybrik_resnet34", older, {}))
    with torch.inference_mode():
        seen = network(torch.zeros(1, 3, 256, 256))
    assert not network.knows_doubt
    assert (seen.sigma == 0.0).all()


def test_the_expectation_finds_the_points_of_gaussian_volumes() -> None:
    truth = points(2)
    found, _ = expectation(probability(volume_of(truth)))
    assert (found - truth).abs().max() < 1e-5


def test_an_even_volume_has_its_mean_half_a_cell_before_the_middle() -> None:
    found, peak = expectation(probability(torch.zeros(1, 1, 64, 64, 64)))
    assert torch.allclose(found, torch.tensor(31.5 / 64 - 0.5))
    assert peak.item() == pytest.approx(64.0**-3)


def test_one_softmax_covers_the_whole_volume() -> None:
    chance = probability(volume_of(points(1)))
    assert torch.allclose(chance.sum((2, 3, 4)), torch.ones(1, 29))


def test_a_flipped_volume_shows_the_mirrored_person() -> None:
    truth = points(1)
    found, _ = expectation(probability(flip_volume(volume_of(truth))))
    expected = truth[:, MIRROR_29] * torch.tensor([-1.0, 1.0, 1.0])
    assert (found - expected).abs().max() < 1e-5


def test_mirrored_twists_change_side_and_sign() -> None:
    twist = torch.zeros(1, 23, 2)
    left, right = keypoint("left_knee") - 1, keypoint("right_knee") - 1
    twist[0, left] = torch.tensor([0.6, 0.8])
    assert torch.allclose(flip_twist(twist)[0, right], torch.tensor([0.6, -0.8]))


def test_the_flip_test_of_an_exact_network_returns_its_points() -> None:
    truth = points(1)
    crop = torch.zeros(1, 3, 256, 256)
    crop[..., 0] = 1.0
    with torch.inference_mode():
        seen = Painted(truth)(crop, flip_test=True)
    assert (seen.uvd - truth).abs().max() < 1e-5


def test_the_flip_test_sees_a_mirrored_crop_mirrored(
    seen_pair: tuple[NetworkOutput, NetworkOutput],
) -> None:
    plain, mirrored = seen_pair
    opposite = torch.tensor([-1.0, 1.0, 1.0])
    assert (mirrored.uvd - plain.uvd[:, MIRROR_29] * opposite).abs().max() < 1e-5
    assert torch.allclose(mirrored.sigma, plain.sigma[:, MIRROR_29])
    assert torch.allclose(mirrored.twist, flip_twist(plain.twist))
    assert torch.allclose(mirrored.scale, plain.scale)
    assert torch.allclose(mirrored.betas, plain.betas)


def test_the_scale_of_a_flip_test_is_the_harmonic_mean(
    seen_pair: tuple[NetworkOutput, NetworkOutput],
) -> None:
    network = Painted(points(1))
    features = torch.linspace(-0.1, 0.1, 8)[None]
    scales = [network.deccam(sign * features)[0, 0] + 0.9 for sign in (1.0, -1.0)]
    expected = 2.0 * scales[0] * scales[1] / (scales[0] + scales[1])
    assert torch.allclose(seen_pair[0].scale, expected)


def test_every_pair_of_sides_is_swapped_once() -> None:
    swapped = [index for index, other in enumerate(MIRROR_29) if index != other]
    assert len(swapped) == 2 * 11
    assert [MIRROR_29[other] for other in MIRROR_29] == list(range(29))
    assert hybrik_net.MIRROR_23[keypoint("left_hip") - 1] == keypoint("right_hip") - 1


def _filled(key: str, value: Tensor) -> Tensor:
    """Return random weights of a size that keeps the signal's."""
    if value.ndim > 1:
        return torch.randn(value.shape) / value[0].numel() ** 0.5
    return torch.ones(value.shape, dtype=value.dtype) * (0.0 if "mean" in key else 1.0)
