"""Input and output of the temporal network: axes along the ray to the person.

In each frame the axes are those of a camera that points at the middle of the hips (x right, y down,
z away), the origin is there, metres of the detector. `flat` is the image scaled to the person's
distance: an orthographic image without the effect of depth.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robojackson.body.forward_kinematics import apply, unit
from robojackson.mocap.landmarks.blazepose import BODY, LANDMARK_NAMES, MIRROR, landmark
from robojackson.mocap.landmarks.pinhole_camera import DOWN, METRES_PER_METRE

HIPS = (landmark("left_hip"), landmark("right_hip"))
FPS = 30.0
"""Frame rate of the network, hertz."""
CHAINS: Mapping[str, tuple[str, str]] = {
    "thigh": ("hip", "knee"), "shin": ("knee", "ankle"), "upper_arm": ("shoulder", "elbow"),
    "forearm": ("elbow", "wrist"), "flank": ("shoulder", "hip"),
}  # fmt: skip
WIDTHS = ("hip", "shoulder")
LONGEST = 95.0
"""Percentile of a bone's length in the image that estimates its true length."""
INPUT_LANDMARKS = np.array(
    [landmark("nose"), landmark("left_ear"), landmark("right_ear"), *BODY]
    + [landmark(f"{s}_{n}") for n in ("index", "pinky", "heel", "foot_index")
       for s in ("left", "right")]
)  # fmt: skip
"""Landmarks in the network's input."""
COUNT = len(INPUT_LANDMARKS) * 6 + 2 * (len(CHAINS) + len(WIDTHS)) + 1 + 3
"""Length of the input, numbers a frame."""


@dataclass(frozen=True)
class ClipView:
    """A clip along the rays to the person.

    Attributes:
        flat: Image landmarks at the person's distance from the middle of the hips, metres.
        local: The detector's landmarks, scaled to our metres.
        visibility: Visibility of the landmarks, 0..1.
        axes: Rotations from these axes to the camera's.
        root: The middle of the hips before the camera, metres.
        up: Direction against gravity, zero where it is not known.
    """

    flat: Float[np.ndarray, "T 33 2"]
    local: Float[np.ndarray, "T 33 3"]
    visibility: Float[np.ndarray, "T 33"]
    axes: Float[np.ndarray, "T 3 3"]
    root: Float[np.ndarray, "T 3"]
    up: Float[np.ndarray, "T 3"]


def view_clip(
    placed: Float[np.ndarray, "T 33 3"],
    local: Float[np.ndarray, "T 33 3"],
    visibility: Float[np.ndarray, "T 33"],
    up: Float[np.ndarray, "3"] | None = None,
) -> ClipView:
    """Return the view from landmarks that the camera stage has placed, the detector's own, and up
    in the camera's axes where it is known."""
    rays = placed / placed[..., 2:]
    root = placed[:, HIPS].mean(1)
    axes = axes_along(root)
    seen = apply(np.swapaxes(axes, -1, -2)[:, None], rays)
    flat = seen[..., :2] / seen[..., 2:] * np.linalg.norm(root, axis=-1)[:, None, None]
    along = np.zeros(3) if up is None else up
    return ClipView(flat, local * METRES_PER_METRE, visibility, axes, root, along @ axes)


def axes_along(ray: Float[np.ndarray, "T 3"]) -> Float[np.ndarray, "T 3 3"]:
    """Return rotations whose z is along the rays, x level."""
    forward = unit(ray)
    right = unit(np.cross(DOWN, forward))
    return np.stack([right, np.cross(forward, right), forward], -1)


def numbers(sight: ClipView) -> Float[np.ndarray, "T F"]:
    """Return the network's input."""
    count = len(sight.flat)
    return np.concatenate(
        [
            sight.flat[:, INPUT_LANDMARKS].reshape(count, -1),
            sight.local[:, INPUT_LANDMARKS].reshape(count, -1),
            sight.visibility[:, INPUT_LANDMARKS],
            np.tile(constants(sight), (count, 1)),
            sight.up,
        ],
        1,
    )


