"""The floor under a human motion: free fall, the states of the robot's soles, the ground refit.

Metres, seconds, world frame (z up, floor at z = 0).
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import gaussian_filter1d, maximum_filter1d, median_filter

from robojackson.motion.smpl_sequence import AIR, CONTACT_POINTS, PLANTED, SLIDING
from robojackson.retarget.targets.human_clip import HumanClip
from robojackson.robot.model import ContactPoint, Robot

GRAVITY = 9.81
_SLOW_FOOT = 0.40  # m/s: above it a foot on the floor is pivoting or sliding on purpose
_STILL_FOOT = 0.20  # m/s: a foot near the floor that is slower stands, with or without a label
_HEEL_OFF_M = 0.07  # m over the lowest foot: a ball follows the ankle and leaves with the heel
_WANDER_M = 0.06  # m: a planted foot stays this near to where it stands
_NEAR_FLOOR = 0.03  # m over the lowest foot
_FREE_FALL = 0.8  # share of gravity that the hips must be falling with to count as airborne
_SHORTEST_FLIGHT = 0.08  # s
_STEPS_M, _STEPS_S = 0.20, 0.16  # a hop that is no flight is a step: feet so low, so long around it
_HOP_M = 0.05  # rise of the lowest sole in a hop


def free_fall(human: Mapping[str, np.ndarray], clip: HumanClip) -> Bool[np.ndarray, " N"]:
    """Return the stretches without contact over which the hips lose speed as fast as a falling body
    does."""
    hips = (human["left_hip"] + human["right_hip"])[:, 2] / 2
    smooth = gaussian_filter1d(hips, 0.02 / clip.dt, mode=clip.edges)
    cycles = clip.cycle_offset is not None
    around = int(cycles)  # steps of the neighbouring cycles
    rise = np.gradient(np.pad(smooth, around, mode="wrap"), clip.dt)[around : around + len(hips)]
    out = np.zeros(len(hips), bool)
    for steps in stretches((clip.contact == AIR).all(axis=1), cycles):
        seconds = len(steps) * clip.dt
        fall = (rise[steps[0]] - rise[steps[-1]]) / max(seconds - clip.dt, clip.dt)
        out[steps] = seconds >= _SHORTEST_FLIGHT and fall > _FREE_FALL * GRAVITY
    return out


def without(
    airborne: Bool[np.ndarray, " N"], hovering: np.ndarray, cycles: bool
) -> Bool[np.ndarray, " N"]:
    """Return the flights in which the body hovers in less than a third of the steps."""
    out = np.zeros_like(airborne)
    for steps in stretches(airborne, cycles):
        out[steps] = hovering[steps].mean() < 1 / 3
    return out


def stretches(flags: Bool[np.ndarray, " N"], cycles: bool) -> list[Int[np.ndarray, " M"]]:
    """Return the steps of each stretch of True; one over the seam of a cycle is one."""
    first = int(flags.argmin()) if cycles else 0
    rolled = np.roll(flags, -first)
    return [np.arange(start + first, end + first) % len(flags) for start, end in runs(rolled)]


def runs(flags: Bool[np.ndarray, " N"]) -> list[tuple[int, int]]:
    """Return first and one-past-last index of each stretch of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def ball_contact(
    clip: HumanClip,
    robot: Robot,
    balls: Float[np.ndarray, "N C 3"],
    airborne: np.ndarray,
    hops: bool = True,
) -> Int[np.ndarray, "N C"]:
    """Return the states of the robot's balls: those of the human points they follow, planted where
    slow.

    A foot that stands still near the floor is planted with any label; a body that touches nothing
    and does not fall as fast as in flight stands on its lowest foot. Without `hops` it takes a step
    where its feet leave the floor: the foot that takes off stays and the one that lands is down
    already, where both are low.
    """
    mode = clip.edges
    above = balls[..., 2] - balls[..., 2].min(axis=1, keepdims=True)
    bare = (clip.contact == AIR).all(axis=1) & ~airborne
    stepped = _around_hops(bare & (not hops), balls[..., 2].min(axis=1), clip)
    window = 2 * round(0.045 / clip.dt) + 1
    out = np.zeros(balls.shape[:2], int)
    for column, point in enumerate(robot.description.contacts.values()):
        own = [i for i, name in enumerate(CONTACT_POINTS) if follows(point, name)]
        speed = _speed(balls[:, column], clip)
        stands = (above[:, column] < _NEAR_FLOOR) & (speed < _STILL_FOOT) & ~airborne
        stands |= (bare & (above[:, column] < 0.01)) | (stepped & (above[:, column] < _STEPS_M))
        reaches = above[:, column] < _HEEL_OFF_M
        touching = ((clip.contact[:, own] != AIR).any(axis=1) & reaches) | stands
        touching = median_filter(touching.astype(int), window, mode=mode) > 0
        slow = (clip.contact[:, own] == PLANTED).any(axis=1) & (speed < _SLOW_FOOT)
        still = (slow | stands) & (speed < _SLOW_FOOT)
        still = median_filter(still.astype(int), window, mode=mode) > 0
        still = _standing_runs(still & touching, balls[:, column])
        out[:, column] = np.where(touching, np.where(still, PLANTED, SLIDING), AIR)
    return out


