"""The passport of a policy: its evaluation under physics that differ from those of the training.

Each case changes one condition: friction, masses, gains, delay, sensors, pushes, time step or
integrator.
24 phases without a second reset and the default stand; evaluated as in an evaluation.
"""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import EvaluateConfig, RandomConfig
from robojackson.rl.evaluation.controllers import Evaluated, sees_ahead, trained_driver
from robojackson.rl.evaluation.rollout_records import RolloutScorer
from robojackson.rl.evaluation.rollouts import Conditions, Driver, roll_out
from robojackson.rl.evaluation.starts import starts_of, summarise
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.variation import Variation, varied
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot
from robojackson.robot.physics import substeps_of

ROBUST = RandomConfig(
    friction=0.5, gains=0.2, mass=0.1, com=0.02, delay=0.02, sensor_noise=1.5, pushes=1.5, least=0.0
)
"""Ranges that `train --robust` draws from, graded from the stock robot to the whole of them."""
NOMINAL = "nominal"
LEAST_SHARE = 0.9
"""Share of the nominal strict success that a robust policy keeps in every case."""
ROUNDING = 1e-9
FIGURES = ("strict_success", "success", "skill", "survived_s", "site_error_m")
TIMESTEPS_S = (0.0015, 0.002, 0.004, 0.005)
INTEGRATORS = ("Euler", "implicitfast", "RK4")
DELAYS_S = (0.01, 0.02)
"""About so late, at most one control step."""


def robust_ranges() -> dict[str, Any]:
    """Return these ranges as overrides of a training's configuration."""
    ranges = {name: value for name, value in asdict(ROBUST).items() if name != "integrators"}
    return {f"track.random.{name}": value for name, value in ranges.items()}


@dataclass(frozen=True)
class Case:
    """One row of a passport: a name and its changes."""

    name: str
    variation: Variation = field(default_factory=Variation)
    conditions: Conditions = field(default_factory=Conditions)

    @property
    def is_of_pd(self) -> bool:
        """Return whether the case changes what a PD law and its observation alone have."""
        return self.variation.gains != 1 or self.conditions.random.sensor_noise > 0


def cases(robot: Robot, seed: int, law: str = "pd") -> list[Case]:
    """Return all cases of a robot, the nominal one first.

    Args:
        law: Law of control; `torque` (mode paper) has no gains, and its policies read the state of
            the simulation, so that it has no cases of gains and sensor noise.
    """
    found = [Case(NOMINAL), *_bodies(), *_stepping(robot), *_signals(robot, seed)]
    return [case for case in found if law != "torque" or not case.is_of_pd]


def _bodies() -> Iterator[Case]:
    for factor in (0.5, 1.5):
        yield Case(f"friction x {factor:g}", Variation(friction=factor))
    for factor in (0.9, 1.1):
        yield Case(f"mass x {factor:g}", Variation(mass=factor))
    for axis, name in enumerate(("forward", "left")):
        for shift in (-0.02, 0.02):
            offset = (shift, 0.0, 0.0) if axis == 0 else (0.0, shift, 0.0)
            yield Case(f"centre of mass {1e3 * shift:+.0f} mm {name}", Variation(com=offset))
    for factor in (0.8, 1.2):
        yield Case(f"gains x {factor:g}", Variation(gains=factor))


def _stepping(robot: Robot) -> Iterator[Case]:
    """Yield the time steps that are not the robot's own, and the integrators that move it
    differently from its own and from each other."""
    own, control_dt = float(robot.model.opt.timestep), robot.description.control_dt
    for timestep in TIMESTEPS_S:
        if substeps_of(control_dt, timestep) is not None and abs(timestep - own) > 1e-9:
            yield Case(f"time step {1e3 * timestep:g} ms", Variation(timestep=timestep))
    seen = [_speeds_after_a_step(robot.model)]
    for name in INTEGRATORS:
        case = Case(f"integrator {name}", Variation(integrator=name))  # type: ignore[arg-type]
        speeds = _speeds_after_a_step(varied(robot, case.variation).model)
        if min(np.abs(speeds - other).max() for other in seen) > ROUNDING:
            seen.append(speeds)
            yield case


