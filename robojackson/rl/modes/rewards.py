"""Reward terms of the tracking environment: pure functions of a state and its reference.

Each term is `weight * exp(-(error / width)^2)` (DeepMimic, Peng et al. 2018, eq. 3), so the reward
is greatest when the state equals the reference. Errors are in metres, radians and seconds; the
sites are compared relative to the pelvis, so that drifting over the floor costs only the drift
term.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from robojackson.errors import BadConfiguration
from robojackson.geometry.rotations import quat_angle
from robojackson.rl.config.train_config import RewardConfig, TerminationConfig
from robojackson.rl.sim.reference_clip import ClipStep
from robojackson.robot.names import FEET, HANDS, PELVIS
from robojackson.robot.tree_kinematics import Tree, pose

RewardFunction = Callable[["RewardState"], Float[np.ndarray, " N"]]
"""A reward term of a user: one number a robot."""
BELLS = RewardConfig.terms()
"""Terms of the reward for small errors: each has the same name in `TrackingErrors`."""
SOLES = (*FEET, "left_toe", "right_toe")
EXTREMITIES = (*HANDS, "head")


@dataclass(frozen=True)
class TrackedPoints:
    """Indices of special points, bound by name.

    Attributes:
        pelvis: Reference point of the others.
        hands: Hands and head.
        limbs: Feet, hands and head: the limb ends.
        feet: Feet, and toes where the robot has them.
        tree: Tree of the bodies whose orientations are compared; none are without it.
    """

    pelvis: int
    hands: tuple[int, ...]
    limbs: tuple[int, ...]
    feet: tuple[int, ...] = ()
    tree: Tree | None = None


def tracked_points(names: tuple[str, ...], tree: Tree | None = None) -> TrackedPoints:
    """Return the special points of a robot's keypoints."""
    return TrackedPoints(
        pelvis=names.index(PELVIS),
        hands=tuple(names.index(name) for name in EXTREMITIES),
        limbs=tuple(names.index(name) for name in (*FEET, *EXTREMITIES)),
        feet=tuple(names.index(name) for name in SOLES if name in names),
        tree=tree,
    )


@dataclass(frozen=True)
class TrackingErrors:
    """Errors of N robots relative to their references.

    Attributes:
        joints: Root mean square over hinges, rad.
        joint_speed: Root mean square over hinges, rad/s.
        sites: Root mean square over sites relative to the pelvis, m.
        hands: The same over hands and head, m.
        feet: Root mean square over feet and toes, over the floor relative to the pelvis, in
            height as they are, m.
        bodies: Root mean square over bodies of the error of their orientation, rad; 0 without
            a tree.
        site_mean: Mean distance of the sites relative to the pelvis, m.
        orientation: Error of the root's orientation, rad.
        velocity: Error of the root's velocity, m/s.
        limb_speed: Root mean square over the limb ends' velocity differences, m/s.
        height: Error of the root's height, signed, m.
        drift: Error of the root's place over the floor, m.
    """

    joints: Float[np.ndarray, " N"]
    joint_speed: Float[np.ndarray, " N"]
    sites: Float[np.ndarray, " N"]
    hands: Float[np.ndarray, " N"]
    feet: Float[np.ndarray, " N"]
    bodies: Float[np.ndarray, " N"]
    site_mean: Float[np.ndarray, " N"]
    orientation: Float[np.ndarray, " N"]
    velocity: Float[np.ndarray, " N"]
    limb_speed: Float[np.ndarray, " N"]
    height: Float[np.ndarray, " N"]
    drift: Float[np.ndarray, " N"]


def tracking_errors(
    qpos: Float[np.ndarray, "N nq"],
    qvel: Float[np.ndarray, "N nv"],
    points: Float[np.ndarray, "N K 3"],
    moved: Float[np.ndarray, "N K 3"],
    target: ClipStep,
    which: TrackedPoints,
) -> TrackingErrors:
    """Return the errors of states; `moved` is the velocity of the points, m/s."""
    relative = points - points[:, which.pelvis, None]
    aim = target.points - target.points[:, which.pelvis, None]
    squared = _squares(relative - aim)
    hurry = _squares((moved - target.moved).take(which.limbs, 1))
    lifted = (relative - aim).take(which.feet, 1)
    lifted[..., 2] = (points - target.points).take(which.feet, 1)[..., 2]
    place, speed = qpos - target.qpos, qvel - target.qvel
    return TrackingErrors(
        joints=np.sqrt(_mean(place[:, 7:] ** 2)),
        joint_speed=np.sqrt(_mean(speed[:, 6:] ** 2)),
        sites=np.sqrt(_mean(squared)),
        hands=np.sqrt(_mean(squared.take(which.hands, 1))),
        feet=np.sqrt(_mean(_squares(lifted))) if which.feet else np.zeros(len(qpos)),
        bodies=turn_error(which.tree, qpos, target.qpos) if which.tree else np.zeros(len(qpos)),
        site_mean=_mean(np.sqrt(squared)),
        orientation=quat_angle(qpos[:, 3:7], target.qpos[:, 3:7]),
        velocity=np.sqrt(_squares(speed[:, :3])),
        limb_speed=np.sqrt(_mean(hurry)),
        height=place[:, 2],
        drift=np.sqrt(_squares(place[:, :2])),
    )


