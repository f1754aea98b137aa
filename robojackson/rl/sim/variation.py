"""Robots with other physics: random for each copy of a training, or given.

Metres, seconds; factors are of the stock robot's values.
"""

import copy
from dataclasses import dataclass, replace
from typing import Literal

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.errors import BadConfiguration
from robojackson.rl.config.track_config import RandomConfig
from robojackson.robot.model import Robot
from robojackson.robot.physics import integrator_of, substeps_of


@dataclass(frozen=True)
class Variation:
    """Physics that differ from the stock robot's.

    Attributes:
        friction: Factor on the friction of all geoms and pairs.
        mass: Factor on mass and inertia of all bodies.
        com: Shift of the root body's centre of mass, m.
        gains: Factor on both gains of the PD law.
        timestep: Seconds a physics step; the robot's when None.
        integrator: Integrator; the robot's when None.
    """

    friction: float = 1.0
    mass: float = 1.0
    com: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gains: float = 1.0
    timestep: float | None = None
    integrator: Literal["RK4", "Euler", "implicit", "implicitfast"] | None = None


def varied(robot: Robot, variation: Variation) -> Robot:
    """Return the robot with other physics.

    Raises:
        BadConfiguration: the physics step does not divide the control step.
    """
    model = copy.copy(robot.model)
    _vary(model, robot, variation)
    substeps = substeps_of(robot.description.control_dt, float(model.opt.timestep))
    if substeps is None:
        raise BadConfiguration(f"{variation.timestep} s does not divide the control step")
    own = robot.actuation
    factor = variation.gains
    actuation = replace(own, stiffness=factor * own.stiffness, damping=factor * own.damping)
    return replace(robot, model=model, actuation=actuation, substeps=substeps)


def varied_models(
    robot: Robot, random: RandomConfig, n: int, rng: np.random.Generator
) -> list[mujoco.MjModel]:
    """Return a model for each of n copies, drawn from the ranges of a training.

    Where nothing of a model varies all have the robot's own: a copy with meshes takes 68 MB.
    """
    share = random.shares(n)
    friction, mass = (
        1 + share * width * rng.uniform(-1, 1, n) for width in (random.friction, random.mass)
    )
    com: Float[np.ndarray, "N 3"] = share[:, None] * random.com * rng.uniform(-1, 1, (n, 3))
    if not (random.friction or random.mass or random.com or random.integrators):
        return [robot.model] * n
    models = []
    for i in range(n):
        kinds = random.integrators
        shift = (float(com[i, 0]), float(com[i, 1]), float(com[i, 2]))
        chosen = Variation(
            friction=float(friction[i]),
            mass=float(mass[i]),
            com=shift,
            integrator=kinds[i % len(kinds)] if kinds else None,
        )
        models.append(copy.copy(robot.model))
        _vary(models[-1], robot, chosen)
    return models


def _vary(model: mujoco.MjModel, robot: Robot, variation: Variation) -> None:
    """Change a model in place."""
    model.geom_friction[:] *= variation.friction
    model.pair_friction[:] *= variation.friction
    if variation.timestep is not None:
        model.opt.timestep = variation.timestep
    if variation.integrator is not None:
        model.opt.integrator = integrator_of(variation.integrator)
    if variation.mass == 1.0 and not any(variation.com):
        return
    model.body_mass[:] *= variation.mass
    model.body_inertia[:] *= variation.mass
    model.body_ipos[model.body(robot.description.root_body).id] += variation.com
    data = mujoco.MjData(model)
    mujoco.mj_setConst(model, data)  # constants derived from masses
