"""Rewards of every step by one yardstick, for any controller and setup.

Setups are trained with their own reward but measured with the same: curiosity off, lambda fixed at
its largest value, Humanoid-v5's own reward left out. `reward_*` are the terms of the policy's mode,
`return_own` their sum, `return_paper` the paper's reward.
"""

from dataclasses import replace

import numpy as np

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import PaperConfig, RewardConfig, TrackConfig
from robojackson.rl.evaluation.rollouts import Moment, Reading
from robojackson.rl.modes.paper_mode import PaperPoints
from robojackson.rl.modes.paper_reward import Miss, miss, paper_terms
from robojackson.rl.modes.rewards import tracked_points
from robojackson.rl.modes.track_mode import evaluate_step
from robojackson.rl.sim.reference_clip import Clip
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import tree


class RewardMeter:
    """Computes the rewards of a moment.

    Args:
        environment: Environment of the policy's own reward.
    """

    def __init__(
        self,
        robot: Robot,
        reference: ReferenceMotion,
        clip: Clip,
        environment: TrackConfig | PaperConfig,
    ) -> None:
        self._clip = clip
        configs = [PaperConfig()]
        if isinstance(environment, PaperConfig):
            configs = [PaperConfig(relative=environment.relative), environment]
        self._papers = [(config, PaperPoints(robot, reference, config)) for config in configs]
        self._track = None if isinstance(environment, PaperConfig) else environment.reward
        turns = self._track is not None and self._track.bodies
        self._which = tracked_points(robot.keypoint_names, tree(robot) if turns else None)

    def __call__(self, moment: Moment) -> Reading:
        """Return terms, errors and returns of every robot at one control step."""
        read = [self._paper_reward(moment, *paper) for paper in self._papers]
        (_, paper), (apart, own) = read[0], read[-1]
        if self._track is not None:
            own = self._tracked(moment, self._track)
        return {
            **{f"reward_{name}": value for name, value in own.items()},
            **_errors(apart),
            "return_own": np.sum(list(own.values()), 0),
            "return_paper": np.sum(list(paper.values()), 0),
        }

    def _paper_reward(
        self, moment: Moment, config: PaperConfig, points: PaperPoints
    ) -> tuple[Miss, Reading]:
        """Return distances and terms of a reward of the paper's kind, lambda at its largest."""
        state = points.of(moment.sim)
        apart = miss(state, *points.targets(self._clip, moment.at.step), points.weights)
        return apart, paper_terms(state, apart, moment.fell, config.lambda_max, config)

    def _tracked(self, moment: Moment, reward: RewardConfig) -> Reading:
        sim = moment.sim
        moved = (sim.points - moment.before) / self._clip.dt
        _, terms = evaluate_step(sim, moved, moment.at, moment.change, self._which, reward)
        return {name: np.where(moment.fell, 0.0, term) for name, term in terms.items()}


def without_curiosity(environment: TrackConfig | PaperConfig) -> TrackConfig | PaperConfig:
    """Return the same environment without the bonus for curiosity."""
    if isinstance(environment, PaperConfig):
        return replace(environment, curiosity="off")
    return replace(environment, reward=replace(environment.reward, curiosity="off"))


def _errors(apart: Miss) -> Reading:
    return {"error_root_m2": apart.root, "error_world_m2": apart.world}
