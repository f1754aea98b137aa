"""Tails of a motion that does not repeat: it begins and ends standing.

A robot that is left alone when its motion ends falls. So a stand is put before and after the clip,
with the feet where the clip has them: the targets go from one to the other in `blend_s` by
fifth-order polynomials (minimum jerk; Flash & Hogan, 1985), planted feet stay, a foot in the air is
put down below itself. Where no robot stands well on such feet, steps lead on into its own stand
(`footsteps`). The solver, the repair and the certificate see tails and clip as one motion. Metres,
seconds, world frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field
from scipy.spatial.transform import Rotation, Slerp

from robojackson.config import config_dataclass
from robojackson.geometry.blends import minimum_jerk
from robojackson.motion.smpl_sequence import AIR, PLANTED
from robojackson.retarget.targets.footsteps import (
    SIDES,
    about_up,
    feet_of,
    stand_over,
    steps_into_stand,
    yaw_of,
)
from robojackson.retarget.targets.keypoint_targets import Targets, select_steps
from robojackson.robot.model import Robot

SETTLE_S = 0.3
"""From the way into the stand until nothing moves."""
KNEE_SHARE = 0.2
"""Of its weight that a knee's target keeps where the stand is as wide as the clip left it."""
LANDING_SHARE = 0.3
"""Of the blend in which a foot in the air is put down."""
CARRIED_M_S = 0.6
"""Speed over the floor that a body keeps at most on its way into the stand: it has to come back."""


@config_dataclass
class TailConfig:
    """Whether and how long a motion that does not repeat begins and ends standing.

    Attributes:
        use: `auto`: on robots that are evaluated beside the reference (`fall.frame: reference`).
        lead_s: Stand before the clip, seconds.
        blend_s: Blend from the stand into the clip, and back, seconds.
        stand_s: Stand after the clip, seconds.
        steps: Whether steps lead from feet on which no robot stands well into the robot's stand.
    """

    use: Literal["auto", "yes", "no"] = "auto"
    lead_s: float = Field(default=0.4, ge=0)
    blend_s: float = Field(default=1.0, gt=0)
    stand_s: float = Field(default=3.0, ge=0)
    steps: bool = True

    def applies_to(self, robot: Robot) -> bool:
        """Return whether a robot's motions get tails."""
        by_reference = robot.description.fall.frame == "reference"
        return self.use == "yes" or (self.use == "auto" and by_reference)


@dataclass(frozen=True)
class Tailed:
    """Targets with tails.

    Attributes:
        aims: Stand, clip, stand.
        clip: Which of its steps are the clip's.
        lead, stand: Steps of the stand before it and after it.
    """

    aims: Targets
    clip: slice
    lead: int = 0
    stand: int = 0

    def source_time(self, time_s: Float[np.ndarray, " N"]) -> Float[np.ndarray, " S"]:
        """Return the time in the clip of every step; tails show its first and its last moment."""
        after = len(self.aims) - self.clip.stop
        return np.pad(time_s, (self.clip.start, after), mode="edge")


def with_tails(aims: Targets, robot: Robot, config: TailConfig) -> Tailed:
    """Put a stand before and after the targets of a clip; a cycle has no ends and gets none."""
    if aims.cycle_offset is not None or not config.applies_to(robot):
        return Tailed(aims, slice(0, len(aims)))
    before = _tail(_reversed(aims), robot, config, config.lead_s)
    after = _tail(aims, robot, config, config.stand_s)
    parts = (_reversed(before), aims, after)
    first, whole = len(before), _joined(parts)
    clip, danced = slice(first, first + len(aims)), np.zeros(len(whole), bool)
    danced[clip] = True
    lead, stand = (round(seconds / aims.dt) for seconds in (config.lead_s, config.stand_s))
    return Tailed(replace(whole, danced=danced), clip, lead, stand)


