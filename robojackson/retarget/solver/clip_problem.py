"""One clip to solve: the weights of the cost, and robot, targets and collision detection bound."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.retarget.feasibility.contact_wrench import Tolerance
from robojackson.retarget.feasibility.interior_point import Point
from robojackson.retarget.feasibility.inverse_dynamics import linkage
from robojackson.retarget.solver.collision import Detector
from robojackson.retarget.targets.keypoint_targets import Targets
from robojackson.robot.model import Robot
from robojackson.robot.resampling import forward_velocities
from robojackson.robot.tree_kinematics import Tree


@config_dataclass
class Weights:
    """Weights of the cost; the keypoints' own are in the robot description.

    Attributes:
        height: Weight of the sole height of a foot in contact, 1/m2.
        penetration: Weight of floor penetration of feet and of anything else, 1/m2.
        self_penetration: Weight of overlap between the robot's own geoms, 1/m2.
        slip: Weight of the velocity of a planted sole, s2/m2.
        balance: Weight of the distance from the zero moment point to the support, 1/m2.
        balance_reach: Distance from which that term loses its grip (Cauchy's loss), metres.
        acceleration: Weight of tangent accelerations, s4/rad2.
        posture: Weight of the distance to the rest pose, 1/rad2.
        speed: Weight of hinge speed over the limit, s2/rad2.
        speed_share: Share of the speed limit from which it costs.
        dynamics: Weight of what neither soles nor motors can give, 1/tolerances2; only the last
            solution.
        dynamics_reach: Slack from which that term loses its grip (Cauchy's loss), tolerances.
        dynamics_margin: Slack from which it costs, tolerances.
        dynamics_barrier: How softly that term keeps off every limit, squared tolerances.
        tolerance: What may be left over in a feasible step.
        clearance: Distance from which geoms repel each other, metres.
    """

    height: float = Field(default=60.0, ge=0)
    penetration: float = Field(default=1000.0, ge=0)
    self_penetration: float = Field(default=60.0, ge=0)
    slip: float = Field(default=4.0, ge=0)
    balance: float = Field(default=0.2, ge=0)
    balance_reach: float = Field(default=0.15, gt=0)
    acceleration: float = Field(default=2e-6, ge=0)
    posture: float = Field(default=1e-4, ge=0)
    speed: float = Field(default=0.5, ge=0)
    speed_share: float = Field(default=0.95, gt=0, le=1)
    clearance: float = Field(default=0.002, ge=0)
    dynamics: float = Field(default=0.0, ge=0)
    dynamics_reach: float = Field(default=5.0, gt=0)
    dynamics_margin: float = Field(default=0.8, ge=0)
    dynamics_barrier: float = Field(default=0.05, gt=0)
    tolerance: Tolerance = Field(default_factory=Tolerance)


@dataclass
class Warm:
    """State that one evaluation of the cost leaves to the next: the solution of the pushes."""

    point: Point | None = None


@dataclass(frozen=True)
class Problem:
    """One clip to solve: robot, targets, weights."""

    robot: Robot
    tree: Tree
    targets: Targets
    weights: Weights
    detector: Detector
    warm: Warm = field(default_factory=Warm)

    @classmethod
    def of(cls, robot: Robot, targets: Targets, weights: Weights) -> "Problem":
        """Bind the parts."""
        detector = Detector(robot, weights.clearance, feet=False)
        return cls(robot, linkage(robot), targets, weights, detector)

    @property
    def ring(self) -> bool:
        """Whether the last frame is followed by the first."""
        return self.targets.cycle_offset is not None

    def velocity(self, qpos: Float[np.ndarray, "N nq"]) -> Float[np.ndarray, "M nv"]:
        """Return the forward differences; a ring has one a frame, an open clip one fewer."""
        return forward_velocities(qpos, self.targets.dt, self.targets.cycle_offset)
