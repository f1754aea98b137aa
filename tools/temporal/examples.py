"""Training examples: what was seen of a clip, and where the body truly was along the rays.

Truth is scaled to the detector's metre, clip by clip, so that only its shape counts; frames in
which the detector followed something else are left out of the loss.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.mocap.figures import true_contacts
from benchmarks.mocap.truth import soles
from robojackson.body.forward_kinematics import apply
from robojackson.clips.quality.visibility import weigh_visibility
from robojackson.errors import NoPersonFound
from robojackson.mocap.grounding.up_direction import camera_to_world
from robojackson.mocap.landmarks import pinhole_camera
from robojackson.mocap.landmarks.blazepose import BODY, landmark, repair
from robojackson.mocap.recover import MocapConfig
from robojackson.mocap.temporal import features, temporal_lift
from robojackson.mocap.temporal.features import ClipView
from robojackson.motion.landmark_track import LandmarkTrack

FOLLOWED_M = 0.25
"""Mean distance across the image over which the detector is not on the person."""
LEAST_FOUND, LEAST_FOLLOWED = 0.6, 0.4
VALIDATION_MOTIONS = ("long_walk2", "punch", "stealthy_walk1", "01_03", "05_15")
VALIDATION_EACH = 12
"""Besides these motions, every clip whose number divides by this is kept for validation."""
BONES = [
    (landmark(f"{side}_{a}"), landmark(f"{side}_{b}"))
    for side in ("left", "right")
    for a, b in features.CHAINS.values()
]


@dataclass(frozen=True)
class Example:
    """One clip.

    Attributes:
        sight: Detected landmarks.
        truth: All landmarks along the rays, NaN where there is none, metres.
        good: Frames that count.
        distance: Distance of the hips from the camera, metres.
        motion: Name of the motion.
        up: Direction against gravity in the axes of the rays.
        contact: States of the foot points.
    """

    sight: ClipView
    truth: np.ndarray
    good: np.ndarray
    distance: np.ndarray
    motion: str
    up: np.ndarray
    contact: np.ndarray


def along_rays(truth_c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return landmarks before the camera (T, 33, 3) along the ray to the hips, and the hips'
    distance."""
    root = truth_c[:, features.HIPS].mean(1)
    axes = np.swapaxes(features.axes_along(root), -1, -2)
    return apply(axes[:, None], truth_c - root[:, None]), np.linalg.norm(root, axis=-1)


def flattened(truth: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Return what `ClipView.flat` would be without an error."""
    away = distance[:, None, None]
    return truth[..., :2] * away / (away + truth[..., 2:])


def body_size(truth: np.ndarray) -> float:
    """Return the sum of the lengths of trunk and limbs, metres: median over the clip."""
    lengths = [np.linalg.norm(truth[:, a] - truth[:, b], axis=-1) for a, b in BONES]
    return float(np.median(np.sum(lengths, axis=0)))


def read(path: Path, known: bool = False) -> Example | None:
    """Return the example of a pair file; None if the detector lost the person too often.

    Args:
        path: The pair.
        known: Whether up and the focal length are known.
    """
    with np.load(path) as pair:
        stride = int(pair["stride"])
        seen, (width, height) = pair["seen"][::stride].astype(float), pair["size"].tolist()
        truth_c, motion, fps = pair["truth"].astype(float), str(pair["motion"]), float(pair["fps"])
        up_c, names = pair["up"].astype(float), pair["bone_names"].tolist()
        focal_px = float(pair["focal"]) if known else None
        feet = soles(apply(camera_to_world(up_c), pair["bones"].astype(float)), names)
    track = LandmarkTrack(fps / stride, width, height, seen[..., :3], seen[..., 3:6], seen[..., 6])
    if track.detected.mean() < LEAST_FOUND:
        return None
    places = features.time_grid(len(seen), track.fps)
    try:
        sight = temporal_lift.at(
            sight_of(weigh_visibility(track), focal_px, up_c if known else None), places
        )
    except NoPersonFound:
        return None
    truth, distance = along_rays(truth_c[: len(places)])
    found = track.detected[np.round(places).astype(int)]
    flat, ideal = sight.flat[:, BODY], flattened(truth[:, BODY], distance)
    good = found & (np.linalg.norm(flat - ideal, axis=-1).mean(1) < FOLLOWED_M)
    if good.mean() < LEAST_FOLLOWED:
        return None
    scale = (flat[good] * ideal[good]).sum() / (ideal[good] ** 2).sum()
    axes = features.axes_along(truth_c[: len(places), features.HIPS].mean(1))
    contact = true_contacts(feet, fps)[: len(places)]
    return Example(sight, truth * scale, good, distance * scale, motion, up_c @ axes, contact)


def sight_of(
    track: LandmarkTrack, focal_px: float | None = None, up_c: np.ndarray | None = None
) -> ClipView:
    """Return the view of the clip, as in `recover_motion`, up to the network."""
    config, landmarks = MocapConfig(), repair(track)
    focal = focal_px or pinhole_camera.guess_focal(track.width, track.height)
    lens = pinhole_camera.Pinhole(focal, track.width, track.height)
    placed = pinhole_camera.place(landmarks, lens, track.fps, config.depth_cutoff_hz)
    return features.view_clip(placed, landmarks.local, landmarks.visibility, up_c)


def load(folder: Path) -> tuple[list[Example], list[Example]]:
    """Return the training and validation examples of a folder of pairs: each clip without and with
    a known up and focal length."""
    training: list[Example] = []
    validation: list[Example] = []
    for path in sorted(folder.glob("[0-9]*_[0-9]*.npz")):
        number = path.stem.split("_")[-1].split(".")[0]
        for example in filter(None, (read(path), read(path, known=True))):
            held = example.motion.split("+")[0] in VALIDATION_MOTIONS
            keep = validation if held or int(number) % VALIDATION_EACH == 0 else training
            keep.append(example)
    return training, validation
