"""HybrIK's network (Li et al., CVPR 2021): a crop in; keypoints, twists, shape and scale out.

Keypoints are (u, v, d) in -0.5..0.5 of the crop and of 2.2 m of depth: the expectation under ONE
softmax over each joint's 64^3 volume. Two published variants: HRNet-W48 and ResNet-34.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor, nn

from robojackson.body.skeleton import KEYPOINT_NAMES
from robojackson.mocap.landmarks.blazepose import mirror_of
from robojackson.mocap.networks.hrnet import FEATURES, HRNet
from robojackson.mocap.networks.resnet import LAYERS, ResNet34
from robojackson.mocap.networks.weight_files import Weights, install

SIDE = 64
"""Cells of a heatmap along each of its three axes."""
DECONVOLUTION = 256
HIDDEN = 1024


def mirror_order(count: int, first: int = 0) -> list[int]:
    """Return, for keypoints first..first+count-1, the index of each one's counterpart."""
    names = KEYPOINT_NAMES[first : first + count]
    return [names.index(mirror_of(name)) for name in names]


MIRROR_29 = mirror_order(29)
MIRROR_23 = mirror_order(23, first=1)


@dataclass(frozen=True)
class NetworkOutput:
    """Output of the network for a batch of crops.

    Attributes:
        uvd: Keypoints, shares of the crop's side and of 2.2 m, zero in the middle.
        peak: Largest probability of each volume.
        sigma: Uncertainty of a keypoint, 0..1; its score is 1 - sigma.
        twist: (cos, sin) of joints 1..23, of any length.
        betas: SMPL's shape coefficients.
        scale: Scale of the weak camera: the crop is 1 / scale metres wide at the person.
    """

    uvd: Float[Tensor, "B 29 3"]
    peak: Float[Tensor, "B 29"]
    sigma: Float[Tensor, "B 29"]
    twist: Float[Tensor, "B 23 2"]
    betas: Float[Tensor, "B 10"]
    scale: Float[Tensor, " B"]


