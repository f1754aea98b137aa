"""Retargeting: a human motion becomes a reference motion of a robot, with its score card.

optimise: bone-direction targets, whole-clip solver at half the control rate from two starts, the
cheaper one polished at the control rate. paper: Table I of RoboJackson, literally. framefix: the
same with the axes and signs of the hinges corrected.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from robojackson.metrics.retarget_error import jerk
from robojackson.motion.certificate import Certificate
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.retarget import paper_mapping
from robojackson.retarget.danced_motion import danced_motion
from robojackson.retarget.feasibility.certification import certify
from robojackson.retarget.feasibility.contact_wrench import Tolerance
from robojackson.retarget.feasibility.tempo import times_at, warped
from robojackson.retarget.feasible_motion import Feasible
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.scorecard import score
from robojackson.retarget.scorecard_gate import failures
from robojackson.retarget.targets.clip_ends import danced_frames
from robojackson.retarget.targets.cycle import Cycle, human_clip
from robojackson.retarget.targets.human_clip import HumanClip
from robojackson.retarget.targets.keypoint_targets import Targets, select_steps, targets
from robojackson.retarget.targets.motion_parts import parts_of
from robojackson.retarget.targets.tails import settled
from robojackson.robot.model import Robot
from robojackson.robot.resampling import velocities
from robojackson.robot.tree_kinematics import pose, tree

A_ROW_A_STEP = (
    "qpos", "qvel", "body_pos_w", "keypoints_w", "contact", "torque_ratio", "source_time_s",
)  # fmt: skip
OF_THE_CLIP = ("keypoint_", "bone_", "infeasible_", "slack_", "torque_", "contact_", "planted_",
               "unsupported_", "velocity_")  # fmt: skip
"""Beginnings of the figures that stands before and after the clip would flatter."""
MENDED_BY_TIME = {
    "infeasible_share", "unsupported_share", "speed_over_limit", "seam_speed_rad_s",
}  # fmt: skip
"""Figures of the gate that a slower motion mends."""
MOST_INFEASIBLE = 0.3
"""Share of infeasible steps beyond which no slower motion is tried."""
__all__ = ["RetargetConfig", "assemble", "retarget_motion"]


def retarget_motion(
    sequence: SmplSequence, robot: Robot, config: RetargetConfig
) -> ReferenceMotion:
    """Return the reference motion of a human motion, at the robot's control step, score card
    inside.

    With `tempo: auto`, a motion that the gate refuses although it is nearly feasible is solved
    again as a slower one; the fastest that passes the gate is returned, or else the first.

    Raises:
        TrackTooShort: Fewer frames than the solver needs.
    """
    found = _retargeted(sequence, robot, config)
    if config.tempo != "auto" or config.method != "optimise" or not _slower_helps(found.scorecard):
        return found
    for tempo in config.slower_tempos:
        slower = _retargeted(sequence, robot, replace(config, tempo=tempo))
        if not failures(slower.scorecard):
            return slower
    return found


def _slower_helps(card: Mapping[str, float]) -> bool:
    """Return whether a motion may pass the gate as a slower one."""
    failed = set(failures(card))
    return bool(failed) and failed <= MENDED_BY_TIME and card["infeasible_share"] <= MOST_INFEASIBLE


def _retargeted(sequence: SmplSequence, robot: Robot, config: RetargetConfig) -> ReferenceMotion:
    dt = robot.description.control_dt
    cyclic = config.cyclic if config.method == "optimise" else "no"
    whole, cuts = len(sequence), config.cut_glides and config.method == "optimise"
    frames = danced_frames(sequence) if cuts else slice(0, whole)
    sequence = sequence.part(frames)
    clip, cycle = human_clip(sequence, dt, cyclic, config.fixed_tempo, config.cycle)
    clip = replace(clip, time_s=clip.time_s + frames.start / sequence.fps)
    extra = _notes(sequence, clip, cycle, config)
    extra["trimmed_s"] += (whole - len(sequence)) / sequence.fps
    danced: Bool[np.ndarray, " S"] | None = None
    if config.method == "optimise":
        tailed, upright, able, floor_mm, lean_deg, sway_m = danced_motion(clip, robot, config)
        extra |= {"keypoint_floor_mm": floor_mm, "lean_deg": lean_deg, "sway_cm": 100.0 * sway_m}
        extra |= _slowing(able, upright, robot)
        qpos, aims, upright = able.qpos, able.aims, warped(upright, able.steps)
        time_s = times_at(tailed.source_time(clip.time_s), able.steps)
        danced = able.danced
        extra |= _tail_seconds(danced, aims.dt)
        stands = (slice(0, tailed.lead), slice(len(qpos) - tailed.stand, len(qpos)))
        qpos = settled(qpos, stands, aims.dt)
    else:
        qpos = paper_mapping.mapped(
            sequence, robot, clip.time_s, corrected=config.method == "framefix"
        )
        time_s, upright = clip.time_s, targets(clip, robot)
        aims = upright
    return assemble(qpos, time_s, aims, upright, robot, extra, config.weights.tolerance, danced)


def assemble(
    qpos: Float[np.ndarray, "S nq"],
    time_s: Float[np.ndarray, " S"],
    aims: Targets,
    upright: Targets,
    robot: Robot,
    extra: dict[str, float],
    tolerance: Tolerance,
    danced: Bool[np.ndarray, " S"] | None = None,
) -> ReferenceMotion:
    """Return everything that follows from the poses, and the score card.

    Figures that are means or shares are those of the steps that are `danced`, but that the share
    of infeasible steps is the largest of clip, ways and stands. `aims` are what the solver
    followed, perhaps leaned; `upright` is the dancer's own motion.
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
    if danced is not None and not danced.all():
        card |= _without_tails(parts, danced, robot, aims, upright)
        infeasible = ~(certified.certificate.slack <= 1.0)
        shares = (infeasible[part].mean() for part in parts_of(aims, danced))
        card["infeasible_share"] = float(max(shares))
        card["passed"] = float(not failures(card))
    card["root_residual_bw"] = float(np.median(certified.missing_bw))
    return ReferenceMotion(**parts, scorecard={**card, **extra})  # type: ignore[arg-type]


