"""Configuration of retargeting: the section `retarget` of a configuration."""

from typing import Annotated, Literal

from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.retarget.solver.clip_problem import Weights
from robojackson.retarget.solver.levenberg_marquardt import SolverConfig
from robojackson.retarget.solver.sway import SwayConfig
from robojackson.retarget.targets.cycle import CycleConfig
from robojackson.retarget.targets.tails import TailConfig


@config_dataclass
class RepairConfig:
    """Limits of repairing and slowing a motion so that the robot can do it.

    Attributes:
        target_share: Share of feasible steps from which nothing more is done; 0 repairs nothing.
        weights: Weights of the dynamics term, tried in turn.
        iterations: Most Newton steps with each of them.
        tolerance: Relative decrease of the cost at which they stop.
        max_added_error_mm: Largest keypoint error that repair may add, millimetres.
        slow_rounds: How often a motion with `tempo: auto` may be slowed down and solved again.
        slowest: Smallest tempo that `auto` may choose, ratio to the clip's.
    """

    target_share: float = Field(default=0.95, ge=0, le=1)
    weights: tuple[float, ...] = (0.01, 0.03, 0.1, 0.3)
    iterations: int = Field(default=12, ge=1)
    tolerance: float = Field(default=1e-4, gt=0)
    max_added_error_mm: float = Field(default=25.0, ge=0)
    slow_rounds: int = Field(default=2, ge=0)
    slowest: float = Field(default=0.5, ge=0.25, le=1)


@config_dataclass
class RetargetConfig:
    """Configuration of retargeting.

    Attributes:
        method: optimise (ours), paper (Table I literally) or framefix (its signs corrected).
        cyclic: Whether to close the clip to a cycle; auto decides by the seam.
        tempo: Speed of the motion, ratio to the clip's, below 1 slower; auto slows it down where
            that lets the robot do it.
        slower_tempos: Tempos, ratio to the clip's, that `tempo: auto` tries one after the other
            where the gate refuses a motion that is nearly feasible.
        seed: Seed of the random starts of the per-frame solver.
        starts: Poses from which every frame is solved.
        lean_deg: Largest lean that puts a body that stays on both feet over them, degrees.
        stands_share: Share of steps on both feet from which a clip stays on both feet.
        depth_bar_m: Deepest penetration that is left as it is, metres.
        slip_bar_m_s: Largest mean slip of planted soles that is left as it is, m/s.
        jump_bar_m_s2: Largest acceleration of a keypoint that is taken for a movement, m/s2, where
            the clip's own are not half as large; beyond it limbs have passed through each other,
            and another start is tried.
        cut_glides: Whether a beginning or an end in which the person glides over the floor is left
            out: a cut, a fade or a person who leaves the picture looks like that.
        tails: Stands before and after a motion that does not repeat.
        cycle, weights, sway, solver, repair: Configurations of the stages.
    """

    method: Literal["optimise", "paper", "framefix"] = "optimise"
    cyclic: Literal["auto", "yes", "no"] = "auto"
    tempo: Literal["auto"] | Annotated[float, Field(ge=0.25, le=2.0)] = "auto"
    slower_tempos: tuple[Annotated[float, Field(ge=0.25, lt=1.0)], ...] = (0.93, 0.87, 0.8)
    seed: int = Field(default=0, ge=0)
    starts: int = Field(default=5, ge=1)
    lean_deg: float = Field(default=9.0, ge=0, lt=45)
    stands_share: float = Field(default=0.7, ge=0, le=1)
    depth_bar_m: float = Field(default=0.0045, gt=0)
    slip_bar_m_s: float = Field(default=0.007, gt=0)
    jump_bar_m_s2: float = Field(default=300.0, gt=0)
    cut_glides: bool = True
    tails: TailConfig = Field(default_factory=TailConfig)
    cycle: CycleConfig = Field(default_factory=CycleConfig)
    weights: Weights = Field(default_factory=Weights)
    sway: SwayConfig = Field(default_factory=SwayConfig)
    solver: SolverConfig = Field(default_factory=SolverConfig)
    repair: RepairConfig = Field(default_factory=RepairConfig)

    @property
    def fixed_tempo(self) -> float:
        """The tempo of the whole clip; auto begins at the clip's own."""
        return 1.0 if self.tempo == "auto" else float(self.tempo)