class HybrikNet(nn.Module):
    """Heads and flip test that both variants share."""

    init_shape: Tensor
    init_cam: Tensor

    def __init__(self, features: int, camera: int) -> None:
        super().__init__()
        self.decshape = nn.Linear(features, 10)
        self.decphi = nn.Linear(features, 23 * 2)
        self.deccam = nn.Linear(features, camera)
        self.decsigma: nn.Module = nn.Linear(features, 29)
        self.register_buffer("init_shape", torch.zeros(10))
        self.register_buffer("init_cam", torch.zeros(camera))
        self.knows_doubt = True

    def run_backbone(
        self, crop: Float[Tensor, "B 3 256 256"]
    ) -> tuple[Float[Tensor, "B 29 64 64 64"], Float[Tensor, "B F"]]:
        """Return volumes (depth, height, width) before their softmax, and the heads' input."""
        raise NotImplementedError

    def mean_scale(self, scale: Tensor, mirrored: Tensor) -> Float[Tensor, " B"]:
        """Return the mean of a flip test's scales; distances are averaged, so the mean is
        harmonic."""
        return 2.0 / (1.0 / scale + 1.0 / mirrored)

    def forward(self, crop: Float[Tensor, "B 3 256 256"], flip_test: bool = False) -> NetworkOutput:
        """Return the output for crops, or its mean with the output for their mirror images."""
        volume, features = self.run_backbone(crop)
        chance = probability(volume)
        heads = self._heads(features)
        if flip_test:
            volume, features = self.run_backbone(crop.flip(3))
            chance = (chance + probability(flip_volume(volume))) / 2.0
            heads = self._averaged(heads, self._heads(features))
        sigma, twist, betas, scale = heads
        uvd, peak = expectation(chance)
        return NetworkOutput(uvd, peak, sigma, twist, betas, scale)

    def _heads(self, features: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return sigma, twist, betas and scale."""
        sigma = self.decsigma(features).sigmoid()
        twist = self.decphi(features).reshape(-1, 23, 2)
        scale = self.deccam(features)[:, 0] + self.init_cam[0]
        return sigma, twist, self.decshape(features) + self.init_shape, scale

    def _averaged(
        self, plain: tuple[Tensor, ...], mirrored: tuple[Tensor, ...]
    ) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        sigma = (plain[0] + mirrored[0][:, MIRROR_29]) / 2.0
        twist = (plain[1] + flip_twist(mirrored[1])) / 2.0
        return sigma, twist, (plain[2] + mirrored[2]) / 2.0, self.mean_scale(plain[3], mirrored[3])


class HybrikHRNet(HybrikNet):
    """The HRNet-W48 variant; its feature vector feeds the heads directly."""

    def __init__(self) -> None:
        super().__init__(FEATURES, camera=1)
        self.preact = HRNet()

    def run_backbone(
        self, crop: Float[Tensor, "B 3 256 256"]
    ) -> tuple[Float[Tensor, "B 29 64 64 64"], Float[Tensor, "B 2048"]]:
        """Return volumes and features."""
        maps, features = self.preact(crop)
        return maps.reshape(-1, 29, SIDE, SIDE, SIDE), features


class HybrikResNet(HybrikNet):
    """The ResNet-34 variant; its camera also has a shift, which a known crop does not need."""

    def __init__(self) -> None:
        super().__init__(HIDDEN, camera=3)
        wide = LAYERS[-1][0]
        self.preact = ResNet34()
        self.deconv_layers = nn.Sequential(*_deconvolutions(wide))
        self.final_layer = nn.Conv2d(DECONVOLUTION, 29 * SIDE, 1)
        self.fc1, self.fc2 = nn.Linear(wide, HIDDEN), nn.Linear(HIDDEN, HIDDEN)

    def run_backbone(
        self, crop: Float[Tensor, "B 3 256 256"]
    ) -> tuple[Float[Tensor, "B 29 64 64 64"], Float[Tensor, "B 1024"]]:
        """Return volumes and features."""
        maps = self.preact(crop)
        volume = self.final_layer(self.deconv_layers(maps))
        return volume.reshape(-1, 29, SIDE, SIDE, SIDE), self.fc2(self.fc1(maps.mean((2, 3))))

    def mean_scale(self, scale: Tensor, mirrored: Tensor) -> Float[Tensor, " B"]:
        """Return the arithmetic mean, as this variant's authors do."""
        return (scale + mirrored) / 2.0


def hybrik_network(weights: Weights) -> HybrikNet:
    """Return the network of a file; older ResNet files have no `decsigma`: sigma is then zero.

    Raises:
        BadWeights: keys or shapes do not fit.
    """
    kinds = {"hybrik_hrnet48": HybrikHRNet, "hybrik_resnet34": HybrikResNet}
    with torch.device("meta"):
        network = kinds[weights.kind]()
    old = weights.kind == "hybrik_resnet34" and "decsigma.weight" not in weights.tensors
    if old:
        network.decsigma = _Certain()
    install(network, weights)
    network.knows_doubt = not old
    return network


def probability(volume: Float[Tensor, "B J D H W"]) -> Float[Tensor, "B J D H W"]:
    """Return one softmax over each joint's whole volume."""
    return volume.flatten(2).softmax(2).reshape(volume.shape)


def expectation(
    chance: Float[Tensor, "B J D H W"],
) -> tuple[Float[Tensor, "B J 3"], Float[Tensor, "B J"]]:
    """Return the expected (u, v, d), -0.5 in the first cell, and the largest probability."""
    axes = []
    for dims in ((2, 3), (2, 4), (3, 4)):
        marginal = chance.sum(dims)
        cells = torch.arange(marginal.shape[-1], dtype=marginal.dtype, device=marginal.device)
        axes.append(marginal @ cells / len(cells) - 0.5)
    return torch.stack(axes, -1), chance.flatten(2).amax(2)


def flip_volume(volume: Float[Tensor, "B 29 D H W"]) -> Float[Tensor, "B 29 D H W"]:
    """Return the volume of a mirrored crop in the original orientation: columns reversed, sides
    swapped, shifted by one column.

    Without the shift the middle of the crop (cell 32 of 64) would be in cell 31.
    """
    flipped = volume.flip(4)[:, MIRROR_29]
    return torch.cat([flipped[..., :1], flipped[..., :-1]], 4)


def flip_twist(twist: Float[Tensor, "B 23 2"]) -> Float[Tensor, "B 23 2"]:
    """Return the twists of a mirrored person: sides swapped, sign reversed."""
    return twist[:, MIRROR_23] * twist.new_tensor([1.0, -1.0])


class _Certain(nn.Module):
    """Replacement of a missing head: sigma is zero for every keypoint."""

    def forward(self, features: Tensor) -> Tensor:
        return features.new_full((len(features), 29), -torch.inf)


def _deconvolutions(inputs: int) -> list[nn.Module]:
    parts: list[nn.Module] = []
    for _ in range(3):
        parts.append(nn.ConvTranspose2d(inputs, DECONVOLUTION, 4, 2, 1, bias=False))
        parts += [nn.BatchNorm2d(DECONVOLUTION), nn.ReLU()]
        inputs = DECONVOLUTION
    return parts
