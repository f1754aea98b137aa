"""The score card: how good a reference motion is; `scorecard_gate` refuses a bad one.

All figures are measured on the motion as the trainer will get it, at the control step.
"""

import numpy as np
from jaxtyping import Bool, Float

from robojackson.geometry.rotations import quat_to_matrix
from robojackson.metrics import retarget_error
from robojackson.metrics.dance_score import velocity_score
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import AIR, PLANTED
from robojackson.retarget.feasibility.certification import fallen
from robojackson.retarget.scorecard_gate import failures
from robojackson.retarget.solver.collision import Detector
from robojackson.retarget.targets.keypoint_targets import BONES, Targets
from robojackson.robot.model import KEYPOINTS, Robot
from robojackson.robot.names import HIPS
from robojackson.robot.resampling import forward_velocities, seam_angle, seam_shift, seam_speed
from robojackson.robot.tree_kinematics import centre_of_mass, pose, sole_velocities, tree


def score(
    motion: ReferenceMotion, robot: Robot, aims: Targets, upright: Targets | None = None
) -> dict[str, float]:
    """Return all figures of a motion; `passed` is 1 when every bar holds.

    Args:
        aims: What the solver followed: contacts, and keypoints that may be leaned over the feet.
        upright: The dancer's own keypoints, which fidelity is measured against; `aims` when None.
    """
    card = {
        "steps": float(len(motion)),
        "seconds": len(motion) * motion.dt,
        **_validity(motion, robot),
        **_collision(motion, robot),
        **_contact(motion, robot, aims),
        **_fidelity(motion, robot, upright or aims),
        "keypoint_leaned_mm": _keypoint_error(motion, robot, aims),
        **_posture(motion),
    }
    cycle_offset = motion.cycle_offset if motion.cyclic else None
    card["seam_deg"] = (
        0.0 if cycle_offset is None else seam_angle(motion.qpos, motion.dt, cycle_offset)
    )
    card["seam_mm"] = (
        0.0 if cycle_offset is None else 1e3 * seam_shift(motion.qpos, motion.dt, cycle_offset)
    )
    card["seam_speed_rad_s"] = (
        0.0 if cycle_offset is None else seam_speed(motion.qpos, motion.dt, cycle_offset)
    )
    driven = motion.torque_ratio[:, robot.actuated]
    card["torque_ratio_p95"] = float(np.quantile(driven, 0.95)) if driven.size else 0.0
    card["torque_over_share"] = float((motion.torque_ratio > 1).any(axis=1).mean())
    card |= _feasibility(motion, robot)
    card["passed"] = float(not failures(card))
    return card


def hovers(
    robot: Robot, qpos: Float[np.ndarray, "S nq"], dt: float, ring: bool
) -> Bool[np.ndarray, " S"]:
    """Return the steps in which the robot neither stands nor falls.

    Args:
        ring: Whether the first step follows the last.
    """
    posed = pose(tree(robot), qpos)
    soles = posed.ball_pos[..., 2] - robot.contact_radii
    height = centre_of_mass(tree(robot), posed)[:, 2]
    return retarget_error.unsupported(soles, height, dt, ring=ring)


def _feasibility(motion: ReferenceMotion, robot: Robot) -> dict[str, float]:
    """Return the shares of steps that the robot cannot do, and that the fall rule ends."""
    found = motion.certificate
    slack = np.full(len(motion), np.nan) if found is None else found.slack
    return {
        "infeasible_share": float(np.mean(~(slack <= 1.0))),
        "slack_p95": float(np.quantile(slack, 0.95)),
        "fallen_share": float(fallen(robot, motion.qpos).mean()),
    }


def _validity(motion: ReferenceMotion, robot: Robot) -> dict[str, float]:
    cycle_offset = motion.cycle_offset if motion.cyclic else None
    hinges = motion.qpos[:, 7:]
    steps = forward_velocities(motion.qpos, motion.dt, cycle_offset)[:, 6:]
    speeds = np.maximum(np.abs(steps).max(0), np.abs(motion.qvel[:, 6:]).max(0))
    arrays = (motion.qpos, motion.qvel, motion.body_pos_w, motion.keypoints_w, motion.torque_ratio)
    return {
        "nan_count": float(sum(np.count_nonzero(~np.isfinite(a)) for a in arrays)),
        "limit_violations": float(
            np.count_nonzero(retarget_error.limit_excess(hinges, robot.lower, robot.upper) > 1e-9)
        ),
        "limit_excess_max_deg": float(
            np.degrees(retarget_error.limit_excess(hinges, robot.lower, robot.upper).max())
        ),
        "quat_error": float(np.abs(np.linalg.norm(motion.qpos[:, 3:7], axis=1) - 1).max()),
        "joint_speed_max_rad_s": float(speeds.max()),
        "speed_over_limit": float((speeds / robot.actuation.motion_speed).max()),
        "hinge_jerk_rms_rad_s3": retarget_error.hinge_jerk_rms(hinges, motion.dt),
    }


