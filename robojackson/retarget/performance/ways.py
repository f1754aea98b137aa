"""Ways of a performance: from one stand to another, and into and out of a dance that repeats.

They are planned as tails are (`targets.tails`, `targets.footsteps`): targets of keypoints, solved
with planted feet and repaired until the robot can do them. Metres, seconds, world frame.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from robojackson.geometry.blends import minimum_jerk
from robojackson.geometry.rotations import heading
from robojackson.motion.floor_move import FloorMove
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import AIR, PLANTED
from robojackson.retarget.feasible_motion import given, make_feasible
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.targets.footsteps import (
    SIDES,
    Feet,
    feet_of,
    stand_over,
    steps_between,
)
from robojackson.retarget.targets.keypoint_targets import Targets, trunk_frame
from robojackson.retarget.targets.tails import settled, with_tails
from robojackson.retarget.whole_clip import polished
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import continuous, pose, tree

BLEND_S, REST_S = 0.8, 0.4
"""From one stand into the upright one between the steps and on into the next; stillness after."""
SAME_SHARE = 0.3
"""Of what counts as the same place at a tail's end: between two dances, feet must not slide."""
FADE_S = 0.4
"""In which a solved way is drawn to the exact stands at its ends."""


@dataclass(frozen=True)
class Piece:
    """A part of a performance before the parts are joined.

    Attributes:
        qpos: Poses from its first step on, standing at both ends.
        contact: State of the contact points at every step.
        danced: Its steps that show the dance; none of a way.
    """

    qpos: Float[np.ndarray, "S nq"]
    contact: Int[np.ndarray, "S C"]
    danced: tuple[int, int] = (0, 0)

    def moved(self, move: FloorMove) -> "Piece":
        """Return it elsewhere on the floor."""
        return replace(self, qpos=move.qpos(self.qpos))


def standing_dance(
    motion: ReferenceMotion, robot: Robot, config: RetargetConfig, seconds: float
) -> Piece:
    """Return a dance that begins and ends standing.

    Args:
        seconds: How long a motion that repeats goes on, at least one cycle.
    """
    if not motion.cyclic and _rests(motion):
        card = motion.scorecard
        first, after = (round(card.get(key, 0.0) / motion.dt) for key in ("lead_s", "tail_s"))
        danced = (first, len(motion) - after)
        return Piece(np.asarray(motion.qpos, float), np.asarray(motion.contact), danced)
    cycles = max(1, round(seconds / (len(motion) * motion.dt))) if motion.cyclic else 1
    qpos = _unrolled(np.asarray(motion.qpos, float), motion.cycle_offset, cycles)
    aims = _targets(robot, qpos, np.tile(motion.contact, (cycles, 1)), motion.dt)
    tails = replace(config.tails, use="yes")
    tailed = with_tails(aims, robot, tails)
    after = len(tailed.aims) - tailed.clip.stop
    start = np.pad(qpos, ((tailed.clip.start, after), (0, 0)), mode="edge")
    found = polished(tailed.aims, start, np.zeros(2), robot, config)
    able = make_feasible(robot, given(found.qpos, found.aims, tailed.clip), config)
    stands = (slice(0, tailed.lead), slice(len(able.qpos) - tailed.stand, len(able.qpos)))
    shown = np.flatnonzero(able.danced)
    danced = (int(shown[0]), int(shown[-1]) + 1)
    return Piece(settled(able.qpos, stands, motion.dt), able.aims.contact, danced)


def way(
    start: Float[np.ndarray, " nq"],
    end: Float[np.ndarray, " nq"],
    robot: Robot,
    config: RetargetConfig,
    dt: float,
) -> Piece:
    """Return the way from one stand into another one over the same place, with steps where the
    feet are placed differently."""
    both = np.stack([start, end])
    points, yaw = pose(tree(robot), both).site_pos, float(heading(start[3:7]))
    feet, goal = (feet_of(each, yaw, robot) for each in points)
    keypoints, contact = _way_targets(points, feet, goal, yaw, robot, dt)
    share = _shares(len(keypoints) - round(REST_S / dt), len(keypoints))[:, None]
    ends = continuous(both)
    guess = (1 - share) * ends[:1] + share * ends[1:]
    guess[:, 3:7] /= np.linalg.norm(guess[:, 3:7], axis=1, keepdims=True)
    aims = replace(_targets(robot, guess, contact, dt), keypoints_w=keypoints)
    found = polished(aims, _pinned(guess, ends, dt), np.zeros(2), robot, config)
    pinned = _pinned(found.qpos, ends, dt)
    able = make_feasible(robot, given(pinned, found.aims), config)
    return Piece(_pinned(able.qpos, ends, dt), able.aims.contact)


