"""Audit of a reward: the share of a perfect dance's reward that bodies earn without dancing.

Kinematic: the statue, the mean pose and the flailing body are carried along with the reference's
root, so that they never fall; the reward cannot distinguish their share from dancing. The replay
without a policy is simulated and does fall.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import (
    ControlConfig,
    PaperConfig,
    TrackConfig,
)
from robojackson.rl.evaluation.reward_meter import RewardMeter
from robojackson.rl.evaluation.rollouts import Driver, Moment, Starts, roll_out
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.modes.paper_mode import facing_ahead
from robojackson.rl.modes.track_mode import control_of
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot

MOST_STEPS = 400
FLAIL_RAD, FLAIL_HZ = 0.35, 2.0
"""Swing of every hinge: 2.8 rad/s on average, as fast as random torques move them."""


@dataclass(frozen=True)
class RewardAudit:
    """Shares of a perfect dance.

    Attributes:
        perfect: Reward of a perfect dance, per control step.
        of: Share that each body earns, by name.
    """

    perfect: float
    of: dict[str, float]

    @property
    def statue(self) -> float:
        """Return the reward of a statue, per control step."""
        return self.perfect * self.of["statue"]


def audit_reward(
    robot: Robot, reference: ReferenceMotion, environment: TrackConfig | PaperConfig
) -> RewardAudit:
    """Return the rewards that an environment pays to bodies that do not dance."""
    if isinstance(environment, TrackConfig):
        motion, law = reference, control_of(environment)
        clip = driven_clip(robot, motion, law)
    else:
        motion, law = facing_ahead(reference), ControlConfig()
        clip = Clip(motion)
    meter = RewardMeter(robot, motion, clip, environment)
    earned = {
        name: float(np.mean(_earned(robot, clip, meter, qpos, qvel)))
        for name, (qpos, qvel) in bodies(motion).items()
    }
    perfect = earned.pop("perfect")
    of = {name: value / perfect for name, value in earned.items()}
    of["zero_residual"] = _replayed(robot, clip, law, meter) / (perfect * _most(clip))
    return RewardAudit(perfect, of)


def audit_both_readings(
    robot: Robot, reference: ReferenceMotion, environment: TrackConfig | PaperConfig
) -> dict[str, RewardAudit]:
    """Return one audit for each reading of the paper, which leaves open whether points are compared
    relative to the root; our own reward has one reading. Empty for a reward without a motion."""
    if isinstance(environment, TrackConfig):
        return {"track": audit_reward(robot, reference, environment)}
    if not environment.imitation:
        return {}
    return {
        "root": audit_reward(robot, reference, replace(environment, relative="root")),
        "world": audit_reward(robot, reference, replace(environment, relative="world")),
    }


def audit_record(audits: dict[str, RewardAudit]) -> dict[str, dict[str, float]]:
    """Return figures for a table or JSON."""
    return {name: {"perfect_step": s.perfect, **s.of} for name, s in audits.items()}


def bodies(
    motion: ReferenceMotion,
) -> dict[str, tuple[Float[np.ndarray, "S nq"], Float[np.ndarray, "S nv"]]]:
    """Return the perfect dancer and the bodies that do not dance, carried along with its root."""
    qpos, qvel = (np.asarray(a, float)[:MOST_STEPS] for a in (motion.qpos, motion.qvel))

    def carried(hinges: np.ndarray, speeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        states, moves = qpos.copy(), qvel.copy()
        states[:, 7:], moves[:, 6:] = hinges, speeds
        return states, moves

    time = np.arange(len(qpos))[:, None] * motion.dt
    turn = 2 * np.pi * FLAIL_HZ
    phase = np.random.default_rng(0).uniform(0, 2 * np.pi, qpos.shape[1] - 7)
    swing, rush = np.sin(turn * time + phase), np.cos(turn * time + phase)
    mean = np.asarray(motion.qpos, float)[:, 7:].mean(0)
    return {
        "perfect": (qpos, qvel),
        "statue": carried(qpos[0, 7:], np.zeros(qvel.shape[1] - 6)),
        "mean_pose": carried(mean, np.zeros(qvel.shape[1] - 6)),
        "flail": carried(mean + FLAIL_RAD * swing, turn * FLAIL_RAD * rush),
    }


def _earned(
    robot: Robot, clip: Clip, meter: RewardMeter, qpos: np.ndarray, qvel: np.ndarray
) -> Float[np.ndarray, " S"]:
    """Return the reward of states that are placed at the reference."""
    n = len(qpos)
    sim = Simulation(robot, ControlConfig(), n)
    sim.place(np.arange(n), qpos, qvel)
    before = np.roll(sim.points, 1, axis=0)
    before[0] = 2 * sim.points[0] - sim.points[1]
    at = clip.at(np.arange(n))
    still = np.zeros(n)
    return meter(Moment(sim, at, before, still, np.zeros(n, bool)))["return_own"]


def _replayed(robot: Robot, clip: Clip, law: ControlConfig, meter: RewardMeter) -> float:
    """Return the reward of the reference under the control law without a policy, up to the fall."""
    driver = Driver(
        law,
        lambda sim, following, start, last: sim.reference_angles(following),
    )
    at = clip.at(np.zeros(1, int))
    starts = Starts(np.zeros(1, int), at.qpos, at.qvel)
    horizon = np.full(1, _most(clip))
    done = roll_out(robot, clip, driver, starts, horizon, 1, Fall.of(robot), meter)
    return float(done.totals["return_own"][0])


def _most(clip: Clip) -> int:
    return round(10.0 / clip.dt) if clip.cyclic else clip.steps - 1
