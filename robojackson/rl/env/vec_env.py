"""The tracking environment behind Stable-Baselines3's VecEnv and Gymnasium's Env.

Both are thin: physics, rewards and resets are in `TrackingCore`.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import PaperConfig, TrackConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.modes.observation import CLIP
from robojackson.robot.model import Robot


def _spaces(core: TrackingCore) -> tuple[gym.spaces.Box, gym.spaces.Box]:
    bound = np.inf if isinstance(core.config, PaperConfig) else CLIP
    return (
        gym.spaces.Box(-bound, bound, (core.observation_size,), np.float32),
        gym.spaces.Box(-1.0, 1.0, (core.action_size,), np.float32),
    )


class TrackingVecEnv(VecEnv):
    """N robots in one process for Stable-Baselines3.

    Args:
        on_episodes: Called with the summary rows of finished episodes.
    """

    def __init__(
        self,
        core: TrackingCore,
        on_episodes: Callable[[list[dict[str, float]]], None] | None = None,
    ) -> None:
        self.core = core
        self._on_episodes = on_episodes
        self._action = np.zeros((core.n, core.action_size))
        self.render_mode = None
        super().__init__(core.n, *_spaces(core))

    def reset(self) -> np.ndarray:
        """Start new episodes; return their observations."""
        if self._seeds[0] is not None:
            self.core.reseed(self._seeds[0])
        self._reset_seeds()
        return self.core.reset()

    def step_async(self, actions: np.ndarray) -> None:
        """Store the actions of the next `step_wait`."""
        self._action = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Step all robots; return observations, rewards, ends and infos."""
        result = self.core.step(self._action)
        done = result.terminated | result.truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i, episode in zip(np.flatnonzero(done), result.episodes, strict=True):
            infos[i] = {
                "terminal_observation": result.final_observation[i],
                "TimeLimit.truncated": bool(result.truncated[i]),
                "episode": {
                    "r": episode["episode_return"],
                    "l": episode["episode_length"],
                    "t": 0.0,
                },
            }
        if self._on_episodes is not None and result.episodes:
            self._on_episodes(result.episodes)
        return result.observation, result.reward.astype(np.float32), done, infos

    def close(self) -> None:
        """Stop the threads of the simulation."""
        self.core.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute once for each robot."""
        return [getattr(self, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of this environment."""
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any
    ) -> list[Any]:
        """Raise, since the robots have no methods of their own."""
        raise NotImplementedError(f"the robots share one core; call core.{method_name} instead")

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """Return False for each robot."""
        return [False] * len(list(self._get_indices(indices)))


class TrackingEnv(gym.Env[np.ndarray, np.ndarray]):
    """One robot for Gymnasium; `info["reward_terms"]` has the parts of the reward by name."""

    def __init__(
        self, robot: Robot, reference: ReferenceMotion, config: TrackConfig | PaperConfig
    ) -> None:
        self._make = partial(TrackingCore, robot, reference, config, 1)
        self.core, self._seeded = self._make(0), False
        self.observation_space, self.action_space = _spaces(self.core)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start a new episode; return its observation and an empty info. Without a seed the first
        one begins by chance."""
        super().reset(seed=seed)
        if seed is None and not self._seeded:
            seed = int(self.np_random.integers(2**31))
        if seed is not None:
            self.core.close()
            self.core, self._seeded = self._make(seed), True
        return self.core.reset()[0], {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Step the robot; return observation, reward, ends and info."""
        result = self.core.step(action[None])
        info = {"reward_terms": {name: float(term[0]) for name, term in result.terms.items()}}
        return (
            result.final_observation[0],
            float(result.reward[0]),
            bool(result.terminated[0]),
            bool(result.truncated[0]),
            info,
        )

    def close(self) -> None:
        """Stop the threads of the simulation."""
        self.core.close()
