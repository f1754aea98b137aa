"""The paper's mode: torques and 348 observations of stock Humanoid-v5, its reward, its curriculum.

The policy sees neither phase nor reference. An episode starts with Humanoid-v5's own reset, which
stands at the origin and faces +x; the motion is turned so that its first step does the same. It
ends by a fall, at the end of the motion, or for a cyclic one after `PaperConfig.seconds`.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from robojackson.errors import UnknownName
from robojackson.geometry.rotations import heading, quat_multiply
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.paper_config import POINT_WEIGHTS
from robojackson.rl.config.train_config import ControlConfig, PaperConfig
from robojackson.rl.modes.mode import EpisodeStart, Score
from robojackson.rl.modes.paper_reward import PaperState, has_fallen, miss, paper_terms, ramp
from robojackson.rl.sim.reference_clip import Clip, ClipStep
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.stock_humanoid import (
    bodies_now,
    mass_centres_now,
    own_reward,
    spin_now,
    stock_observation,
    stock_observation_size,
)
from robojackson.robot.model import Robot

PELVIS = "pelvis"
SPINE = ("lwaist", "torso")
"""Bodies of Humanoid-v5 among the points; other robots may lack them."""


class PaperMode:
    """The paper's task for N robots (`Mode` protocol)."""

    def __init__(
        self, robot: Robot, reference: ReferenceMotion, config: PaperConfig, n: int, seed: int
    ) -> None:
        turned = facing_ahead(reference)
        self._config, self.clip = config, Clip(turned)
        self.points = PaperPoints(robot, turned, config)
        self.sim = Simulation(robot, ControlConfig(law="torque"), n, config.threads)
        model = robot.model
        self._control = model.actuator_ctrlrange[:, 1]
        self._stand = model.qpos0.copy()
        self.repeats = config.repeats
        self.limit = round(config.seconds / self.clip.dt)
        whole = stock_observation_size(model.nq, model.nv, model.nbody)
        self.observation_size = whole if config.observe == "stock" else model.nq - 2 + model.nv
        self.actor_size = self.observation_size
        self._keypoint_pelvis = robot.keypoint_names.index(PELVIS)
        self._own, self._com = np.zeros(n), self.sim.com.copy()
        self._early = 0

    def command(self, following: ClipStep, action: np.ndarray) -> np.ndarray:
        """Return the torques of the actions."""
        self._com = self.sim.com.copy()
        result: np.ndarray = self._control * action
        return result

    def observe(self, following: ClipStep, action: np.ndarray) -> Float[np.ndarray, "N D"]:
        """Return Humanoid-v5's observation."""
        return stock_observation(self.sim)[:, : self.observation_size]

    def of_files(self, weight: np.ndarray) -> np.ndarray:
        """Return the weights as they are."""
        return weight

    def after(self, command: np.ndarray) -> None:
        """Count Humanoid-v5's own reward of each repeat."""
        if self._config.own:
            self._own += own_reward(self.sim, self._com, command)

    def score(self, at: ClipStep, before: np.ndarray, change: np.ndarray, episode: int) -> Score:
        """Return the score of the last action by the paper's reward."""
        config = self._config
        state = self.points.of(self.sim)
        apart = miss(state, *self.points.targets(self.clip, at.step), self.points.weights)
        fell = has_fallen(state, config) | self.sim.broken
        terms = paper_terms(state, apart, fell, ramp(episode, config), config)
        if config.own:
            terms["own"] = config.own * self._own
            self._own = np.zeros_like(self._own)
        errors = {"error_root_m2": apart.root, "error_world_m2": apart.world}
        return Score(terms, fell, self._site_error(at), errors)

    def begin(self, count: int, rng: np.random.Generator) -> EpisodeStart:
        """Return Humanoid-v5's reset states."""
        noise, model = self._config.reset_noise, self.sim.model
        qpos = self._stand + rng.uniform(-noise, noise, (count, model.nq))
        qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=-1, keepdims=True)
        qvel = rng.uniform(-noise, noise, (count, model.nv))
        return EpisodeStart(np.zeros(count, int), qpos, qvel)

    def ended(
        self, start: Int[np.ndarray, " I"], failed: np.ndarray, age: Int[np.ndarray, " I"]
    ) -> dict[str, float]:
        """Return columns for the rows of finished episodes."""
        actions = age / self.repeats
        self._early += int(np.sum(failed & (actions < self._config.early_fall)))
        return {"train_early_falls": float(self._early)}

    def record_finished(self, indices: Int[np.ndarray, " I"], step: Int[np.ndarray, " I"]) -> None:
        """Do nothing: the paper does not learn from them."""

    def forget(self) -> None:
        """Reset the count of early falls."""
        self._early = 0

    def state(self) -> dict[str, Any]:
        """Return the arrays that a resumed run needs."""
        return {"early": np.array(self._early)}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore the mode from `state`."""
        self._early = int(state["early"])

    def _site_error(self, at: ClipStep) -> Float[np.ndarray, " N"]:
        pelvis = self._keypoint_pelvis
        here = self.sim.points - self.sim.points[:, pelvis, None]
        there = at.points - at.points[:, pelvis, None]
        result: np.ndarray = np.linalg.norm(here - there, axis=-1).mean(-1)
        return result


class PaperPoints:
    """The points that the paper's reward compares: keypoints and bodies, bound by name.

    Raises:
        UnknownName: a point that is neither.
    """

    def __init__(self, robot: Robot, reference: ReferenceMotion, config: PaperConfig) -> None:
        sites, bodies = robot.keypoint_names, robot.body_names
        known = (*sites, *bodies)
        # In one order whoever names them: the order of a sum decides its last bits.
        listed = (*POINT_WEIGHTS, *sorted({*config.weights} - {*POINT_WEIGHTS}))
        counted = [k for k in listed if k in config.weights and (k in known or k not in SPINE)]
        weights = {name: config.weights[name] for name in counted}
        for name in weights:
            if name not in known:
                raise UnknownName("point", name, "paper.weights", known)
        self.weights = np.array(list(weights.values()))
        self._sites = _columns(weights, sites)
        self._bodies = _columns([w for w in weights if w not in sites], bodies)
        found = sorted(weights, key=lambda name: name not in sites)
        self._order = _columns(weights, found)
        pelvis = robot.description.sites[PELVIS][0]
        self._pelvis = bodies.index(pelvis)
        names = list(reference.body_names)
        self._reference = self._named(
            reference.keypoints_w, reference.body_pos_w[:, [names.index(name) for name in bodies]]
        )
        self._root = np.asarray(reference.body_pos_w, float)[:, names.index(pelvis)]

    def of(self, sim: Simulation) -> PaperState:
        """Return the state of every robot of a simulation that the reward uses."""
        bodies = bodies_now(sim)[:, 1:]
        _, x, y, _ = sim.qpos[:, 3:7].T
        return PaperState(
            points=self._named(sim.points, bodies),
            root=bodies[:, self._pelvis],
            com=mass_centres_now(sim),
            upright=1 - 2 * (x * x + y * y),
            height=sim.qpos[:, 2],
            hinge_speed=sim.qvel[:, 6:],
            spin=spin_now(sim),
        )

    def targets(
        self, clip: Clip, step: Int[np.ndarray, " N"]
    ) -> tuple[Float[np.ndarray, "N P 3"], Float[np.ndarray, "N 3"]]:
        """Return the reference's points and its pelvis at each robot's step, world."""
        return clip.gather(self._reference, step), clip.gather(self._root[:, None], step)[:, 0]

    def _named(self, sites: np.ndarray, bodies: np.ndarray) -> Float[np.ndarray, "N P 3"]:
        found = np.concatenate([sites[:, self._sites], bodies[:, self._bodies]], 1)
        return np.asarray(found, float)[:, self._order]


def facing_ahead(reference: ReferenceMotion) -> ReferenceMotion:
    """Return the motion moved and turned so that it starts above the origin, facing +x."""
    yaw = float(heading(reference.qpos[0, 3:7]))
    turn = np.array([np.cos(yaw / 2), 0.0, 0.0, -np.sin(yaw / 2)])
    c, s = np.cos(yaw), np.sin(yaw)
    to_ahead = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    home = np.array([*reference.qpos[0, :2], 0.0])
    qpos, qvel = np.array(reference.qpos, float), np.array(reference.qvel, float)
    qpos[:, :3] = (qpos[:, :3] - home) @ to_ahead.T
    qpos[:, 3:7] = quat_multiply(np.broadcast_to(turn, (len(qpos), 4)), qpos[:, 3:7])
    qvel[:, :3] = qvel[:, :3] @ to_ahead.T
    return replace(
        reference,
        qpos=qpos,
        qvel=qvel,
        keypoints_w=(np.asarray(reference.keypoints_w, float) - home) @ to_ahead.T,
        body_pos_w=(np.asarray(reference.body_pos_w, float) - home) @ to_ahead.T,
        cycle_offset=to_ahead @ np.asarray(reference.cycle_offset, float),
    )


def _columns(names: Sequence[str] | dict[str, float], known: Sequence[str]) -> list[int]:
    return [list(known).index(name) for name in names if name in known]