def _way_targets(
    points: Float[np.ndarray, "2 K 3"], feet: Feet, goal: Feet, yaw: float, robot: Robot, dt: float
) -> tuple[Float[np.ndarray, "N K 3"], Int[np.ndarray, "N C"]]:
    """Return the keypoints of a way between two stands, and the contact states."""
    steps, rest = round(BLEND_S / dt), round(REST_S / dt)
    share = _shares(steps, steps)[:, None, None]
    first, last = points
    if all(feet[side].near(goal[side], SAME_SHARE) for side in SIDES):
        parts, air = [first + share * (last - first)], np.zeros((0, 2), bool)
        before = steps
    else:
        walk = steps_between(feet, goal, yaw, robot, dt, SAME_SHARE)
        upright = stand_over(feet, yaw, robot), stand_over(goal, yaw, robot)
        parts = [first + share * (upright[0] - first), walk.keypoints_w]
        parts.append(upright[1] + share * (last - upright[1]))
        air, before = walk.in_air, steps
    keypoints = np.concatenate([*parts, np.repeat(last[None], rest, 0)])
    sides = [SIDES.index(point.side) for point in robot.description.contacts.values()]
    contact = np.full((len(keypoints), len(sides)), PLANTED, np.int8)
    contact[before : before + len(air)][air[:, sides]] = AIR
    return keypoints, contact


def _targets(
    robot: Robot, qpos: Float[np.ndarray, "N nq"], contact: Int[np.ndarray, "N C"], dt: float
) -> Targets:
    """Return a robot's own motion as targets."""
    points = pose(tree(robot), qpos).site_pos
    trunk = {name: points[:, i] for i, name in enumerate(robot.keypoint_names)}
    return Targets(
        keypoints_w=points,
        weights=np.repeat(robot.keypoint_weights[None], len(points), 0),
        contact=contact,
        heading=trunk_frame(trunk),
        dt=dt,
        cycle_offset=None,
        airborne=np.zeros(len(points), bool),
    )


def _rests(motion: ReferenceMotion) -> bool:
    """Return whether a motion stands still at both ends."""
    return "tail_s" in motion.scorecard


def _unrolled(
    qpos: Float[np.ndarray, "S nq"], offset: Float[np.ndarray, "3"], cycles: int
) -> Float[np.ndarray, "N nq"]:
    found = np.tile(qpos, (cycles, 1))
    found[:, :3] += np.repeat(np.arange(cycles), len(qpos))[:, None] * np.asarray(offset, float)
    return continuous(found)


def _pinned(
    qpos: Float[np.ndarray, "N nq"], ends: Float[np.ndarray, "2 nq"], dt: float
) -> Float[np.ndarray, "N nq"]:
    """Return a way that begins and ends exactly in the stands that it joins."""
    count = max(2, min(round(FADE_S / dt), len(qpos) // 2))
    found, fade = qpos.copy(), 1 - _shares(count, count)[:, None]
    fade = np.concatenate([[[1.0]], fade[:-1]])
    for rows, end in ((slice(0, count), ends[0]), (slice(len(qpos) - 1, -count - 1, -1), ends[1])):
        part = found[rows]
        target = end.copy()
        target[3:7] *= np.sign(part[0, 3:7] @ end[3:7]) or 1.0
        found[rows] = part + fade * (target - part[0])
    found[:, 3:7] /= np.linalg.norm(found[:, 3:7], axis=1, keepdims=True)
    return continuous(found)


def _shares(steps: int, count: int) -> Float[np.ndarray, " N"]:
    """Return shares of a way from rest to rest, without its beginning; 1 after the last step."""
    t = np.minimum(np.arange(1, count + 1) / steps, 1.0)
    return minimum_jerk(t)