def _around_hops(
    bare: Bool[np.ndarray, " N"], lowest: Float[np.ndarray, " N"], clip: HumanClip
) -> Bool[np.ndarray, " N"]:
    """Return the steps of hops, stretches without contact in which the feet leave the floor, and
    those around them."""
    hops = np.zeros(len(bare), bool)
    floor = np.median(lowest[~bare]) if not bare.all() else lowest.min()
    for steps in stretches(bare, clip.cycle_offset is not None):
        hops[steps] = lowest[steps].max() - floor > _HOP_M
    around = 2 * round(_STEPS_S / clip.dt) + 1
    return np.asarray(maximum_filter1d(hops, around, mode=clip.edges))


def follows(point: ContactPoint, human: str) -> bool:
    """Return whether a ball follows a human contact point, such as `left_heel`."""
    side, _, part = human.partition("_")
    return point.side == side and point.label in (part, "either")


def _standing_runs(
    still: Bool[np.ndarray, " N"], path: Float[np.ndarray, "N 3"]
) -> Bool[np.ndarray, " N"]:
    """Return only the stretches in which the foot does not drift; the others slide on purpose."""
    out = np.zeros(len(still), bool)
    for start, end in runs(still):
        flat = path[start:end, :2]
        reach = np.linalg.norm(flat - np.median(flat, axis=0), axis=1).max()
        out[start:end] = reach < _WANDER_M
    return out


def ground_shift(
    soles: Float[np.ndarray, "N C"], contact: Int[np.ndarray, "N C"], clip: HumanClip
) -> Float[np.ndarray, " N"]:
    """Return the shift that puts the lowest carrying sole of each step at z = 0; interpolated in
    the air."""
    carried = (contact != AIR).any(axis=1)
    if not carried.any():
        shift = np.full(len(soles), -soles.min())
    else:
        lowest = np.where(contact != AIR, soles, np.inf).min(axis=1)
        steps = np.arange(len(soles))
        period = {"period": len(soles)} if clip.cycle_offset is not None else {}
        shift = np.interp(steps, steps[carried], -lowest[carried], **period)
        mode = clip.edges
        shift = gaussian_filter1d(shift, 0.05 / clip.dt, mode=mode)
    return np.asarray(shift)


def _speed(path: Float[np.ndarray, "N 3"], clip: HumanClip) -> Float[np.ndarray, " N"]:
    """Return the horizontal speed, m/s."""
    flat = path[:, :2]
    if clip.cycle_offset is not None:
        flat = np.concatenate(
            [flat[-1:] - clip.cycle_offset[:2], flat, flat[:1] + clip.cycle_offset[:2]]
        )
        return np.asarray(np.linalg.norm(flat[2:] - flat[:-2], axis=1) / (2 * clip.dt))
    return np.asarray(np.linalg.norm(np.gradient(flat, clip.dt, axis=0), axis=1))
