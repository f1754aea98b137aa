"""How to retarget: what a user may change in `configs/`, under `retarget:`."""

from typing import Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass as config_dataclass

from robojackson.retarget.cycle import CycleConfig
from robojackson.retarget.problem import Weights
from robojackson.retarget.solver import SolverConfig


@config_dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class RetargetConfig:
    """How to retarget.

    Attributes:
        method: optimise (ours), paper (Table I literally) or framefix (its signs corrected).
        cyclic: Whether to close the clip to a lap; auto decides by the seam.
        tempo: Speed of the motion beside the clip's; below 1 is slower.
        seed: Seed of the random starts of the per-frame solver.
        starts: Poses from which every frame is solved.
        lean_deg: Largest lean that brings a body that stays on both feet over them, degrees.
        stands_share: Share of steps on both feet from which a clip stays on both feet.
        depth_bar_m: Deepest penetration that is left as it is, metres.
        slip_bar_m_s: Largest mean slip of planted soles that is left as it is, m/s.
        cycle, weights, solver: Of the stages.
    """

    method: Literal["optimise", "paper", "framefix"] = "optimise"
    cyclic: Literal["auto", "yes", "no"] = "auto"
    tempo: float = Field(default=1.0, ge=0.25, le=2.0)
    seed: int = 0
    starts: int = Field(default=5, ge=1)
    lean_deg: float = Field(default=9.0, ge=0, lt=45)
    stands_share: float = Field(default=0.7, ge=0, le=1)
    depth_bar_m: float = Field(default=0.0045, gt=0)
    slip_bar_m_s: float = Field(default=0.007, gt=0)
    cycle: CycleConfig = Field(default_factory=CycleConfig)
    weights: Weights = Field(default_factory=Weights)
    solver: SolverConfig = Field(default_factory=SolverConfig)
