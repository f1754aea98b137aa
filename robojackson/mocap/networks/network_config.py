"""Which weights a user brings, and how the networks run; every command reads it without PyTorch."""

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
        flip_test: Look at every frame and at its mirror image: twice the time, less jitter.
        update_scale: Refine the camera's scale of each frame by HybrIK's least squares.
        noise: Standard deviation of NIKI's unused inputs, unitless; the authors draw 0.001, 0 is
            repeatable.
        seed: Seed of that noise.
        cutoff_hz: Zero-phase low-pass of what the networks see frame by frame, hertz.
        batch: Frames that go through the network at once.
        device: auto takes a GPU where PyTorch sees one.
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
                "network.niki refines what HybrIK's network sees: give network.hybrik, too"
            )
        if self.batch < 1:
            raise BadConfiguration(f"network.batch is {self.batch}: at least 1 frame")

    @property
    def files(self) -> tuple[str, ...]:
        """Paths of the weights, HybrIK's first."""
        return tuple(path for path in (self.hybrik, self.niki) if path)