def constants(sight: ClipView) -> Float[np.ndarray, " C"]:
    """Return the constants of a clip: proportions of the person, and his distance."""
    return np.concatenate([proportions(sight), [1.0 / max(sight.root[:, 2].mean(), 0.5)]])


def proportions(sight: ClipView) -> Float[np.ndarray, " P"]:
    """Return bones of the clip: longest in the image, which depth cannot shorten, and the
    detector's."""
    pairs = [[(f"{s}_{a}", f"{s}_{b}") for s in ("left", "right")] for a, b in CHAINS.values()]
    pairs += [[(f"left_{name}", f"right_{name}")] for name in WIDTHS]
    in_image, in_space = [], []
    for ends in pairs:
        starts, stops = (np.array([landmark(pair[k]) for pair in ends]) for k in (0, 1))
        lengths = np.linalg.norm(sight.flat[:, starts] - sight.flat[:, stops], axis=-1)
        in_image.append(np.percentile(lengths, LONGEST))
        lengths = np.linalg.norm(sight.local[:, starts] - sight.local[:, stops], axis=-1)
        in_space.append(np.median(lengths))
    return np.array(in_image + in_space)


def base(sight: ClipView) -> Float[np.ndarray, "T 12 3"]:
    """Return the body of the detector: its own depth, the image at that depth."""
    depth = sight.local[:, BODY, 2]
    return np.concatenate([at_depth(sight, depth), depth[..., None]], -1)


def at_depth(sight: ClipView, depth: Float[np.ndarray, "T 12"]) -> Float[np.ndarray, "T 12 2"]:
    """Return the body across the image at the given depth behind the hips."""
    distance = np.linalg.norm(sight.root, axis=-1)[:, None]
    result: np.ndarray = sight.flat[:, BODY] * ((distance + depth) / distance)[..., None]
    return result


def to_camera(sight: ClipView, points: Float[np.ndarray, "T N 3"]) -> Float[np.ndarray, "T N 3"]:
    """Return points in the camera's axes from those along the ray."""
    result: np.ndarray = apply(sight.axes[:, None], points) + sight.root[:, None]
    return result


def mirror(sight: ClipView) -> ClipView:
    """Return the mirrored clip: left becomes right, x changes its sign."""
    flip = np.array([-1.0, 1.0, 1.0])
    return ClipView(
        flat=sight.flat[:, MIRROR] * flip[:2],
        local=sight.local[:, MIRROR] * flip,
        visibility=sight.visibility[:, MIRROR],
        axes=sight.axes * flip[:, None] * flip,
        root=sight.root * flip,
        up=sight.up * flip,
    )


def mirror_body(values: Float[np.ndarray, "T 12 *D"]) -> Float[np.ndarray, "T 12 *D"]:
    """Return values with left and right of the twelve exchanged."""
    order = [list(BODY).index(MIRROR[index]) for index in BODY]
    return values[:, order]


def time_grid(count: int, fps: float) -> Float[np.ndarray, " S"]:
    """Return the network's frames as fractional frames of the clip."""
    return np.arange(0.0, count - 1 + 1e-6, fps / FPS) if count > 1 else np.zeros(1)


def resample(values: np.ndarray, places: Float[np.ndarray, " S"]) -> np.ndarray:
    """Return values interpolated in time along axis 0 at fractional frames; held beyond the
    ends."""
    places = np.clip(places, 0.0, len(values) - 1.0)
    low = np.minimum(np.floor(places).astype(int), max(len(values) - 2, 0))
    part = (places - low).reshape(-1, *[1] * (values.ndim - 1))
    high = np.minimum(low + 1, len(values) - 1)
    result: np.ndarray = values[low] * (1.0 - part) + values[high] * part
    return result


NAMES: tuple[str, ...] = tuple(LANDMARK_NAMES[index] for index in BODY)
"""Mirror order of the twelve landmarks."""
