"""Starts of episodes: a phase of the clip, a state reached before, or the default stand.

Phases are drawn more often where episodes end early (as in BeyondMimic's adaptive sampling): the
clip is divided into bins, each with a moving average of its failures.
"""

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.geometry.rotations import heading
from robojackson.rl.config.train_config import ResetConfig
from robojackson.rl.sim.reference_clip import STRIDE, Clip
from robojackson.robot.body_states import own_bodies, solid_geoms
from robojackson.robot.model import Robot

BIN_SECONDS, MOST_BINS = 0.25, 250
FORGET, FORGET_OF_MANY = 0.02, 0.1
"""Share by which an episode's end changes the average of its bin; with several motions each bin is
visited less often."""
EVEN = 0.5
SETTLED_STATES = 4096


class StartPhases:
    """Adaptive distribution over the start steps of all motions of a clip."""

    def __init__(self, clip: Clip, failure_share: float) -> None:
        self._clip, self._steps = clip, clip.starts()
        self._last = len(self._steps)
        self._bins = min(max(1, round(self._last * clip.dt / BIN_SECONDS)), MOST_BINS)
        self._forget = FORGET if self._steps[-1] < STRIDE else FORGET_OF_MANY
        self.failures = np.full(self._bins, EVEN)
        self._share = failure_share

    def draw(self, count: int, rng: np.random.Generator) -> Int[np.ndarray, " count"]:
        """Return start steps, a share of them where failures are frequent."""
        uniform = rng.integers(self._last, size=count)
        weight = self.failures + 1e-3
        bins = rng.choice(self._bins, size=count, p=weight / weight.sum())
        inside = (bins + rng.random(count)) * self._last / self._bins
        weak = np.minimum(inside.astype(int), self._last - 1)
        return self._steps[np.where(rng.random(count) < self._share, weak, uniform)]

    def forget(self) -> None:
        """Reset all phases to equal difficulty."""
        self.failures[:] = EVEN

    def record(self, start: Int[np.ndarray, " I"], failed: np.ndarray) -> None:
        """Learn from finished episodes: the start step of each and whether it failed."""
        bins = self._clip.row(start) * self._bins // self._last
        for index, bad in zip(bins, failed, strict=True):
            self.failures[index] += self._forget * (float(bad) - self.failures[index])


class SettledStates:
    """A ring buffer of states that the robot reached by itself, from dances up to the time limit.

    The root's place over the floor is stored relative to its reference, including the drift.
    """

    def __init__(self, nq: int, nv: int) -> None:
        self._qpos = np.zeros((SETTLED_STATES, nq))
        self._qvel = np.zeros((SETTLED_STATES, nv))
        self._step = np.zeros(SETTLED_STATES, int)
        self._count = 0

    def __len__(self) -> int:
        return min(self._count, SETTLED_STATES)

    def add(self, qpos: np.ndarray, qvel: np.ndarray, step: int) -> None:
        """Store one state whose root is relative to the reference at that step of the clip."""
        slot = self._count % SETTLED_STATES
        self._qpos[slot], self._qvel[slot], self._step[slot] = qpos, qvel, step
        self._count += 1

    def forget(self) -> None:
        """Drop all states."""
        self._count = 0

    def state(self) -> dict[str, np.ndarray]:
        """Return the buffer as arrays."""
        kept = len(self)
        named = {"qpos": self._qpos, "qvel": self._qvel, "step": self._step}
        held = {f"settled_{name}": array[:kept].copy() for name, array in named.items()}
        return held | {"settled_count": np.array(self._count)}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Restore the buffer from `state`."""
        kept = len(state["settled_step"])
        self._qpos[:kept], self._qvel[:kept] = state["settled_qpos"], state["settled_qvel"]
        self._step[:kept], self._count = state["settled_step"], int(state["settled_count"])

    def draw(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, int]:
        """Return a random stored state: qpos, qvel and its clip step."""
        slot = int(rng.integers(len(self)))
        return self._qpos[slot].copy(), self._qvel[slot].copy(), int(self._step[slot])


def noisy(
    qpos: Float[np.ndarray, "I nq"],
    qvel: Float[np.ndarray, "I nv"],
    config: ResetConfig,
    rng: np.random.Generator,
) -> tuple[Float[np.ndarray, "I nq"], Float[np.ndarray, "I nv"]]:
    """Return the states with Gaussian noise on hinges and velocities."""
    qpos, qvel = qpos.copy(), qvel.copy()
    qpos[:, 7:] += rng.normal(0, config.joint_noise, qpos[:, 7:].shape)
    qvel[:, 6:] += rng.normal(0, config.joint_speed_noise, qvel[:, 6:].shape)
    qvel[:, :6] += rng.normal(0, config.root_speed_noise, (len(qvel), 6))
    return qpos, qvel


def default_standing_pose(robot: Robot) -> Float[np.ndarray, " nq"]:
    """Return the robot's stand with its lowest solid geom on the floor, facing +x at the origin."""
    model = robot.model
    data = mujoco.MjData(model)
    data.qpos[7:] = robot.stand
    mujoco.mj_forward(model, data)
    solid = own_bodies(model)[model.geom_bodyid] & solid_geoms(model)
    heights = data.geom_xpos[:, 2]
    lowest = min(heights[i] - _reach_down(model, data, int(i)) for i in np.flatnonzero(solid))
    qpos = data.qpos.copy()
    qpos[2] -= lowest
    result: np.ndarray = qpos
    return result


def standing_pose_at(stand: Float[np.ndarray, " nq"], root: Float[np.ndarray, " 7"]) -> np.ndarray:
    """Return the default stand moved to a root pose's place over the floor and its heading."""
    qpos = stand.copy()
    yaw = float(heading(root[3:7]))
    qpos[:2] = root[:2]
    qpos[3:7] = [np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]
    return qpos


def _reach_down(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """Return the extent of a geom below its centre, metres."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    up = data.geom_xmat[geom].reshape(3, 3)[2]
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return float(size[0] + size[1] * abs(up[2]))
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return float(size @ np.abs(up))
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return float(size[0] * np.hypot(up[0], up[1]) + size[1] * abs(up[2]))
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        return float(np.linalg.norm(size * up))
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        return float(-(model.mesh_vert[first : first + count] @ up).min())
    return float(model.geom_rbound[geom])