def _collision(motion: ReferenceMotion, robot: Robot) -> dict[str, float]:
    touches = Detector(robot, 0.0).touches(motion.qpos)
    depth = -1e3 * touches.distance
    return {
        "floor_penetration_mm": float(depth[touches.floor].max(initial=0.0)),
        "self_penetration_mm": float(depth[~touches.floor].max(initial=0.0)),
    }


def _contact(motion: ReferenceMotion, robot: Robot, aims: Targets) -> dict[str, float]:
    shape = tree(robot)
    posed = pose(shape, motion.qpos)
    ground = posed.ball_pos.copy()
    ground[..., 2] -= robot.contact_radii
    cycle_offset = motion.cycle_offset if motion.cyclic else None
    speed = sole_velocities(robot, posed, motion.dt, cycle_offset)
    slip = retarget_error.slip_cm_s(speed, aims.contact == PLANTED)
    height = np.abs(ground[..., 2])
    gap = 1e3 * height[aims.contact != AIR]
    return {
        "planted_slip_cm_s": float(slip.mean()) if len(slip) else 0.0,
        "planted_slip_p95_cm_s": float(np.quantile(slip, 0.95)) if len(slip) else 0.0,
        "contact_gap_mm": float(gap.mean()) if len(gap) else 0.0,
        "contact_gap_max_mm": float(gap.max(initial=0.0)),
        "planted_gap_max_mm": float(1e3 * height[aims.contact == PLANTED].max(initial=0.0)),
        "contact_share": float((aims.contact != AIR).any(axis=1).mean()),
        "planted_share": float((aims.contact == PLANTED).any(axis=1).mean()),
        "unsupported_share": float(hovers(robot, motion.qpos, motion.dt, motion.cyclic).mean()),
    }


def _fidelity(motion: ReferenceMotion, robot: Robot, aims: Targets) -> dict[str, float]:
    weighted = robot.keypoint_weights > 0
    error = retarget_error.keypoint_error_mm(motion.keypoints_w, aims.keypoints_w, weighted)
    bones = [(KEYPOINTS.index(a), KEYPOINTS.index(b)) for a, b in BONES]
    angles = retarget_error.bone_angles_deg(motion.keypoints_w, aims.keypoints_w, bones)
    hips = [robot.keypoint_names.index(name) for name in HIPS]
    middles = [each.keypoints_w[:, hips].mean(1, keepdims=True) for each in (motion, aims)]
    from_hips = retarget_error.keypoint_error_mm(
        motion.keypoints_w - middles[0], aims.keypoints_w - middles[1], weighted
    )
    return {
        "keypoint_mm": float(error.mean()),
        "keypoint_pelvis_mm": float(from_hips.mean()),
        "keypoint_p95_mm": float(np.quantile(error, 0.95)),
        "velocity_score": velocity_score(
            motion.keypoints_w[:, weighted], aims.keypoints_w[:, weighted]
        ),
        "bone_deg": float(angles.mean()),
        "bone_p95_deg": float(np.quantile(angles, 0.95)),
        "keypoint_jerk_m_s3": retarget_error.jerk(motion.keypoints_w[:, weighted], motion.dt),
        "source_jerk_m_s3": retarget_error.jerk(aims.keypoints_w[:, weighted], motion.dt),
    }


def _keypoint_error(motion: ReferenceMotion, robot: Robot, aims: Targets) -> float:
    weighted = robot.keypoint_weights > 0
    return float(
        retarget_error.keypoint_error_mm(motion.keypoints_w, aims.keypoints_w, weighted).mean()
    )


def _posture(motion: ReferenceMotion) -> dict[str, float]:
    up: Float[np.ndarray, " S"] = quat_to_matrix(motion.qpos[:, 3:7])[:, 2, 2]
    return {
        "tilt_max_deg": float(np.degrees(np.arccos(np.clip(up.min(), -1.0, 1.0)))),
        "torso_height_min_m": float(motion.qpos[:, 2].min()),
    }
