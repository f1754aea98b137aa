"""Steps from the feet that a clip leaves into the robot's own stand.

A clip may end with crossed, staggered or far spread feet, on which no robot stands for long. Each
foot that is away from its place in the stand is lifted once, the foot in front first: the body
shifts over the other foot, the foot swings along a minimum-jerk path (Flash & Hogan, 1985) with a
raised middle, and the body shifts back. Metres, seconds, radians, world frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from robojackson.geometry.blends import minimum_jerk
from robojackson.geometry.rotations import wrapped
from robojackson.robot.model import Robot

SIDES = ("left", "right")
SHIFT_S, SWING_S = 0.4, 0.5
CLEARANCE_M = 0.05
"""Height of a swinging foot in the middle of its way."""
NARROWEST, WIDEST, STAGGERED = 0.5, 2.5, 1.5
"""Distance of the feet across (least, largest) and along the heading, in widths of the stand."""
TURNED_RAD = 0.8
"""Between the heading and a foot, from which that foot is to be placed again."""
SAME_M, SAME_RAD = 0.03, 0.2
"""A foot so close to its place stays."""


@dataclass(frozen=True)
class Placement:
    """One foot on the floor.

    Attributes:
        place: Place of the ankle over the floor, m.
        yaw: How far the foot is turned from its rest pose along x about the vertical, rad.
    """

    place: Float[np.ndarray, "2"]
    yaw: float

    def near(self, other: "Placement", share: float = 1.0) -> bool:
        """Return whether a foot may stay where it is, by a share of `SAME_M` and `SAME_RAD`."""
        apart = float(np.linalg.norm(self.place - other.place))
        return apart < share * SAME_M and abs(_turn(self.yaw, other.yaw)) < share * SAME_RAD


Feet = Mapping[str, Placement]
"""The placement of each side's foot."""


@dataclass(frozen=True)
class Walk:
    """Steps into the stand.

    Attributes:
        keypoints_w: Targets of the keypoints, m.
        in_air: Whether the left, the right foot swings.
        feet: Places of the feet at the end.
    """

    keypoints_w: Float[np.ndarray, "N K 3"]
    in_air: Bool[np.ndarray, "N 2"]
    feet: Feet


def feet_of(points: Float[np.ndarray, "K 3"], heading: float, robot: Robot) -> Feet:
    """Return where a pose has its feet; a robot without toes has them along the heading (rad)."""
    names = robot.keypoint_names
    found = {}
    for side in SIDES:
        ankle, toe, yaw = names.index(f"{side}_foot"), f"{side}_toe", heading
        if toe in names:  # which may point in or out where the foot is not turned
            own = yaw_of(robot.toe_arms[toe])
            yaw = yaw_of(points[names.index(toe)] - points[ankle]) - own
        found[side] = Placement(points[ankle, :2], yaw)
    return found


def stand_over(feet: Feet, heading: float, robot: Robot) -> Float[np.ndarray, "K 3"]:
    """Return the keypoints of the robot's stand between the feet, soles on the floor."""
    found = own_stand(robot) @ about_up(heading).T
    found[:, :2] += np.mean([feet[side].place for side in SIDES], 0)
    place_feet(found, feet, robot)
    return np.asarray(found)


def own_stand(robot: Robot) -> Float[np.ndarray, "K 3"]:
    """Return the keypoints of the robot's stand along +x, the middle of its ankles over the
    origin."""
    names = robot.keypoint_names
    data = mujoco.MjData(robot.model)
    data.qpos[:] = robot.standing
    mujoco.mj_kinematics(robot.model, data)
    own: np.ndarray = data.site_xpos[robot.keypoint_sites].copy()
    soles = own[robot.contact_keypoints, 2] + robot.contact_arms[:, 2] - robot.contact_radii
    own[:, 2] -= soles.min()
    own[:, :2] -= own[[names.index(f"{side}_foot") for side in SIDES], :2].mean(0)
    return own


def place_feet(points: Float[np.ndarray, "K 3"], feet: Feet, robot: Robot) -> None:
    """Put ankles and toes of a pose where the feet are, at the height that the pose has them."""
    names = robot.keypoint_names
    for side, foot in feet.items():
        ankle = names.index(f"{side}_foot")
        points[ankle, :2] = foot.place
        if (toe := f"{side}_toe") in names:
            points[names.index(toe)] = points[ankle] + about_up(foot.yaw) @ robot.toe_arms[toe]


def stand_feet(feet: Feet, heading: float, robot: Robot) -> Feet:
    """Return where the robot's stand has its feet, around the middle of those given."""
    middle = np.mean([feet[side].place for side in SIDES], 0)
    own, names = own_stand(robot) @ about_up(heading).T, robot.keypoint_names
    return {
        side: Placement(middle + own[names.index(f"{side}_foot"), :2], heading) for side in SIDES
    }


