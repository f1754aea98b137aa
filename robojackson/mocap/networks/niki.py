"""NIKI (Li et al., CVPR 2023) in both published forms: joints with uncertainty in, rotations out.

One-stage: [29 joints from the pelvis, 29 sigma, 60 unused] <-> [24 rotations in 6D, 32 of error].
Twist-and-swing: the same to [24 swings, 32], then [24 swings, 23 twists] <-> [24 rotations, 46].
Every frame is a row, so that a clip of any length is one batch. Metres, camera frame.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from robojackson.mocap.networks.real_nvp import RealNvp, ShapedRealNvp
from robojackson.mocap.networks.weight_files import Weights, install

JOINT_INPUTS = 29 * 3 + 29
ROTATIONS = 24 * 6
ERROR = 32
"""Entries of the error embedding: zero for clean joints, normal for hidden ones."""
TWISTS = 23 * 2
IDLE = ROTATIONS + ERROR - JOINT_INPUTS
CAMERA_INPUTS, CAMERA_HIDDEN = 29 * 6 + 3, 1024
TINY = 1e-8


@dataclass(frozen=True)
class Refined:
    """NIKI's result for a clip.

    Attributes:
        rotations: Local rotations of SMPL's 24 joints, camera frame at the root.
        error: The error embedding, all of its entries.
    """

    rotations: Float[np.ndarray, "T 24 3 3"]
    error: Float[np.ndarray, "T Z"]


class OneStage(nn.Module):
    """The one-stage form; its `camnet` is loaded but not used, as in the authors' demo."""

    def __init__(self) -> None:
        super().__init__()
        self.regressor = nn.Module()
        self.regressor.flow = RealNvp(ROTATIONS + ERROR, dropout=False)
        self.regressor.camnet = _CameraNet()

    def inverse(
        self,
        joints: Float[Tensor, "B 176"],
        twist: Float[Tensor, "B 46"],
        betas: Float[Tensor, "B 10"],
    ) -> tuple[Float[Tensor, "B 144"], Float[Tensor, "B 32"]]:
        """Return rotations in 6D, and the error embedding."""
        flow = self.regressor.get_submodule("flow")
        assert isinstance(flow, RealNvp)
        out = flow.inverse(joints)
        return out[:, :ROTATIONS], out[:, ROTATIONS:]

    def forward(
        self, rotations: Float[Tensor, "B 144"], error: Float[Tensor, "B 32"], betas: Tensor
    ) -> tuple[Float[Tensor, "B 176"], Float[Tensor, "B 0"]]:
        """Return joints, sigma and unused entries of these rotations."""
        joints = self.regressor.get_submodule("flow")(torch.cat([rotations, error], 1))
        return joints, rotations[:, :0]


class TwistSwing(nn.Module):
    """The twist-and-swing form."""

    def __init__(self) -> None:
        super().__init__()
        self.regressor = nn.Module()
        self.regressor.flow_j2s = ShapedRealNvp(ROTATIONS + ERROR)
        self.regressor.flow_s2r = RealNvp(ROTATIONS + TWISTS, dropout=True)

    def inverse(
        self,
        joints: Float[Tensor, "B 176"],
        twist: Float[Tensor, "B 46"],
        betas: Float[Tensor, "B 10"],
    ) -> tuple[Float[Tensor, "B 144"], Float[Tensor, "B 78"]]:
        """Return rotations in 6D, and the error embeddings of swing and of twist."""
        first, second = self._flows()
        swing = first.inverse(joints, betas)
        out = second.inverse(torch.cat([swing[:, :ROTATIONS], twist], 1))
        return out[:, :ROTATIONS], torch.cat([swing[:, ROTATIONS:], out[:, ROTATIONS:]], 1)

    def forward(
        self, rotations: Float[Tensor, "B 144"], error: Float[Tensor, "B 78"], betas: Tensor
    ) -> tuple[Float[Tensor, "B 176"], Float[Tensor, "B 46"]]:
        """Return joints, sigma and unused entries, and the twists of these rotations."""
        first, second = self._flows()
        out = second(torch.cat([rotations, error[:, ERROR:]], 1))
        swing = torch.cat([out[:, :ROTATIONS], error[:, :ERROR]], 1)
        return first(swing, betas), out[:, ROTATIONS:]

    def _flows(self) -> tuple[ShapedRealNvp, RealNvp]:
        first = self.regressor.get_submodule("flow_j2s")
        second = self.regressor.get_submodule("flow_s2r")
        assert isinstance(first, ShapedRealNvp)
        assert isinstance(second, RealNvp)
        return first, second


def niki_network(weights: Weights) -> OneStage | TwistSwing:
    """Return the network of a file, in double precision: 32 couplings lose half of single's digits.

    Raises:
        BadWeights: keys or shapes do not fit.
    """
    with torch.device("meta"):
        network = OneStage() if weights.kind == "niki_one_stage" else TwistSwing()
    install(network, weights)
    return network.double()


def refine(
    network: OneStage | TwistSwing,
    joints: Float[np.ndarray, "T 29 3"],
    sigma: Float[np.ndarray, "T 29"],
    twist: Float[np.ndarray, "T 23 2"],
    betas: Float[np.ndarray, "T 10"],
    idle: Float[np.ndarray, "T 60"],
) -> Refined:
    """Return the rotations of every frame of a clip; joints in metres, any origin."""
    local = (joints - joints[:, :1]).reshape(len(joints), -1)
    turns = twist / (np.linalg.norm(twist, axis=-1, keepdims=True) + TINY)
    first = next(network.parameters())
    rows = (np.concatenate([local, sigma, idle], 1), turns.reshape(len(turns), -1), betas)
    with torch.inference_mode():
        out = network.inverse(*(torch.tensor(r).to(first) for r in rows))
    sixes, error = (part.double().cpu().numpy() for part in out)
    return Refined(from_rows(sixes.reshape(-1, 24, 6)), error)


def idle_inputs(
    count: int, noise: float, generator: np.random.Generator
) -> Float[np.ndarray, "T 60"]:
    """Return the values of unused entries: zeros, or repeatable noise."""
    return noise * generator.standard_normal((count, IDLE))


def from_rows(six: Float[np.ndarray, "*T 6"]) -> Float[np.ndarray, "*T 3 3"]:
    """Return the rotation whose first two ROWS are given (Zhou et al. 2019), made orthonormal."""
    first, second = six[..., :3], six[..., 3:]
    first = first / np.linalg.norm(first, axis=-1, keepdims=True)
    second = second - np.sum(first * second, -1, keepdims=True) * first
    second = second / np.linalg.norm(second, axis=-1, keepdims=True)
    return np.stack([first, second, np.cross(first, second)], -2)


class _CameraNet(nn.Module):
    """Joints, pixels and sigma to a camera; it exists only to load its weights."""

    def __init__(self) -> None:
        super().__init__()
        wide = CAMERA_HIDDEN
        sizes = ((CAMERA_INPUTS, wide), (wide, wide), (wide, wide), (wide, 3))
        layers: list[nn.Module] = []
        for inputs, outputs in sizes:
            layers += [nn.Linear(inputs, outputs), nn.Dropout(), nn.ReLU()]
        self.camera_net = nn.Sequential(*layers[:-2])
        self.register_buffer("init_cam", torch.zeros(3))
