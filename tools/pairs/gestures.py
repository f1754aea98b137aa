"""Invented dancing: poses inside joint limits, blended to a beat; feet step, lift and stand.

Frame: DeepMimic's, x forward, y up, z right; metres of its humanoid, radians. A limb's rotation
takes it from hanging down, its hinge to the right.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from tools.render import deepmimic

HALF_HIPS = 0.085
ANKLE_HEIGHT = 0.08
THIGH, SHIN = deepmimic.THIGH_LENGTH, deepmimic.SHIN_LENGTH
REACH = 0.985 * (THIGH + SHIN)
UP, DOWN, FORWARD = np.array([0.0, 1.0, 0.0]), np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0])
HINGE = np.array([0.0, 0.0, 1.0])
SIDES = {"left": -1.0, "right": 1.0}
"""Sign of z."""
UPPER = ("chest", "neck", "left_shoulder", "left_elbow", "right_shoulder", "right_elbow")


def invent(rng: np.random.Generator, count: int, fps: float) -> deepmimic.Motion:
    """Return a dance of `count` frames."""
    beat = rng.uniform(0.3, 1.1)
    root = _turns(rng, count, fps, beat, heading=True)
    feet, hips, air = _steps(rng, count, fps, beat * rng.choice([1.0, 2.0]))
    pelvis = _pelvis(root, feet, hips, rng)
    rotations = {"root": root} | _upper(rng, count, fps, beat, root)
    position = np.array(pelvis)
    for side, sign in SIDES.items():
        hip = position + root.apply([0.0, 0.0, sign * HALF_HIPS])
        rotations |= _leg(root, hip, feet[side], air[side], side, rng)
    return deepmimic.Motion(fps, position, rotations)


def with_gestures(motion: deepmimic.Motion, rng: np.random.Generator) -> deepmimic.Motion:
    """Return the motion with an invented upper body."""
    upper = _upper(rng, len(motion), motion.fps, rng.uniform(0.3, 1.1), motion.rotations["root"])
    return replace(motion, rotations={**motion.rotations, **upper})


def _keys(
    rng: np.random.Generator, count: int, fps: float, beat: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the position of each frame between keys (whole numbers are keys), eased and held."""
    lengths = beat * rng.choice([0.5, 1.0, 1.0, 2.0], size=int(count / fps / beat * 2) + 6)
    times = np.concatenate([[-lengths[0] * rng.uniform()], np.cumsum(lengths)])
    place = np.interp(np.arange(count) / fps, times, np.arange(len(times)))
    whole, part = np.floor(place), place % 1.0
    moving = rng.uniform(0.35, 1.0, len(times))[whole.astype(int)]
    s = np.clip(part / moving, 0.0, 1.0)
    return whole + s * s * (3.0 - 2.0 * s), np.arange(len(times) + 1)


def _curve(rng: np.random.Generator, keys: np.ndarray, place: np.ndarray) -> np.ndarray:
    low = np.floor(place).astype(int)
    part = (place - low)[:, None]
    return keys[low] * (1.0 - part) + keys[np.minimum(low + 1, len(keys) - 1)] * part


def _turns(
    rng: np.random.Generator, count: int, fps: float, beat: float, heading: bool
) -> Rotation:
    """Return the rotation of a part of the trunk: yaw, pitch forward, roll."""
    place, keys = _keys(rng, count, fps, beat)
    wild = rng.uniform() < 0.35
    spread = np.radians([14.0, 9.0, 8.0]) * rng.uniform(0.3, 1.6, 3) * (1.7 if wild else 1.0)
    angles = rng.normal(0.0, 1.0, (len(keys), 3)) * spread
    angles[:, 1] += np.radians(rng.choice([0.0, 5.0, 10.0, 30.0], p=[0.35, 0.35, 0.2, 0.1]))
    if wild:
        deep = rng.uniform(size=len(keys)) < 0.25
        angles[:, 1] += deep * np.radians(rng.uniform(15.0, 60.0, len(keys)))
    if heading:
        turn = rng.choice([0.0, 15.0, 60.0, 180.0], p=[0.4, 0.3, 0.2, 0.1])
        angles[:, 0] += np.cumsum(np.radians(turn) * rng.normal(0.0, 0.7, len(keys)))
    curve = _curve(rng, angles, place)
    time = np.arange(count) / fps
    if heading and rng.uniform() < 0.35:
        curve[:, 0] += _spin(rng, time)
    for axis in range(3):
        swing = np.radians(6.0) * rng.uniform(0.0, 1.0)
        curve[:, axis] += swing * np.sin(2 * np.pi * time / beat + rng.uniform(0.0, 6.3))
    return Rotation.from_euler("YZX", curve * [1.0, -1.0, 1.0])


