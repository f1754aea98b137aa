"""Many copies of one stock robot, stepped in threads, with the law of control outside the model.

Stock physics (architecture page): the model as gymnasium ships it. The torque of the PD law is
computed once a substep from the state at its beginning, clipped to the stock limit and written to
`ctrl`; a servo inside the model would be evaluated within the stages of RK4, which is another
robot. The law `torque` does what `Humanoid-v5.step` does, to the bit.

World frame, metres, radians, seconds, newton-metres. MuJoCo releases the interpreter lock in
`mj_step`, so two threads keep two cores busy.
"""

import copy
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.errors import BadPolicy
from robojackson.retarget.robot import Robot
from robojackson.rl.config import ControlConfig, RandomConfig

BAD_STATE = [
    int(kind)
    for kind in (
        mujoco.mjtWarning.mjWARN_BADQPOS,
        mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC,
    )
]
"""Warnings at which MuJoCo resets a state by itself."""


@dataclass(frozen=True)
class Motors:
    """Actuators of the robot: which hinge each one drives and how strongly.

    Attributes:
        hinge: Index of the driven hinge among `qpos[7:]`, one an actuator.
        gear: Torque per unit of control, N m.
        limit: Largest torque, N m (gear x the control range).
    """

    hinge: Int[np.ndarray, " nu"]
    gear: Float[np.ndarray, " nu"]
    limit: Float[np.ndarray, " nu"]

    @staticmethod
    def of(model: mujoco.MjModel) -> "Motors":
        """Read the motors of a model whose first joint is free and whose others are hinges."""
        gear = model.actuator_gear[:, 0].copy()
        return Motors(
            hinge=model.jnt_qposadr[model.actuator_trnid[:, 0]] - 7,
            gear=gear,
            limit=gear * model.actuator_ctrlrange[:, 1],
        )


def require_same_clock(simulation_dt: float, reference_dt: float) -> None:
    """Refuse a reference motion for another control rate.

    Raises:
        BadPolicy: the control step of the policy or the robot is not the reference's.
    """
    if abs(simulation_dt - reference_dt) > 1e-9:
        raise BadPolicy(
            f"the control step is {1e3 * simulation_dt:g} ms and the reference motion's "
            f"{1e3 * reference_dt:g} ms: retarget for this robot, or mend track.control.substeps"
        )


def residual_scale(robot: Robot, control: ControlConfig) -> Float[np.ndarray, " nu"]:
    """Radians that a full action moves each motor's target: less for the arms."""
    model = robot.model
    arms = _moved_by(robot, ("left_hand", "right_hand")) - _moved_by(robot, ("head",))
    legs = _moved_by(robot, ("left_foot", "right_foot"))
    joints = model.actuator_trnid[:, 0]
    is_arm = [int(joint) in arms - legs for joint in joints]
    return np.where(is_arm, control.arm_residual, control.residual)


def _moved_by(robot: Robot, keypoints: tuple[str, ...]) -> set[int]:
    """Joints between the root and the bodies that carry the keypoints."""
    model, found = robot.model, set()
    for name in keypoints:
        body = model.site_bodyid[robot.keypoint_sites[robot.keypoint_names.index(name)]]
        while body > 0:
            first = model.body_jntadr[body]
            found |= set(range(first, first + model.body_jntnum[body]))
            body = model.body_parentid[body]
    return found


