"""Evaluation of a walker: Humanoid-v5 as gymnasium makes it, deterministic, whole episodes."""

from dataclasses import dataclass

import numpy as np

from robojackson.rl.config.train_config import PaperConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.modes.standing_motion import make_standing_motion
from robojackson.rl.policy import Policy
from robojackson.robot.model import Robot


@dataclass(frozen=True)
class Walk:
    """Means over episodes of Humanoid-v5.

    Attributes:
        episode_return: Sum of Humanoid-v5's reward.
        episode_length: Control steps, at most 1,000.
        distance_m: Distance of the root ahead, metres.
        episodes: Number of episodes.
    """

    episode_return: float
    episode_length: float
    distance_m: float
    episodes: int


def walk(policy: Policy, robot: Robot, episodes: int = 10, seed: int = 0) -> Walk:
    """Run a policy of 348 observations (or of the first 45 of them) until the robot falls."""
    config = PaperConfig(preset="walker")
    core = TrackingCore(robot, make_standing_motion(robot), config, episodes, seed)
    seen = core.reset()
    total, length, ahead = (np.zeros(episodes) for _ in range(3))
    alive = np.ones(episodes, bool)
    while alive.any():
        result = core.step(policy.act(seen[:, : policy.observation_size]))
        total += alive * result.reward
        length += alive
        over = result.terminated | result.truncated
        ahead = np.where(alive & ~over, core.sim.qpos[:, 0], ahead)
        alive &= ~over
        seen = result.observation
    core.close()
    return Walk(float(total.mean()), float(length.mean()), float(ahead.mean()), episodes)