def _spin(rng: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """Return half a turn to three turns at 120 to 450 degrees a second, radians."""
    angle = np.pi * rng.uniform(1.0, 6.0) * rng.choice([-1.0, 1.0])
    length = np.abs(angle) / np.radians(rng.uniform(120.0, 450.0))
    s = np.clip((time - rng.uniform(-0.5, time[-1])) / length, 0.0, 1.0)
    return np.asarray(angle * s * s * (3.0 - 2.0 * s))


def _upper(
    rng: np.random.Generator, count: int, fps: float, beat: float, root: Rotation
) -> dict[str, Rotation]:
    chest = root * _turns(rng, count, fps, beat, heading=False)
    rotations = {"chest": chest, "neck": chest * _turns(rng, count, fps, beat, heading=False)}
    place, keys = _keys(rng, count, fps, beat)
    style = rng.dirichlet(np.ones(5))
    left = _arm_keys(rng, len(keys) + 1, style)
    twin = rng.uniform() < 0.3
    for side in SIDES:
        if side == "right":
            shift = int(rng.integers(0, 2))
            if twin:
                arms = (_across(left[0]), np.roll(left[1], shift))
            else:
                place = _keys(rng, count, fps, beat)[0] if rng.uniform() < 0.6 else place
                made = _arm_keys(rng, len(keys) + 1, style)
                arms = (_across(made[0]), made[1])
        else:
            arms = left
        place = np.clip(place, 0.0, len(arms[1]) - 1.0)
        shoulder = chest * Slerp(np.arange(len(arms[1])), arms[0])(place)
        bend = _curve(rng, arms[1][:, None], place)
        rotations[f"{side}_shoulder"] = shoulder
        rotations[f"{side}_elbow"] = shoulder * Rotation.from_rotvec(bend * HINGE)
    return rotations


def _across(rotation: Rotation) -> Rotation:
    return Rotation.from_rotvec(rotation.as_rotvec() * [-1.0, -1.0, 1.0])


def _arm_keys(
    rng: np.random.Generator, count: int, style: np.ndarray
) -> tuple[Rotation, np.ndarray]:
    """Return left shoulder in the chest's frame, and the bend of the elbow."""
    middles = np.array([[0.1, -1, -0.2], [0.1, 0, -1], [0.2, 1, -0.4], [1, 0, -0.1], [0.4, 0, -1]])
    chosen = rng.choice(len(middles), count, p=style)
    spread = np.array([0.3, 0.4, 0.4, 0.4, 0.9])[chosen, None]
    upper = middles[chosen] + rng.normal(0.0, 1.0, (count, 3)) * spread
    upper[:, 0] = np.maximum(upper[:, 0], -0.45 * np.abs(upper[:, 1:]).max(1))
    upper[:, 2] = np.minimum(upper[:, 2], 0.5 * np.abs(upper[:, :2]).max(1))
    upper /= np.linalg.norm(upper, axis=1, keepdims=True)
    roll = rng.normal(np.radians(-15.0), np.radians(45.0), count)
    axis = np.cross(DOWN, upper)
    angle = np.arctan2(np.linalg.norm(axis, axis=1), upper @ DOWN)
    axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-9)
    swing = Rotation.from_rotvec(axis * angle[:, None])
    straight = rng.uniform(size=count) < 0.35
    bend = np.where(straight, rng.uniform(0, 30, count), rng.uniform(15, 140, count))
    return swing * Rotation.from_rotvec(roll[:, None] * UP), np.radians(bend)


