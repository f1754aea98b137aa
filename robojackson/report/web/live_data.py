"""Data that a browser needs to run a trained policy: model, motion, network, control law, fall
rule.

Metres, radians, seconds, newton-metres.
"""

import mujoco
import numpy as np

from robojackson.formats.deploy.deployed_feedback import soles_of
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.report.web.live_model import live_model
from robojackson.report.web.live_records import live_records, shown_control
from robojackson.report.web.shapes import packed, robot_shape
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.evaluation.controllers import Evaluated, sees_ahead
from robojackson.rl.feedback.cached_feedback import feedback_of
from robojackson.rl.feedback.standing_feet import LOW_M
from robojackson.rl.modes.observation import (
    CLIP,
    HINGE_SPEED_SCALE,
    POINT_SCALE,
    ROOT_SCALE,
    SPEED_SCALE,
    USUAL_HEIGHT_M,
)
from robojackson.rl.policy import Policy
from robojackson.rl.policy_facts import mode_of, observation_of
from robojackson.rl.sim.accelerometer import NOISE_M_S2
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.leg_odometry import CONSTANTS
from robojackson.rl.sim.motors import Motors, gains, residual_scale
from robojackson.rl.sim.preview import preview_of
from robojackson.rl.trackers.policy_tracker import PolicyTracker
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.robot.body_states import solid_geoms
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot
from robojackson.robot.model_files import FAULTS, first_line
from robojackson.robot.names import PELVIS

LARGEST, TINY = 32767, 1e-30
"""Largest number of 16 bits, and of a motor without gains."""


def live_data(
    policy: Evaluated, reference: ReferenceMotion, robot: Robot
) -> dict[str, object] | None:
    """Return the data of a live dance; None where a browser cannot run it (`why_not_live`)."""
    if why_not_live(policy, robot):
        return None
    control, network = shown_control(policy, robot), _network(policy)
    seen = None if network is None else observation_of(network)
    motors, (kp, kd) = Motors.of(robot.model), gains(robot, control)
    lead, fall = lead_of(robot, reference, control), Fall.of(robot)
    names = [robot.model.site(int(site)).name for site in robot.keypoint_sites]
    xml, numbers = live_model(robot)
    return {
        "xml": xml,
        "numbers": numbers,
        "dt": reference.dt,
        "substeps": control.substeps or robot.substeps,
        "qpos": packed(reference.qpos, np.float64),
        "qvel": packed(reference.qvel, np.float64),
        "points": packed(reference.keypoints_w, np.float64),
        "lead": None if lead is None else packed(lead, np.float64),
        "feedback": _feedback(robot, reference, control),
        "cyclic": bool(reference.cyclic),
        "offset": np.asarray(reference.cycle_offset, float).tolist(),
        "sites": names,
        "pelvis": robot.keypoint_names.index(PELVIS),
        "observation": seen,
        "preview": packed(preview_of(reference, robot)) if sees_ahead(policy) else None,
        "rest": robot.standing[7:].tolist(),
        "layers": [
            {"weight": packed(weight), "bias": packed(bias), "inputs": len(weight)}
            for weight, bias in (network.layers if network else ())
        ],
        "scales": {
            "gyro": SPEED_SCALE, "hinge": HINGE_SPEED_SCALE, "point": POINT_SCALE,
            "root": ROOT_SCALE, "clip": CLIP, "height": USUAL_HEIGHT_M,
        },
        "hinge": motors.hinge.tolist(),
        "gear": motors.gear.tolist(),
        "limit": motors.limit.tolist(),
        "kp": kp.tolist(),
        "kd": kd.tolist(),
        "action": residual_scale(robot, control).tolist(),
        "fall": {
            "relative": fall.relative,
            "height": fall.height,
            "cosTilt": fall.cos_tilt,
        },
        "shape": robot_shape(robot.model),
        "records": live_records(policy, reference, robot),
    }  # fmt: skip


def why_not_live(policy: Evaluated | None, robot: Robot) -> str:
    """Return why a browser cannot run a dance; empty where it can."""
    if not isinstance(policy, Policy | RegulatorTracker | PolicyTracker):
        return "a browser cannot run the network of another project"
    if isinstance(policy, Policy) and mode_of(policy) != "track":
        return "a browser cannot run a policy of the paper's mode"
    if isinstance(policy, RegulatorTracker) and policy.policy is not None:
        return "a browser cannot run feedback with a network of many motions on top"
    if (law := shown_control(policy, robot).law) != "pd":
        return f"a browser cannot run the control law {law}"
    if _has_colliding_meshes(robot.model):
        return f"a browser cannot run robot {robot.description.name}, whose meshes collide"
    try:
        live_model(robot)
    except FAULTS as cause:
        return f"a browser cannot run robot {robot.description.name}: {first_line(cause)}"
    return ""


def _network(policy: Evaluated) -> Policy | None:
    """Return the network; None of feedback alone."""
    return (
        policy.policy
        if isinstance(policy, PolicyTracker)
        else (policy if isinstance(policy, Policy) else None)
    )


def _feedback(
    robot: Robot, reference: ReferenceMotion, control: ControlConfig
) -> dict[str, object] | None:
    """Return the feedback along the reference, its gains as 16-bit shares of the largest of their
    motor; None without one."""
    found = feedback_of(robot, [reference], control)
    if found is None:
        return None
    gains, feet = found.gains, np.unique(robot.contact_keypoints)
    step = np.maximum(np.abs(gains.gain).max(-1), TINY).astype(np.float32) / LARGEST
    estimated = control.root_state == "estimated"
    places = found.footholds if estimated else gains.places
    anchored = bool(np.isfinite(places).all())
    return {
        "odometry": _odometry(robot) if estimated else None,
        "gain": packed(np.round(gains.gain / step[..., None]), np.int16),
        "step": packed(step),
        **{name: packed(getattr(gains, name), np.float64) for name in ("offset", "qpos", "qvel")},
        "limit": found.limit.tolist(),
        "places": packed(places, np.float64) if anchored else None,
        "feet": feet.tolist(),
        "low": LOW_M,
    }


def _odometry(robot: Robot) -> dict[str, object]:
    """Return what a page estimates height and velocity of the root from (`rl.sim.leg_odometry`)."""
    return {
        **CONSTANTS,
        "imu": list(robot.description.imu),
        "noise": NOISE_M_S2,
        "soles": [ball.as_row() for ball in soles_of(robot)],
    }


def _has_colliding_meshes(model: mujoco.MjModel) -> bool:
    kinds = (int(mujoco.mjtGeom.mjGEOM_MESH), int(mujoco.mjtGeom.mjGEOM_HFIELD))
    return bool((solid_geoms(model) & np.isin(model.geom_type, kinds)).any())