def turn_error(
    tree: Tree, qpos: Float[np.ndarray, "N nq"], aim: Float[np.ndarray, "N nq"]
) -> Float[np.ndarray, " N"]:
    """Return the root mean square, over the bodies that hinges move, of the angle between the
    orientations of two poses in the world, rad (whole_body_tracking's `body_ori`, Liao et al.,
    2025, without its turn of the reference about the vertical)."""
    moved = [body for body, hinges in enumerate(tree.body_hinges) if hinges]
    own, other = np.split(pose(tree, np.concatenate([qpos, aim])).body_rot[:, moved], 2)
    cosine = (np.add.reduce(own * other, (-2, -1)) - 1) / 2
    return np.asarray(np.sqrt(_mean(np.arccos(np.clip(cosine, -1.0, 1.0)) ** 2)))


@dataclass(frozen=True)
class RewardState:
    """Input of a user's reward term: N robots after a control step. World frame; read-only.

    Attributes:
        qpos: MuJoCo positions; root at 0:3 (m), its quaternion wxyz at 3:7, hinges (rad).
        qvel: MuJoCo velocities; root linear (m/s) at 0:3, angular (rad/s) at 3:6, hinges (rad/s).
        points: Keypoint sites, m, in the order of `Robot.keypoint_names`.
        moved: Velocities of the points, m/s.
        target: The reference at the same step.
        errors: Errors of each robot.
        action_change: Mean squared change of the action, -1..1.
    """

    qpos: Float[np.ndarray, "N nq"]
    qvel: Float[np.ndarray, "N nv"]
    points: Float[np.ndarray, "N K 3"]
    moved: Float[np.ndarray, "N K 3"]
    target: ClipStep
    errors: TrackingErrors
    action_change: Float[np.ndarray, " N"]


def require_names_of_their_own(functions: Mapping[str, RewardFunction]) -> None:
    """Raise for a user's term that would replace a configured one.

    Raises:
        BadConfiguration: its name is taken, or it is no function.
    """
    taken = {*RewardConfig.terms(), "action_rate", "curiosity"}
    for name, function in functions.items():
        if name in taken:
            raise BadConfiguration(
                f"reward {name!r} is the name of a configured term, beside which yours is paid: "
                "give it another"
            )
        if not callable(function):
            raise BadConfiguration(f"reward {name!r} is {function!r}; expected a function")


def own_terms(
    functions: Mapping[str, RewardFunction], state: RewardState
) -> dict[str, Float[np.ndarray, " N"]]:
    """Return the reward terms of a user's functions, by their names.

    Raises:
        BadConfiguration: a function returns anything but one finite number a robot.
    """
    count = len(state.qpos)
    terms = {}
    for name, function in functions.items():
        value = np.asarray(function(state), float)
        if value.shape != (count,) or not np.isfinite(value).all():
            raise BadConfiguration(
                f"reward {name!r} returned {value.dtype} of shape {value.shape}"
                f"{'' if np.isfinite(value).all() else ' with NaN or infinity'}; "
                f"expected one finite number for each of {count} robots"
            )
        terms[name] = value
    return terms


def reward_terms(
    errors: TrackingErrors, action_change: Float[np.ndarray, " N"], config: RewardConfig
) -> dict[str, Float[np.ndarray, " N"]]:
    """Return named terms whose sum is the reward; `action_change` is the mean squared change."""
    error = np.array([getattr(errors, name) for name in BELLS])
    width = np.array([[getattr(config, f"{name}_width")] for name in BELLS])
    weight = np.array([[getattr(config, name)] for name in BELLS])
    square, fine = (error / width) ** 2, config.fine
    bells = (1 - fine) * np.exp(-square) + fine * np.exp(-square / config.narrow**2)
    terms = dict(zip(BELLS, weight * bells, strict=True))
    return terms | {"action_rate": -config.action_rate * action_change}


def _squares(vectors: Float[np.ndarray, "*B D"]) -> Float[np.ndarray, "*B"]:
    """Return squared lengths. Here and below `np.add.reduce`: `np.sum` and `np.mean` cost several
    times as much for the few numbers of a control step."""
    return np.asarray(np.add.reduce(vectors**2, -1))


def _mean(values: Float[np.ndarray, "*B K"]) -> Float[np.ndarray, "*B"]:
    """Return the mean over the last axis."""
    return np.asarray(np.add.reduce(values, -1) / values.shape[-1])


def is_off_track(errors: TrackingErrors, config: TerminationConfig) -> Bool[np.ndarray, " N"]:
    """Return whether robots are too far from the reference to learn from; it ends a training
    episode."""
    result: np.ndarray = (
        (errors.orientation > config.orientation)
        | (np.abs(errors.height) > config.height)
        | (errors.site_mean > config.sites)
        | (errors.drift > config.drift)
    )
    return result
