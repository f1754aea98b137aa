"""Many copies of one stock robot, stepped in threads, with the control law outside the model.

Stock physics: the model as gymnasium ships it. The torque of the PD law is computed once a substep
from the state at its beginning, clipped to the stock limit and written to `ctrl`; a servo inside
the model would be evaluated within the stages of RK4, which is another robot. The law `torque` is
bitwise equal to `Humanoid-v5.step`.

World frame, metres, radians, seconds, newton-metres. MuJoCo releases the interpreter lock in
`mj_step`, so two threads keep two cores busy.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.errors import BadPolicy
from robojackson.rl.config.train_config import ControlConfig, RandomConfig
from robojackson.rl.sim.disturbances import Disturbances
from robojackson.rl.sim.motors import (
    Motors,
    actuation_facts,
    feedback_path,
    feedback_share,
    feedforward_share,
    gains,
    residual_scale,
)
from robojackson.rl.sim.reference_clip import ClipStep
from robojackson.rl.sim.robot_batch import SIZE, Batch, Views, centre_of_mass, without_sensors
from robojackson.rl.sim.root_estimate import RootEstimate
from robojackson.rl.sim.step_law import StepCorrection
from robojackson.rl.sim.variation import varied_models
from robojackson.robot.model import Robot

BAD_STATE = [
    int(kind)
    for kind in (
        mujoco.mjtWarning.mjWARN_BADQPOS,
        mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC,
        mujoco.mjtWarning.mjWARN_BADCTRL,
    )
]
"""Warnings at which MuJoCo itself resets a state, or turns off all motors."""


def resolved(
    control: ControlConfig, robot: Robot, random: RandomConfig | None = None
) -> ControlConfig:
    """Return the control law with the robot's substeps, feed-forward, feedback and action factor as
    defaults."""
    pushed = random is not None and random.pushes > 0
    usual = robot.description.robust_action_factor if pushed else 1.0
    share = feedback_share(robot.description, control)
    return replace(
        control,
        substeps=control.substeps or robot.substeps,
        feedforward=feedforward_share(robot, control),
        feedback=share,
        root_state=control.root_state if share else None,
        feedback_path=feedback_path(robot, control),
        action_factor=control.action_factor or usual,
    )


def control_step(robot: Robot, control: ControlConfig) -> float:
    """Return the length of a control step, seconds."""
    return float((control.substeps or robot.substeps) * robot.model.opt.timestep)


def require_same_clock(simulation_dt: float, reference_dt: float) -> None:
    """Raise for a reference motion with another control rate.

    Raises:
        BadPolicy: the control step of the policy or the robot is not the reference's.
    """
    if abs(simulation_dt - reference_dt) > 1e-9:
        raise BadPolicy(
            f"the control step is {1e3 * simulation_dt:g} ms and the reference motion's "
            f"{1e3 * reference_dt:g} ms: retarget for this robot, or correct track.control.substeps"
        )


class Simulation:
    """N copies of a robot.

    Attributes:
        control: The law of control.
        residual: Radians that a full action moves each motor's target.
        actuation: Nominal gains and action scale, as written into a policy's file.
        qpos, qvel: State of every copy after the last `step` or `place`.
        previous: Targets of the previous control step; at first the own angles, or no torque.
        disturbances: Pushes and sensor noise; count, push_at are its counters.
        root_estimate: Of copies that do not know where their root is; None where they do.
        broken: Copies whose state diverged since they were placed, so that MuJoCo reset them.
        points: Positions of the keypoint sites, world, in step with `qpos`.
        com: Centres of mass as `Humanoid-v5` sees them, one substep behind; law `torque` only.
        datas: MuJoCo's own state of every copy.
        chunks: Batches of every thread: first copy, past the last, and the batch.
    """

    def __init__(
        self,
        robot: Robot,
        control: ControlConfig,
        n: int,
        threads: int = 1,
        random: RandomConfig | None = None,
        seed: int | Sequence[int] = 0,
        delay_s: float = 0.0,
    ) -> None:
        model, control = without_sensors(robot.model), resolved(control, robot, random)
        self.model, self.n, self._sites, self.control = model, n, robot.keypoint_sites, control
        self.motors = Motors.of(model)
        self.kp, self.kd = gains(robot, control)
        self._models, self._delay = [model] * n, np.zeros(n, int)
        random = random or RandomConfig()
        self.dt = control_step(robot, control)
        if random != RandomConfig():
            rng = np.random.default_rng(seed)
            self._models = varied_models(replace(robot, model=model), random, n, rng)
            share = random.shares(n)
            factor = 1 + random.gains * share[:, None] * rng.uniform(-1, 1, (n, 1))
            self.kp, self.kd = self.kp * factor, self.kd * factor
            longest = min(round(random.delay / model.opt.timestep), control.substeps or 1)
            self._delay = np.round(share * rng.integers(longest + 1, size=n)).astype(int)
        most = control.substeps or 1
        self._delay = np.minimum(self._delay + round(delay_s / model.opt.timestep), most)
        self.disturbances = Disturbances(random, n, self.dt, seed)
        self.previous = np.zeros((n, model.nu))
        self.count, self.push_at = self.disturbances.count, self.disturbances.push_at
        self.datas = [mujoco.MjData(own) for own in self._models]
        self._views = Views.of(self.datas)
        self.residual = residual_scale(robot, control)
        self.actuation = actuation_facts(robot, control)
        bounds = np.linspace(0, n, min(threads, n) + 1).astype(int)
        self.chunks = [self._batches(lo, hi) for lo, hi in pairwise(bounds)]
        self._pool = ThreadPoolExecutor(len(self.chunks)) if len(self.chunks) > 1 else None
        self.qpos = np.zeros((n, model.nq))
        self.qvel = np.zeros((n, model.nv))
        self.points = np.zeros((n, len(robot.keypoint_names), 3))
        self.com = np.zeros((n, 3))
        self.broken = np.zeros(n, bool)
        estimates = control.root_state == "estimated"
        self.root_estimate = RootEstimate(robot, self, n) if estimates else None

    def place(
        self,
        indices: Int[np.ndarray, " I"],
        qpos: Float[np.ndarray, "I nq"],
        qvel: Float[np.ndarray, "I nv"],
    ) -> None:
        """Put copies into a state and clear their past (contacts, warm start, time)."""
        for row, i in enumerate(indices):
            data = self.datas[i]
            mujoco.mj_resetData(self.model, data)
            data.qpos[:], data.qvel[:] = qpos[row], qvel[row]
            mujoco.mj_forward(self._models[i], data)
            self.com[i] = centre_of_mass(self.model, data)
            angles = data.qpos[7:][self.motors.hinge]
            self.previous[i] = 0.0 if self.control.law == "torque" else angles
        self._gather(indices)
        if self.root_estimate:
            self.root_estimate.begin(indices)

    def step(
        self, targets: Float[np.ndarray, "N nu"], active: Bool[np.ndarray, " N"] | None = None
    ) -> None:
        """Run one control step towards target hinge angles, rad, in actuator order; for the law
        `torque` towards controls, shares of the gear.

        Copies that are not `active` do not change; None steps all of them.
        """
        rows = np.ones(self.n, bool) if active is None else active
        if self._pool is None:
            self._advance(self.chunks[0], targets, rows)
        else:
            jobs = [self._pool.submit(self._advance, c, targets, rows) for c in self.chunks]
            for job in jobs:
                job.result()
        self.previous[:] = targets
        self.disturbances.after_step(self.datas, rows)
        raised = np.concatenate(self._views.warnings).reshape(self.n, -1)
        self.broken = np.any(raised[:, BAD_STATE] > 0, axis=1)
        self._gather_all()
        if self.root_estimate:
            self.root_estimate.after_step()

    def sensed(self) -> tuple[Float[np.ndarray, "N nq"], Float[np.ndarray, "N nv"]]:
        """Return qpos and qvel as the sensors measure them."""
        return self.disturbances.sense(self.qpos, self.qvel)

    def reference_angles(self, step: ClipStep) -> Float[np.ndarray, "N nu"]:
        """Return the target hinge angles of a reference step without a policy, rad."""
        angles = step.angles(self.motors.hinge)
        if step.feedback is not None and self.control.feedback:
            angles = angles + self._correction(step.feedback)
        return angles

    def close(self) -> None:
        """Stop the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def _correction(self, feedback: StepCorrection) -> Float[np.ndarray, "N nu"]:
        """Return the offsets of the targets by the feedback, rad."""
        if self.root_estimate is None:
            return feedback(*self.sensed())
        noise = self.disturbances.accelerometer_noise()
        estimate = self.root_estimate.of(*self.sensed(), feedback.path(), noise)
        return feedback(*estimate, beside_feet=True)

    def _batches(self, lo: int, hi: int) -> list[tuple[int, int, Batch]]:
        """Return the copies of one thread, a batch at a time."""
        found = []
        for first in range(lo, hi, SIZE):
            past = min(first + SIZE, hi)
            kp, kd = (k[first:past] if k.ndim > 1 else k for k in (self.kp, self.kd))
            models, datas = self._models[first:past], self.datas[first:past]
            late = self._delay[first:past]
            batch = Batch(models, datas, self.motors, self.control, kp, kd, late)
            found.append((first, past, batch))
        return found

    def _advance(
        self, batches: list[tuple[int, int, Batch]], targets: np.ndarray, rows: np.ndarray
    ) -> None:
        for lo, hi, batch in batches:
            slices = (targets[lo:hi], rows[lo:hi], self.com[lo:hi], self.previous[lo:hi])
            batch.advance(*slices)

    def _gather(self, indices: np.ndarray) -> None:
        for i in indices:
            data = self.datas[i]
            self.qpos[i], self.qvel[i] = data.qpos, data.qvel
            self.points[i] = data.site_xpos[self._sites]

    def _gather_all(self) -> None:
        """Gather the state of all copies with few calls."""
        views, n = self._views, self.n
        np.concatenate(views.qpos, out=self.qpos.reshape(-1))
        np.concatenate(views.qvel, out=self.qvel.reshape(-1))
        sites = np.concatenate(views.sites).reshape(n, -1, 3)
        sites.take(self._sites, 1, out=self.points)