def stands_badly(feet: Feet, heading: float, robot: Robot) -> bool:
    """Return whether the feet are crossed, close, far apart, staggered or turned away."""
    goal = stand_feet(feet, heading, robot)
    width = float(np.linalg.norm(goal["left"].place - goal["right"].place))
    apart = about_up(heading)[:2, :2].T @ (feet["left"].place - feet["right"].place)
    turned = max(abs(_turn(heading, foot.yaw)) for foot in feet.values())
    across = float(apart[1]) / width
    staggered = abs(float(apart[0])) > STAGGERED * width
    return not NARROWEST <= across <= WIDEST or staggered or turned > TURNED_RAD


def steps_into_stand(feet: Feet, heading: float, robot: Robot, dt: float) -> Walk | None:
    """Return the steps that bring the feet into the robot's stand; None where they stand well.

    Args:
        feet: Where the feet are, both on the floor, the body between them.
        heading: Heading of the stand, rad.
        dt: Seconds a step of the motion.
    """
    if not stands_badly(feet, heading, robot):
        return None
    return steps_between(feet, stand_feet(feet, heading, robot), heading, robot, dt)


def steps_between(
    feet: Feet, goal: Feet, heading: float, robot: Robot, dt: float, share: float = 1.0
) -> Walk:
    """Return the steps that bring the feet from one placement to another, the body upright; a foot
    that is near its goal (`Placement.near`, `share`) stays."""
    ahead = about_up(heading)[:2, 0]
    order = sorted(SIDES, key=lambda side: -float(feet[side].place @ ahead))
    now, body, parts, air = dict(feet), _middle(feet), [], []
    for side in (side for side in order if not feet[side].near(goal[side], share)):
        other = now[SIDES[1 - SIDES.index(side)]]
        parts.append(_shifted(now, body, other.place, heading, robot, dt))
        body, step = other.place, now | {side: goal[side]}
        parts.append(_swung(now, step, side, body, heading, robot, dt))
        air += [np.zeros((len(parts[-2]), 2), bool), np.zeros((len(parts[-1]), 2), bool)]
        air[-1][:, SIDES.index(side)] = True
        now = step
    parts.append(_shifted(now, body, _middle(now), heading, robot, dt))
    air.append(np.zeros((len(parts[-1]), 2), bool))
    return Walk(np.concatenate(parts), np.concatenate(air), now)


def _middle(feet: Feet) -> Float[np.ndarray, "2"]:
    return np.asarray(np.mean([feet[side].place for side in SIDES], 0))


def _shifted(
    feet: Feet,
    start: Float[np.ndarray, "2"],
    end: Float[np.ndarray, "2"],
    heading: float,
    robot: Robot,
    dt: float,
) -> Float[np.ndarray, "N K 3"]:
    """Return steps in which the body moves from one place to another and the feet stay."""
    stand = stand_over(feet, heading, robot)
    found = []
    for share in _smooth(SHIFT_S, dt):
        points = stand.copy()
        points[:, :2] += start + share * (end - start) - _middle(feet)
        place_feet(points, feet, robot)
        found.append(points)
    return np.array(found)


def _swung(
    before: Feet,
    after: Feet,
    side: str,
    body: Float[np.ndarray, "2"],
    heading: float,
    robot: Robot,
    dt: float,
) -> Float[np.ndarray, "N K 3"]:
    """Return steps in which one foot swings to its new place and the body stays over the other."""
    names, start, end = robot.keypoint_names, before[side], after[side]
    ankle = names.index(f"{side}_foot")
    turn = _turn(start.yaw, end.yaw)
    found = []
    for share in _smooth(SWING_S, dt):
        way = Placement(start.place + share * (end.place - start.place), start.yaw + share * turn)
        now = dict(before) | {side: way}
        points = stand_over(now, heading, robot)
        points[:, :2] += body - _middle(now)
        points[ankle, 2] += CLEARANCE_M * (4 * share * (1 - share)) ** 2
        place_feet(points, now, robot)
        found.append(points)
    return np.array(found)


def _smooth(seconds: float, dt: float) -> Float[np.ndarray, " N"]:
    """Return the shares of a way from rest to rest, without its beginning: fifth-order
    polynomial."""
    t = np.arange(1, max(2, round(seconds / dt)) + 1) / max(2, round(seconds / dt))
    return minimum_jerk(t)


def _turn(start: float, end: float) -> float:
    """Return the shorter turn from one yaw to another, rad."""
    return float(wrapped(np.asarray(end - start)))


def yaw_of(ahead: Float[np.ndarray, "3"]) -> float:
    """Return the heading of a direction, rad."""
    return float(np.arctan2(ahead[1], ahead[0]))


def about_up(yaw: float) -> Float[np.ndarray, "3 3"]:
    """Return the rotation matrix about the vertical."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
