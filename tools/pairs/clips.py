"""One clip of pairs: a motion, a person, a camera, occluders; BlazePose's detections of it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from robojackson.clips.people.camera_motion import grey_levels
from robojackson.clips.people.reverse_pass import ReversePassConfig, track_in_reverse
from robojackson.clips.pose_detector import video_landmarker
from robojackson.mocap.landmarks.blazepose import LANDMARK_NAMES, landmark
from robojackson.mocap.landmarks.scene_edges import SceneEdges
from tools.pairs import gestures, people, scenery, sources
from tools.render import deepmimic
from tools.render.anny_body import Body

FPS = 30.0
FRAMES = (90, 150)
LIMBS = [
    [landmark(f"{side}_{name}") for name in names]
    for side in ("left", "right")
    for names in (("elbow", "wrist", "index"), ("shoulder", "elbow", "wrist"),
                  ("knee", "ankle", "foot_index"))
]  # fmt: skip
ON_THE_FLOOR = ("roll", "crawl", "getup_faceup", "backflip", "sideflip")
"""Motions that come a third as often: the detector loses half of their frames."""
INVENTED, GESTURES, GRAFTED = 0.35, 0.2, 0.25
"""Shares of dances that are invented, and of the others those with an invented upper body, and
those with the upper body of another motion."""
STRIDES, STRIDE_SHARES = (1, 2, 3), (0.5, 0.3, 0.2)
"""The detector sees each first, second or third frame; what lies between is NaN."""
REACH = 1.5
"""Metres that a person travels at most before the camera."""


def choose_motion(
    files: list[Path], cache: dict[Path, deepmimic.Motion], rng: np.random.Generator
) -> tuple[str, deepmimic.Motion]:
    """Return an invented dance, or a captured motion changed."""
    count = int(rng.integers(*FRAMES))
    if rng.uniform() < INVENTED or not files:
        motion, name = gestures.invent(rng, count, FPS), "invented"
    else:
        name, motion = _captured(files, cache, count, rng)
        kind = rng.uniform()
        if kind < GESTURES:
            motion, name = gestures.with_gestures(motion, rng), name + "+gestures"
        elif kind < GESTURES + GRAFTED:
            other, upper = _captured(files, cache, count, rng)
            motion, name = sources.grafted(motion, upper), f"{name}+{other}"
    if rng.uniform() < 0.5:
        motion = sources.mirrored(motion)
    return name, facing(motion, rng)


def _captured(
    files: list[Path], cache: dict[Path, deepmimic.Motion], count: int, rng: np.random.Generator
) -> tuple[str, deepmimic.Motion]:
    """Return a number of frames of a captured motion at another tempo."""
    weights = np.array([1.0 if sources.motion_name(f) in ON_THE_FLOOR else 3.0 for f in files])
    path = files[rng.choice(len(files), p=weights / weights.sum())]
    if path not in cache:
        cache[path] = sources.read(path, 120.0)
    whole = cache[path]
    tempo = 120.0 * rng.uniform(0.75, 1.3)
    start = int(rng.integers(0, len(whole)))
    part = sources.window(whole, start, int(count * tempo / FPS) + 2)
    motion = sources.window(deepmimic.resampled(replace(part, fps=tempo), FPS), 0, count)
    return sources.motion_name(path), sources.gathered(motion, REACH)


def facing(motion: deepmimic.Motion, rng: np.random.Generator) -> deepmimic.Motion:
    """Return turned so that the middle frame faces the camera, more or less."""
    middle = motion.rotations["root"][len(motion) // 2].apply([1.0, 0.0, 0.0])
    angle = -np.arctan2(-middle[2], middle[0]) + np.radians(rng.normal(0.0, 12.0))
    turn = Rotation.from_rotvec([0.0, angle, 0.0])
    return replace(
        motion,
        root_position=turn.apply(motion.root_position),
        rotations={name: turn * rotation for name, rotation in motion.rotations.items()},
    )


def make_clip(
    number: int, seed: int, body: Body, studio: scenery.Studio, files: list[Path],
    cache: dict[Path, deepmimic.Motion],
) -> dict[str, Any]:  # fmt: skip
    """Make one clip for training."""
    rng = np.random.default_rng([seed, number])
    name, motion = choose_motion(files, cache, rng)
    stride = int(rng.choice(STRIDES, p=STRIDE_SHARES))
    return shoot(name, motion, stride, body, studio, rng)


def shoot(
    name: str, motion: deepmimic.Motion, stride: int, body: Body, studio: scenery.Studio,
    rng: np.random.Generator, angles: scenery.Angles | None = None, hidden: bool = True,
    reverse: ReversePassConfig | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Return what BlazePose sees of a motion and what is true; occluded if `hidden`, tracked in
    reverse order too if `reverse` says how (`first` is then what the first pass saw)."""
    person = people.draw_person(body, rng)
    posed = person.posed(motion)
    low = posed.heads[..., 2].min(1)
    drop = low if name == "invented" else np.full(len(low), np.percentile(low, 5))
    posed = replace(posed, heads=posed.heads - np.outer(drop - 0.03, [0, 0, 1])[:, None])
    posed = replace(posed, heads=posed.heads.astype(np.float32))
    view = scenery.film(posed, rng, angles or scenery.draw_angles(rng))
    truth = view.see(person.landmarks(posed, LANDMARK_NAMES))
    boxes = scenery.occluders(truth, LIMBS, view, FPS, rng)
    if not hidden:
        boxes[:] = np.nan
    seen = np.full((len(truth), len(LANDMARK_NAMES), 7), np.nan, np.float32)
    scene, kept = SceneEdges(), []
    with video_landmarker("full") as detect_frame:
        pictures = studio.frames(person, posed, view, boxes, rng, stride)
        for number, picture in enumerate(pictures):
            seen[number * stride] = detect_frame(picture, number * stride / FPS)
            scene.add_frame(number, grey_levels(picture))
            kept += [picture] if reverse else []
    first = np.array(seen)
    if reverse:
        size = (view.width, view.height)
        shown = first[::stride].astype(float)
        seen[::stride], _ = track_in_reverse(kept, FPS / stride, size, "full", shown, reverse)
    return {
        "seen": seen,
        "first": first,
        "stride": np.array(stride),
        "truth": truth.astype(np.float32),
        "bones": view.see(posed.heads).astype(np.float32),
        "bone_names": np.array(person.body.bone_names),
        "focal": np.array(view.focal),
        "size": np.array([view.width, view.height]),
        "up": view.rotation @ np.array([0.0, 0.0, 1.0]),
        "fps": np.array(FPS),
        "edges": scene.edges(False, view.width, view.height),
        "motion": np.array(name),
    }