def _speeds_after_a_step(model: mujoco.MjModel) -> Float[np.ndarray, " nv"]:
    """Return the velocities one physics step after random ones, m/s and rad/s.

    Euler (implicit in the damping of hinges) and implicitfast (in all forces that depend on
    velocities) differ by rounding alone where a model has no other such force.
    """
    rng, data = np.random.default_rng(0), mujoco.MjData(model)
    data.qvel[:] = rng.normal(size=model.nv)
    mujoco.mj_step(model, data)
    result: np.ndarray = data.qvel.copy()
    return result


def _signals(robot: Robot, seed: int) -> Iterator[Case]:
    timestep = float(robot.model.opt.timestep)
    control_dt = robot.description.control_dt
    # as they are simulated: in whole steps of the physics
    delays = {round(min(delay, control_dt) / timestep) for delay in DELAYS_S} - {0}
    for late in (timestep * steps for steps in sorted(delays)):
        yield Case(f"action {1e3 * late:g} ms late", conditions=Conditions(delay_s=late))
    noise, pushes = RandomConfig(sensor_noise=1.0), RandomConfig(pushes=1.0)
    yield Case("sensor noise", conditions=Conditions(noise, seed=seed))
    yield Case("pushes every 1 to 3 s", conditions=Conditions(pushes, seed=seed))


def passport(
    policy: Evaluated,
    reference: ReferenceMotion,
    robot: Robot,
    config: EvaluateConfig,
    progress: Callable[[str, int, int], None] = lambda name, step, total: None,
) -> list[dict[str, Any]]:
    """Evaluate a policy under every case.

    Returns:
        A row a case: `case`, the figures of `FIGURES`, `kept`, the share of the nominal strict
        success (None where that is zero), and `robust`, whether that is at least `LEAST_SHARE`.

    Raises:
        BadPolicy: the policy's observation does not fit this robot.
    """
    config = replace(config, resets=1)
    rows: list[dict[str, Any]] = []
    driver = trained_driver(policy, robot, reference)
    clip = driven_clip(robot, reference, driver.control, sees_ahead(policy))
    every = cases(robot, config.seed, driver.control.law)
    for number, case in enumerate(every):
        progress(case.name, number, len(every))
        figures = _evaluate_case(driver, clip, reference, robot, config, case)
        rows.append({"case": case.name, **figures})
    nominal = rows[0]["strict_success"]
    for row in rows:
        row["kept"] = row["strict_success"] / nominal if nominal else None
        row["robust"] = row["kept"] is not None and row["kept"] >= LEAST_SHARE - ROUNDING
    return rows


def passport_facts(rows: list[dict[str, Any]]) -> dict[str, object]:
    """Return a passport with its verdict, as it stands in an evaluation."""
    robust = all(row["robust"] for row in rows)
    return {"passport": rows, "passport_least_kept": LEAST_SHARE, "robust": robust}


def _evaluate_case(
    driver: Driver,
    clip: Clip,
    reference: ReferenceMotion,
    robot: Robot,
    config: EvaluateConfig,
    case: Case,
) -> dict[str, float]:
    """Return means over the rollouts of a case; the driver's gains are the varied robot's."""
    other, law, factor = varied(robot, case.variation), driver.control, case.variation.gains
    stiffness = None if law.stiffness is None else factor * law.stiffness
    driver = replace(driver, control=replace(law, substeps=other.substeps, stiffness=stiffness))
    starts, labels = starts_of(robot, clip, config)
    horizon = clip.horizon(starts.step, config.seconds)
    done = roll_out(
        other, clip, driver, starts, horizon, config.threads, Fall.of(robot),
        conditions=case.conditions,
    )  # fmt: skip
    scorer = RolloutScorer(robot, reference, config)
    rows = [scorer.row("trained", label, done, i) for i, label in enumerate(labels)]
    figures = summarise(rows)
    return {name: figures[name] for name in FIGURES}