def _tail_seconds(danced: Bool[np.ndarray, " S"], dt: float) -> dict[str, float]:
    """Return how long the motion stands, and goes to and from the stand, around the clip."""
    first, last = np.flatnonzero(danced)[[0, -1]]
    after = len(danced) - 1 - int(last)
    return {"lead_s": int(first) * dt, "tail_s": after * dt} if after else {}


def _without_tails(
    parts: dict[str, Any],
    danced: Bool[np.ndarray, " S"],
    robot: Robot,
    aims: Targets,
    upright: Targets,
) -> dict[str, float]:
    """Return the means and shares over the clip's own steps."""
    found: Certificate = parts["certificate"]
    some = {name: parts[name][danced] for name in A_ROW_A_STEP}
    some["certificate"] = replace(found, slack=found.slack[danced], tempo=found.tempo[danced])
    motion = ReferenceMotion(**(parts | some))
    card = score(motion, robot, select_steps(aims, danced), select_steps(upright, danced))
    return {name: card[name] for name in card if name.startswith(OF_THE_CLIP)}


def _slowing(able: Feasible, upright: Targets, robot: Robot) -> dict[str, float]:
    """Return how much slower than the clip the motion is by its own choice, without its tails, and
    the clip's own jerk."""
    source = upright.keypoints_w[:, robot.keypoint_weights > 0]
    return {
        "tempo_mean": (able.clip.stop - able.clip.start) / int(able.danced.sum()),
        "tempo_min": float(np.gradient(able.steps)[able.danced].min()),
        "source_jerk_m_s3": jerk(source, upright.dt),
    }


def _notes(
    sequence: SmplSequence, clip: HumanClip, cycle: Cycle | None, config: RetargetConfig
) -> dict[str, float]:
    """Return what was done to the clip."""
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