def _steps(
    rng: np.random.Generator, count: int, fps: float, beat: float
) -> tuple[dict[str, np.ndarray], np.ndarray, dict[str, np.ndarray]]:
    """Return the ankles, the middle of the pelvis over the floor with its drop, and the share in
    the air."""
    place, keys = _keys(rng, count, fps, beat)
    half = rng.uniform(0.07, 0.3)
    wild = rng.choice([0.05, 0.25, 0.5], p=[0.4, 0.4, 0.2])
    lively = rng.choice([0.0, 0.3, 0.7], p=[0.3, 0.45, 0.25])
    ankles = np.zeros((len(keys), 2, 3))
    now = np.array([[0.0, ANKLE_HEIGHT, -half], [0.0, ANKLE_HEIGHT, half]])
    middle = np.zeros((len(keys), 3))
    for k in range(len(keys)):
        now[:, 1] = ANKLE_HEIGHT
        foot = int(rng.integers(0, 2))
        weight = rng.uniform(0.3, 0.7)
        if rng.uniform() < lively:
            other = now[1 - foot]
            sideways = (2 * foot - 1) * half * 2 * rng.uniform(0.4, 1.3)
            now[foot] = other + [rng.normal(0, wild), 0.0, sideways + rng.normal(0, 0.3 * wild)]
            if rng.uniform() < 0.35:
                now[foot, 1] += rng.uniform(0.05, 0.75)
                now[foot, 0] += rng.normal(0.1, 0.3)
                weight = float(foot == 0)
        ankles[k] = now
        middle[k] = weight * now[1] + (1.0 - weight) * now[0]
        deep = rng.uniform() < 0.12
        middle[k, 1] = rng.uniform(0.1, 0.4) if deep else rng.exponential(0.035)
    paths = {side: _curve(rng, ankles[:, i], place) for i, side in enumerate(SIDES)}
    speed = {s: np.linalg.norm(np.gradient(p, axis=0)[:, [0, 2]], axis=1) for s, p in paths.items()}
    for side, path in paths.items():
        path[:, 1] += np.minimum(2.0 * speed[side], 0.15)
    air = {s: np.clip((p[:, 1] - ANKLE_HEIGHT - 0.03) / 0.1, 0.0, 1.0) for s, p in paths.items()}
    return paths, _curve(rng, middle, place), air


def _pelvis(
    root: Rotation, feet: dict[str, np.ndarray], hips: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Return the pelvis as high as the lower foot allows, less the drop; feet turn with the
    heading."""
    forward = root.apply(FORWARD)
    heading = Rotation.from_rotvec(np.arctan2(-forward[:, 2], forward[:, 0])[:, None] * UP)
    position = np.array(hips)
    top = np.full(len(hips), np.inf)
    for side, sign in SIDES.items():
        grounded = feet[side][:, 1] < ANKLE_HEIGHT + 0.1
        across = feet[side] - hips - [0.0, 0.0, sign * HALF_HIPS]
        flat = np.linalg.norm(across[:, [0, 2]], axis=1)
        height = feet[side][:, 1] + np.sqrt(np.maximum(REACH**2 - flat**2, 0.25))
        top = np.minimum(top, np.where(grounded, height, REACH + ANKLE_HEIGHT))
    position[:, 1] = np.maximum(top - hips[:, 1], 0.35)
    for side in SIDES:
        feet[side][:] = heading.apply(feet[side])
    return heading.apply(position)


def _leg(
    root: Rotation, hip: np.ndarray, ankle: np.ndarray, air: np.ndarray, side: str,
    rng: np.random.Generator,
) -> dict[str, Rotation]:  # fmt: skip
    out = SIDES[side] * np.radians(rng.uniform(0.0, 35.0))
    turned = root * Rotation.from_rotvec(-out * UP)
    along = ankle - hip
    reach = np.clip(np.linalg.norm(along, axis=1), 0.25, REACH)
    down = along / np.maximum(np.linalg.norm(along, axis=1), 1e-6)[:, None]
    right = turned.apply(HINGE)
    right -= (right * down).sum(1, keepdims=True) * down
    right /= np.maximum(np.linalg.norm(right, axis=1, keepdims=True), 1e-6)
    swing = np.arccos(np.clip((THIGH**2 + reach**2 - SHIN**2) / (2 * THIGH * reach), -1, 1))
    bend = np.pi - np.arccos(np.clip((THIGH**2 + SHIN**2 - reach**2) / (2 * THIGH * SHIN), -1, 1))
    upper = Rotation.from_rotvec(swing[:, None] * right).apply(down)
    hips = Rotation.from_matrix(np.stack([np.cross(-upper, right), -upper, right], -1))
    knee = hips * Rotation.from_rotvec(-bend[:, None] * HINGE)
    forward = turned.apply(FORWARD)
    flat = Rotation.from_rotvec(np.arctan2(-forward[:, 2], forward[:, 0])[:, None] * UP)
    hanging = knee * Rotation.from_rotvec(-np.radians(rng.uniform(0, 40)) * HINGE)
    between = (flat.inv() * hanging).as_rotvec() * air[:, None]
    return {
        f"{side}_hip": hips,
        f"{side}_knee": knee,
        f"{side}_ankle": flat * Rotation.from_rotvec(between),
    }