def settled(
    qpos: Float[np.ndarray, "S nq"], stands: Sequence[slice], dt: float
) -> Float[np.ndarray, "S nq"]:
    """Return a motion whose stands are still: the solver lets untargeted hinges drift slowly.

    Every stand becomes its middle pose, over `SETTLE_S` from the side of the clip.

    Args:
        stands: The first and the last stand, empty slices where there is none.
        dt: Seconds a step.
    """
    found = qpos.copy()
    for stand in stands:
        count = stand.stop - stand.start
        if count < 2:
            continue
        held = qpos[stand.start + count // 2]
        time = np.arange(count) * dt
        time = time[::-1] if stand.start == 0 else time
        share = np.clip(time / SETTLE_S, 0.0, 1.0)
        way = minimum_jerk(share)[:, None]
        same = np.sign(np.sum(qpos[stand, 3:7] * held[3:7], -1, keepdims=True))
        target = np.repeat(held[None], count, 0)
        target[:, 3:7] *= same
        mixed = (1 - way) * qpos[stand] + way * target
        mixed[:, 3:7] /= np.linalg.norm(mixed[:, 3:7], axis=-1, keepdims=True)
        found[stand] = mixed
    return found


def _tail(aims: Targets, robot: Robot, config: TailConfig, stand_s: float) -> Targets:
    """Return what follows the last step: the way into the stand, and the stand."""
    steps = max(2, round(config.blend_s / aims.dt))
    held = round(stand_s / aims.dt)
    last, before = aims.keypoints_w[-1], aims.keypoints_w[-2]
    yaw = yaw_of(aims.heading[-1][:, 0])
    found_feet = feet_of(last, yaw, robot)
    stand = stand_over(found_feet, yaw, robot)
    feet = _columns_of_feet(robot)
    speed = (last - before) / aims.dt
    speed *= min(1.0, CARRIED_M_S / max(float(np.linalg.norm(_pelvis(speed, robot)[:2])), 1e-9))
    speed[feet] = 0.0
    time = np.arange(1, steps + 1) / steps
    way = _polynomial(last, speed * config.blend_s, stand, time)
    landing = np.minimum(time / LANDING_SHARE, 1.0)
    way[:, feet] = _polynomial(last[feet], 0 * last[feet], stand[feet], landing)
    walk = steps_into_stand(found_feet, yaw, robot, aims.dt) if config.steps else None
    between = walk.keypoints_w if walk else way[:0]
    stand = stand_over(walk.feet, yaw, robot) if walk else stand
    keypoints = np.concatenate([way, between, np.repeat(stand[None], held, 0)])
    contact = np.full((len(keypoints), aims.contact.shape[1]), PLANTED, aims.contact.dtype)
    lands = int(np.searchsorted(landing, 1.0))
    contact[:lands, aims.contact[-1] == AIR] = AIR
    if walk:
        sides = [SIDES.index(point.side) for point in robot.description.contacts.values()]
        contact[steps : steps + len(between)][walk.in_air[:, sides]] = AIR
    weights = np.repeat(robot.keypoint_weights[None], len(keypoints), 0)
    weights[:, [robot.keypoint_names.index(f"{side}_knee") for side in ("left", "right")]] *= (
        KNEE_SHARE
    )
    return replace(
        aims,
        keypoints_w=keypoints,
        weights=weights,
        contact=contact,
        heading=_headings(aims.heading[-1], steps, len(keypoints) - steps),
        airborne=np.zeros(len(keypoints), bool),
    )


def _pelvis(points: Float[np.ndarray, "K 3"], robot: Robot) -> Float[np.ndarray, "3"]:
    return np.asarray(points[robot.keypoint_names.index("pelvis")])


def _columns_of_feet(robot: Robot) -> Int[np.ndarray, " F"]:
    """Return the keypoints of the feet, toes included."""
    names = robot.keypoint_names
    return np.array([i for i, name in enumerate(names) if name.endswith(("_foot", "_toe"))])


def _polynomial(
    start: Float[np.ndarray, "K 3"],
    speed: Float[np.ndarray, "K 3"],
    end: Float[np.ndarray, "K 3"],
    time: Float[np.ndarray, " T"],
) -> Float[np.ndarray, "T K 3"]:
    """Return a path from a place and a speed (per unit of time) to rest, without acceleration at
    both ends."""
    t = time[:, None, None]
    way = minimum_jerk(t)
    swing = t - t**3 * (6 - 8 * t + 3 * t**2)
    return np.asarray(start + way * (end - start) + swing * speed)


def _headings(
    heading: Float[np.ndarray, "3 3"], steps: int, held: int
) -> Float[np.ndarray, "S 3 3"]:
    upright = about_up(yaw_of(heading[:, 0]))
    turns = Rotation.from_matrix(np.stack([heading, upright]))
    way = Slerp([0.0, 1.0], turns)(np.arange(1, steps + 1) / steps).as_matrix()
    return np.concatenate([way, np.repeat(upright[None], held, 0)])


def _reversed(aims: Targets) -> Targets:
    """Return the same backwards in time."""
    return select_steps(aims, slice(None, None, -1))


def _joined(parts: tuple[Targets, ...]) -> Targets:
    return replace(
        parts[0],
        keypoints_w=np.concatenate([part.keypoints_w for part in parts]),
        weights=np.concatenate([part.weights for part in parts]),
        contact=np.concatenate([part.contact for part in parts]),
        heading=np.concatenate([part.heading for part in parts]),
        airborne=np.concatenate([part.airborne for part in parts]),
    )
