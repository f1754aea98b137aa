"""Settings of a user's weights and of the networks; every command reads them without PyTorch."""

from dataclasses import field
from typing import Literal

from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.errors import BadConfiguration


@config_dataclass
class NetworkConfig:
    """HybrIK's network, and NIKI after it, instead of BlazePose's metres.

    The paths are not part of a cache key (`compare=False`): the content of the files is.

    Attributes:
        hybrik: Weights of HybrIK, HRNet-W48 or ResNet-34; None runs no network at all.
        niki: Weights of NIKI, one-stage or twist-and-swing; None leaves HybrIK's result.
        flip_test: Whether to process every frame and its mirror image: twice the time, less jitter.
        update_scale: Refine the camera's scale of each frame by HybrIK's least squares.
        noise: Standard deviation of NIKI's unused inputs, unitless; the authors draw 0.001, 0 is
            repeatable.
        seed: Seed of that noise.
        cutoff_hz: Zero-phase low-pass of the networks' output, which is computed frame by frame,
            hertz.
        batch: Number of frames in a batch of the network.
        device: Device of PyTorch; auto uses a GPU if there is one.
    """

    hybrik: str | None = field(default=None, compare=False)
    niki: str | None = field(default=None, compare=False)
    flip_test: bool = True
    update_scale: bool = True
    noise: float = Field(default=0.0, ge=0.0)
    seed: int = 0
    cutoff_hz: float = Field(default=6.0, gt=0.0)
    batch: int = field(default=4, compare=False)
    device: Literal["auto", "cpu", "cuda"] = field(default="auto", compare=False)

    def __post_init__(self) -> None:
        if self.niki and not self.hybrik:
            raise BadConfiguration(
                "network.niki refines the output of HybrIK's network: give network.hybrik, too"
            )
        if self.batch < 1:
            raise BadConfiguration(f"network.batch is {self.batch}: at least 1 frame")

    @property
    def files(self) -> tuple[str, ...]:
        """Return the paths of the weights, HybrIK's first."""
        return tuple(path for path in (self.hybrik, self.niki) if path)
