"""Motions that the training pairs may be made of, and no others.

A file that is not on the list is refused, those that accuracy is reported on by name: a figure on a
motion that the network has seen would be worth nothing. Frame of all motions: DeepMimic's.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tools.pairs import cmu_bvh
from tools.pairs.gestures import UPPER
from tools.render import deepmimic

DEEPMIMIC = (
    "jump", "run", "punch", "roll", "crawl", "getup_faceup", "backflip", "spinkick",
)  # fmt: skip
LONG = (
    "jog", "long_walk1", "long_walk2", "long_walk3", "long_zombie", "sideflip", "stealthy_walk0",
    "stealthy_walk1",
)  # fmt: skip
CMU = (
    "01_01", "01_03", "05_01", "05_04", "05_05", "05_06", "05_11", "05_14", "05_15", "05_17",
)  # fmt: skip
"""Dances of subject 5 that `benchmarks/learning/split.yaml` neither holds out nor excludes."""
ALLOWED = (*DEEPMIMIC, *LONG, *CMU)
REPORTED = (
    "dance_a", "dance_b", "walk", "kick", "spin", "cartwheel", "getup_facedown",
    "05_02", "05_07", "05_09", "05_10", "05_13", "05_18", "05_19",
)  # fmt: skip
"""Motions of the clips that figures are reported on."""
SWAP = {"left": "right", "right": "left"}


class RefusedMotion(ValueError):
    """A motion that may not be trained on."""


def motion_name(path: Path) -> str:
    """Return the name of a motion: `humanoid3d_jump.txt.gz` is jump, `01_03.bvh` is 01_03."""
    return path.name.split(".")[0].removeprefix("humanoid3d_")


def check_allowed(path: Path) -> None:
    """Refuse a motion outside the list.

    Raises:
        RefusedMotion: it is reported on, or unknown.
    """
    name = motion_name(path)
    if name in REPORTED:
        raise RefusedMotion(f"{path}: accuracy is reported on {name}: it may not be trained on")
    if name not in ALLOWED:
        raise RefusedMotion(f"{path}: not a training motion; those are {', '.join(ALLOWED)}")


def find(folders: list[Path]) -> list[Path]:
    """Return the training motions in folders; other files there are passed over."""
    files = sorted(path for folder in folders for path in folder.iterdir() if path.is_file())
    return [path for path in files if motion_name(path) in ALLOWED]


def read(path: Path, fps: float) -> deepmimic.Motion:
    """Return a motion of the list at a frame rate."""
    check_allowed(path)
    if ".bvh" in path.suffixes:
        return deepmimic.resampled(cmu_bvh.read(path), fps)
    return deepmimic.read(path, fps)


def window(motion: deepmimic.Motion, start: int, count: int) -> deepmimic.Motion:
    """Return frames from `start`; a motion that is too short is played to and fro."""
    index = np.arange(start, start + count) % max(2 * len(motion) - 2, 1)
    index = np.where(index < len(motion), index, 2 * len(motion) - 2 - index)
    return replace(
        motion,
        root_position=motion.root_position[index],
        rotations={name: rotation[index] for name, rotation in motion.rotations.items()},
    )


def mirrored(motion: deepmimic.Motion) -> deepmimic.Motion:
    """Return the motion in a mirror: z, the right, changes its sign."""
    rotations = {}
    for name, rotation in motion.rotations.items():
        vectors = rotation.as_rotvec() * np.array([-1.0, -1.0, 1.0])
        rotations["_".join(SWAP.get(p, p) for p in name.split("_"))] = Rotation.from_rotvec(vectors)
    return replace(
        motion, root_position=motion.root_position * [1.0, 1.0, -1.0], rotations=rotations
    )


def grafted(motion: deepmimic.Motion, other: deepmimic.Motion) -> deepmimic.Motion:
    """Give the motion chest, head and arms of another as they move about its own pelvis."""
    turn = motion.rotations["root"] * other.rotations["root"].inv()
    limbs = {name: turn * other.rotations[name] for name in UPPER}
    return replace(motion, rotations={**motion.rotations, **limbs})


def gathered(motion: deepmimic.Motion, reach: float) -> deepmimic.Motion:
    """Return the motion without its travel if it goes farther over the floor than `reach`,
    metres."""
    position = np.array(motion.root_position)
    flat = position[:, [0, 2]]
    if np.ptp(flat, axis=0).max() <= reach:
        return motion
    time = np.linspace(0.0, 1.0, len(position))
    trend = np.stack([np.polyval(np.polyfit(time, axis, 4), time) for axis in flat.T], -1)
    position[:, [0, 2]] = flat - trend
    return replace(motion, root_position=position)