class Simulation:
    """N copies of a robot.

    Attributes:
        control: The law of control.
        residual: Radians that a full action moves each motor's target.
        qpos, qvel: State of every copy after the last `step` or `place`.
        broken: Copies whose state blew up since they were placed, so that MuJoCo reset them.
        points: Positions of the keypoint sites, world, in step with `qpos`.
        com: Centres of mass as `Humanoid-v5` sees them, one substep behind; law `torque` only.
        datas: MuJoCo's own state of every copy.
    """

    def __init__(
        self,
        robot: Robot,
        control: ControlConfig,
        n: int,
        threads: int = 1,
        random: RandomConfig | None = None,
        seed: int = 0,
    ) -> None:
        model = robot.model
        self.model, self.n, self._sites, self.control = model, n, robot.keypoint_sites, control
        self.motors = Motors.of(model)
        self.kp = control.stiffness * self.motors.limit
        self.kd = control.damping * self.kp
        self._models = [model] * n
        if random is not None and random != RandomConfig():
            self._vary(random, np.random.default_rng(seed))
        self.datas = [mujoco.MjData(own) for own in self._models]
        self._q = [data.qpos[7:] for data in self.datas]
        self._v = [data.qvel[6:] for data in self.datas]
        self._ctrl = [data.ctrl for data in self.datas]
        self.residual = residual_scale(robot, control)
        bounds = np.linspace(0, n, min(threads, n) + 1).astype(int)
        self._chunks = list(pairwise(bounds))
        self._pool = ThreadPoolExecutor(len(self._chunks)) if len(self._chunks) > 1 else None
        self.qpos = np.zeros((n, model.nq))
        self.qvel = np.zeros((n, model.nv))
        self.points = np.zeros((n, len(robot.keypoint_names), 3))
        self.com = np.zeros((n, 3))
        self.broken = np.zeros(n, bool)
        self.dt = control.substeps * model.opt.timestep

    def place(
        self,
        indices: Int[np.ndarray, " I"],
        qpos: Float[np.ndarray, "I nq"],
        qvel: Float[np.ndarray, "I nv"],
    ) -> None:
        """Put some copies into a state, forgetting their past (contacts, warm start, time)."""
        for row, i in enumerate(indices):
            data = self.datas[i]
            mujoco.mj_resetData(self.model, data)
            data.qpos[:], data.qvel[:] = qpos[row], qvel[row]
            mujoco.mj_forward(self._models[i], data)
            self.com[i] = centre_of_mass(self.model, data)
        self._gather(indices)

    def step(
        self, targets: Float[np.ndarray, "N nu"], active: Bool[np.ndarray, " N"] | None = None
    ) -> None:
        """One control step towards target hinge angles, rad, in actuator order; controls, shares
        of the gear, where the law is `torque`.

        Copies that are not `active` stay as they are; None steps all of them.
        """
        rows = np.ones(self.n, bool) if active is None else active
        if self._pool is None:
            self._advance(0, self.n, targets, rows)
        else:
            jobs = [self._pool.submit(self._advance, *c, targets, rows) for c in self._chunks]
            for job in jobs:
                job.result()
        warnings = np.array([data.warning.number for data in self.datas])
        self.broken = np.any(warnings[:, BAD_STATE] > 0, axis=1)
        self._gather(np.arange(self.n))

    def close(self) -> None:
        """Stop the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def _vary(self, random: RandomConfig, rng: np.random.Generator) -> None:
        """Give every copy a model and gains of its own."""
        self._models = [copy.copy(self.model) for _ in range(self.n)]
        for i, model in enumerate(self._models):
            model.geom_friction[:] *= 1 + random.friction * rng.uniform(-1, 1)
            chosen = random.integrators[i % len(random.integrators)]
            model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{chosen.upper()}")
        factor = 1 + random.gains * rng.uniform(-1, 1, (self.n, 1))
        self.kp, self.kd = self.kp * factor, self.kd * factor

    def _advance(self, lo: int, hi: int, targets: np.ndarray, rows: np.ndarray) -> None:
        live = [i for i in range(lo, hi) if rows[i]]
        models, datas, step = self._models, self.datas, mujoco.mj_step
        law = self.control.law
        for substep in range(self.control.substeps):
            if substep == 0 or law == "pd":
                control = self._controls(lo, hi, targets[lo:hi])
                for i in live:
                    self._ctrl[i][:] = control[i - lo]
            for i in live:
                step(models[i], datas[i])
        for i in live:
            if law == "torque":
                mujoco.mj_rnePostConstraint(models[i], datas[i])
                self.com[i] = centre_of_mass(models[i], datas[i])
            mujoco.mj_kinematics(models[i], datas[i])

    def _controls(self, lo: int, hi: int, targets: np.ndarray) -> np.ndarray:
        """What is written to `ctrl` for the copies from `lo` to `hi`."""
        motors = self.motors
        if self.control.law == "torque":
            return targets
        angle = np.array(self._q[lo:hi])[:, motors.hinge]
        speed = np.array(self._v[lo:hi])[:, motors.hinge]
        kp, kd = (k[lo:hi] if k.ndim > 1 else k for k in (self.kp, self.kd))
        torque = kp * (targets - angle) - kd * speed
        return np.clip(torque, -motors.limit, motors.limit) / motors.gear

    def _gather(self, indices: np.ndarray) -> None:
        datas = [self.datas[i] for i in indices]
        self.qpos[indices] = [data.qpos for data in datas]
        self.qvel[indices] = [data.qvel for data in datas]
        self.points[indices] = np.array([data.site_xpos for data in datas])[:, self._sites]


def centre_of_mass(model: mujoco.MjModel, data: mujoco.MjData) -> Float[np.ndarray, "3"]:
    """Of the whole robot, from the poses that MuJoCo computed last, metres, world."""
    return np.asarray(model.body_mass @ data.xipos / model.body_mass.sum())
