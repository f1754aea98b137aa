"""The bundled clips that have a truth, and their joints.

Rendered clips: exact joints of the body that was drawn. Real clip: markerless triangulation of four
cameras (noise floor 20-30 mm), Y-up metres in the TRC, turned to z up. Frame t of the truth is
frame t of the video in all of them. Directions: world z up.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

CLIPS = Path(__file__).parents[2] / "clips"
RENDERED = ("hip_shake", "dance_a", "dance_b", "walk")
REAL = ("person_cam1", "person_cam2", "person_cam3", "person_cam4")
HELD_OUT = ("kick", "spin", "dance_a_aside", "dance_b_aside", "walk_aside")
"""Other motions, sides and bodies, in `clips/heldout`; what rests on them: `accuracy.TUNED`."""
SEAMS = {"dance_a": (49,), "dance_a_aside": (49,), "walk": (39,), "walk_aside": (39,)}
"""First frames of the second cycle of the clips that loop with a jump."""
JOINTS = tuple(
    f"{side}_{name}"
    for name in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
    for side in ("left", "right")
)
HIPS = (0, 1)
SOLE_BONES = ("foot.L", "toe1-2.L", "foot.R", "toe1-2.R")
SOLE_BELOW_BONE = np.array([0.08, 0.03, 0.08, 0.03])
"""Least height of these bones of the drawn body when it stands, metres."""
SOLE_LENGTH = 0.198
"""From heel bone to toe bone of the same body, metres; others have feet in proportion."""
TRC_TO_Z_UP = (2, 0, 1)
OPENGL_TO_CAMERA = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class Truth:
    """Ground truth of a clip.

    Attributes:
        clip: Name of the video without its suffix.
        joints: `JOINTS`, metres, world.
        up_c: Direction against gravity in the camera frame.
        feet: Soles under heels and toes, metres; None where the truth has no toes.
        seams: First frame of every further cycle.
    """

    clip: str
    joints: Float[np.ndarray, "T 12 3"]
    up_c: Float[np.ndarray, "3"]
    feet: Float[np.ndarray, "T 4 3"] | None = None
    seams: tuple[int, ...] = ()


def video_path(clip: str) -> Path:
    """Return the video of a clip."""
    return _folder(clip) / f"{clip}.mp4"


def load_truth(clip: str) -> Truth:
    """Return the truth of a bundled clip."""
    return _real(clip) if clip in REAL else _rendered(clip)


def _rendered(clip: str) -> Truth:
    with np.load(_folder(clip) / f"{clip}_gt.npz") as data:
        names = [_own_name(name) for name in data["names"].tolist()]
        joints = data["joints"].astype(float)[:, [names.index(name) for name in JOINTS]]
        bones = data["bone_names"].tolist()
        feet = soles(data["all_bones"], bones)
        up = data["view"][:3, 2] * OPENGL_TO_CAMERA
        return Truth(clip, joints, up, feet, SEAMS.get(clip, ()))


def soles(bones: Float[np.ndarray, "T B 3"], names: list[str]) -> Float[np.ndarray, "T 4 3"]:
    """Return the soles under heels and toes of a drawn body, world z up, metres."""
    feet = np.array(bones[:, [names.index(name) for name in SOLE_BONES]], float)
    length = np.linalg.norm(feet[0, 1] - feet[0, 0])
    feet[..., 2] -= SOLE_BELOW_BONE * length / SOLE_LENGTH
    return feet


def _folder(clip: str) -> Path:
    return CLIPS / "heldout" if clip in HELD_OUT else CLIPS


def _real(clip: str) -> Truth:
    lines = (CLIPS / "person_reference.trc").read_text().splitlines()
    names = [_own_name(name) for name in lines[3].split("\t")[2:] if name.strip()]
    rows = [line.split("\t")[2 : 2 + 3 * len(names)] for line in lines[5:] if line.strip()]
    table = np.array(rows, dtype=float).reshape(len(rows), len(names), 3)
    joints = table[:, [names.index(name) for name in JOINTS]][..., TRC_TO_Z_UP]
    camera = REAL.index(clip)
    text = (CLIPS / "person_calib.txt").read_text()
    entries = dict(re.findall(r'(r\d\d)="([^"]+)"', re.findall("<transform .*?/>", text)[camera]))
    # Qualisys: the world's z row; its camera has y up and z backward.
    column = np.array([float(entries[key]) for key in ("r13", "r23", "r33")])
    return Truth(clip, joints, column * OPENGL_TO_CAMERA)


def _own_name(name: str) -> str:
    """Return our name of a joint: L_Hip of the renderer and LHip of the TRC are left_hip."""
    match = re.fullmatch(r"([LR])_?([A-Z].*)", name)
    if not match:
        return name.lower()
    return f"{'left' if match[1] == 'L' else 'right'}_{match[2].lower()}"
