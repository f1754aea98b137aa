"""Retargeting: a human motion becomes a reference motion of a robot, with its score card.

optimise: bone-direction targets, whole-clip solver at half the control rate from two starts, the
cheaper one polished at the control rate. paper: Table I of RoboJackson, literally. framefix: the
same with the axes and signs of the hinges corrected.
"""

import logging

import numpy as np
from jaxtyping import Float

from robojackson.metrics.retarget_error import jerk
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.retarget import paper_mapping
from robojackson.retarget.feasibility.certification import certify
from robojackson.retarget.feasibility.contact_wrench import Tolerance
from robojackson.retarget.feasibility.tempo import times_at, warped
from robojackson.retarget.feasible_motion import Feasible, make_feasible
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.scorecard import hovers, score
from robojackson.retarget.scorecard_gate import BARS
from robojackson.retarget.targets.cycle import Cycle, human_clip
from robojackson.retarget.targets.human_clip import HumanClip
from robojackson.retarget.targets.keypoint_targets import Targets, targets
from robojackson.retarget.whole_clip import optimise, polished
from robojackson.robot.model import Robot
from robojackson.robot.resampling import velocities
from robojackson.robot.tree_kinematics import pose, tree

_log = logging.getLogger(__name__)
__all__ = ["RetargetConfig", "assemble", "retarget_motion"]


def retarget_motion(
    sequence: SmplSequence, robot: Robot, config: RetargetConfig
) -> ReferenceMotion:
    """The reference motion of a human motion, at the robot's control step, score card inside.

    Raises:
        TrackTooShort: Fewer frames than the solver needs.
    """
    dt = robot.description.control_dt
    cyclic = config.cyclic if config.method == "optimise" else "no"
    clip, cycle = human_clip(sequence, dt, cyclic, config.fixed_tempo, config.cycle)
    upright = aims = targets(clip, robot)
    extra = _notes(sequence, clip, cycle, config)
    if config.method == "optimise":
        found, floor_mm = optimise(aims, robot, config)
        hovering = hovers(robot, found.qpos, aims.dt)
        if hovering.mean() > BARS["unsupported_share"] / 2 and aims.airborne.any():
            _log.info("a flight that does not fall is taken back: solving again")
            upright = targets(clip, robot, hovering)
            found = polished(upright, found.qpos, found.shift, robot, config)
        able = make_feasible(robot, found.qpos, found.aims, config)
        extra |= {"keypoint_floor_mm": floor_mm, "lean_deg": found.lean_deg}
        extra |= _slowing(able, upright, robot)
        qpos, aims, upright = able.qpos, able.aims, warped(upright, able.steps)
        time_s = times_at(clip.time_s, able.steps)
    else:
        qpos = paper_mapping.mapped(
            sequence, robot, clip.time_s, corrected=config.method == "framefix"
        )
        time_s = clip.time_s
    return assemble(qpos, time_s, aims, upright, robot, extra, config.weights.tolerance)


def assemble(
    qpos: Float[np.ndarray, "S nq"],
    time_s: Float[np.ndarray, " S"],
    aims: Targets,
    upright: Targets,
    robot: Robot,
    extra: dict[str, float],
    tolerance: Tolerance,
) -> ReferenceMotion:
    """Everything that follows from the poses, and the score card.

    `aims` are what the solver followed, perhaps leaned; `upright` is the dancer's own motion.
    """
    posed = pose(tree(robot), qpos)
    certified = certify(robot, qpos, aims.dt, aims.cycle_offset, tolerance)
    parts = {
        "robot": robot.description.name,
        "model_sha256": robot.sha256,
        "dt": aims.dt,
        "cyclic": aims.cycle_offset is not None,
        "cycle_offset": np.zeros(3) if aims.cycle_offset is None else aims.cycle_offset,
        "qpos": qpos,
        "qvel": velocities(qpos, aims.dt, aims.cycle_offset),
        "body_pos_w": posed.body_pos[:, 1:],
        "keypoints_w": posed.site_pos,
        "contact": aims.contact,
        "torque_ratio": certified.torque_ratio,
        "source_time_s": time_s,
        "certificate": certified.certificate,
        "joint_names": robot.joint_names,
        "body_names": robot.body_names,
        "keypoint_names": robot.keypoint_names,
        "contact_names": robot.contact_names,
    }
    card = score(ReferenceMotion(**parts), robot, aims, upright)  # type: ignore[arg-type]
    card["root_residual_bw"] = float(np.median(certified.missing_bw))
    return ReferenceMotion(**parts, scorecard={**card, **extra})  # type: ignore[arg-type]


def _slowing(able: Feasible, upright: Targets, robot: Robot) -> dict[str, float]:
    """How much slower than the clip the motion is by its own choice, and the clip's own jerk."""
    source = upright.keypoints_w[:, robot.keypoint_weights > 0]
    return {
        "tempo_mean": len(upright) / len(able.steps),
        "tempo_min": float(np.gradient(able.steps).min()),
        "source_jerk_m_s3": jerk(source, upright.dt),
    }


def _notes(
    sequence: SmplSequence, clip: HumanClip, cycle: Cycle | None, config: RetargetConfig
) -> dict[str, float]:
    """What was done to the clip."""
    frames = len(sequence) if cycle is None else cycle.end - cycle.start
    stretch = 1.0
    if cycle is not None:
        stretch = len(clip.time_s) * clip.dt * config.fixed_tempo * sequence.fps / frames
    return {
        "source_frames": float(len(sequence)),
        "source_fps": float(sequence.fps),
        "tempo": config.fixed_tempo,
        "cyclic": float(cycle is not None),
        "trimmed_s": max(0.0, (len(sequence) - frames) / sequence.fps),
        "time_scale": stretch,
        "seam_source_mm": 0.0 if cycle is None else 1e3 * cycle.seam_m,
        "seam_source_deg": 0.0 if cycle is None else cycle.seam_deg,
        "cycle_travel_m": 0.0
        if clip.cycle_offset is None
        else float(np.linalg.norm(clip.cycle_offset)),
    }
