"""Twenty clips that cannot have been tuned on: their seed is the sha256 of the network's weights.

    python -m benchmarks.mocap.fresh MOTIONS... [-o pairs]

The strata are fixed here: held-out motions (`tools/pairs/sources.py: REPORTED`), four pitches, all
sides, three sizes of the person, 30, 15 and 10 frames a second. MOTIONS are folders with their
files; needs `tools/requirements.txt`. Rows: raw BlazePose in one pass, our default. Frames without
a person count for both; PA-MPJPE of twelve joints, mm.
"""

import argparse
import hashlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from rich.console import Console
from rich.table import Table

from benchmarks.mocap import figures
from benchmarks.mocap.truth import JOINTS, Truth
from robojackson.body.skeleton import keypoint
from robojackson.clips.people.reverse_pass import ReversePassConfig
from robojackson.errors import NoPersonFound
from robojackson.mocap.landmarks.blazepose import fill_gaps, landmark
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.mocap.temporal.temporal_lift import WEIGHTS
from robojackson.motion.landmark_track import LandmarkTrack

MOTIONS = (
    "05_02", "dance_a", "05_09", "kick", "05_18", "dance_b", "05_13", "spin", "05_19", "walk",
)  # fmt: skip
PITCHES_DEG = ((-20.0, 0.0), (0.0, 20.0), (20.0, 40.0), (40.0, 60.0))
FILLS = (0.5, 0.75, 1.0)
STRIDES = (1, 1, 2, 1, 3)
CLIPS, FRAMES = 20, 90
LANDMARKS = [landmark(name) for name in JOINTS]


def seed_of(weights: Path) -> int:
    """Return the first 32 bits of a file's sha256."""
    return int.from_bytes(hashlib.sha256(weights.read_bytes()).digest()[:4], "big")


def make(number: int, files: dict[str, Path], tools: tuple[Any, Any], seed: int) -> dict[str, Any]:
    """Make the clip of one stratum."""
    from tools.pairs import clips, scenery

    rng = np.random.default_rng([seed, number])
    motion = part_of(files[MOTIONS[number % len(MOTIONS)]], rng)
    quarter = number * 7 % 4
    angles = scenery.Angles(
        yaw=float(np.radians(rng.uniform(90.0 * quarter, 90.0 * quarter + 90.0))),
        pitch=float(np.radians(rng.uniform(*PITCHES_DEG[number % len(PITCHES_DEG)]))),
        fills=FILLS[number % len(FILLS)],
    )
    stride = STRIDES[number % len(STRIDES)]
    body, studio = tools
    return clips.shoot(
        MOTIONS[number % 10], motion, stride, body, studio, rng, angles, False, ReversePassConfig()
    )


def rendered(
    paths: list[Path],
    folders: list[Path],
    make: Callable[[int, dict[str, Path], tuple[Any, Any]], dict[str, Any]],
) -> Iterator[Path]:
    """Yield renders in their order, those that are missing made from the motions of folders."""
    from tools.pairs import scenery, sources
    from tools.render.anny_body import Body

    files = {sources.motion_name(path): path for folder in folders for path in folder.iterdir()}
    tools: tuple[Any, Any] | None = None
    for number, path in enumerate(paths):
        if not path.exists():
            if tools is None:
                body = Body()
                tools = body, scenery.Studio(body.triangles, len(body.rest_vertices))
            path.parent.mkdir(parents=True, exist_ok=True)
            np.savez(path, **make(number, files, tools))
        yield path


def part_of(path: Path, rng: np.random.Generator) -> Any:
    """Return `FRAMES` frames from anywhere in a held-out motion, turned to the camera."""
    from tools.pairs import clips, cmu_bvh, sources
    from tools.render import deepmimic

    bvh = ".bvh" in path.suffixes
    whole = deepmimic.resampled(cmu_bvh.read(path), 30.0) if bvh else deepmimic.read(path, 30.0)
    part = sources.window(whole, int(rng.integers(1, max(len(whole) - FRAMES, 2))), FRAMES)
    return clips.facing(sources.gathered(replace(part, fps=30.0), clips.REACH), rng)


def read(path: Path, key: str = "seen") -> tuple[LandmarkTrack, Truth]:
    """Return what was seen of a rendered clip, and what is true.

    Args:
        path: File of a render.
        key: "seen", or "first" for what the pass in the order of the clip saw.
    Raises:
        NoPersonFound: fewer than two frames with a person.
    """
    with np.load(path) as pair:
        stride, (width, height) = int(pair["stride"]), pair["size"].tolist()
        seen, name = pair[key][::stride].astype(float), str(pair["motion"])
        truth = Truth(name, pair["truth"][::stride][:, LANDMARKS].astype(float), pair["up"])
        edges = pair.get("edges")
    arrays = seen[..., :3], seen[..., 3:6], seen[..., 6]
    track = LandmarkTrack(30.0 / stride, width, height, *arrays, edges=edges)
    if track.detected.sum() < 2:
        raise NoPersonFound("no person detected")
    return track, truth


def raw_joints(path: Path) -> Float[np.ndarray, "T 12 3"]:
    """Return the twelve joints of raw BlazePose in the order of a rendered clip, gaps filled,
    metres."""
    track, _ = read(path, "first")
    return fill_gaps(track.world_landmarks, track.detected)[:, LANDMARKS]


def measure(path: Path) -> tuple[str, float, dict[str, float], dict[str, float]]:
    """Name, share of detected frames, figures of raw and of ours."""
    track, truth = read(path)
    name, fps = truth.clip, track.fps
    raw = raw_joints(path)
    sequence = recover_motion(track, MocapConfig())
    ours = sequence.joints[:, [keypoint(name) for name in JOINTS]]
    found = figures.joint_errors(ours, truth, fps)
    found["tilt_deg"] = figures.tilt_error_deg(sequence, truth)
    return name, float(track.detected.mean()), figures.joint_errors(raw, truth, fps), found


def main() -> None:
    """Make what is missing, measure, print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("motions", type=Path, nargs="+")
    parser.add_argument("-o", "--out", type=Path, default=Path("fresh"))
    parser.add_argument("--seed", type=int, help="another one than the weights'")
    options = parser.parse_args()
    seed = seed_of(WEIGHTS) if options.seed is None else options.seed
    paths = [options.out / f"{seed}_{number:02d}.npz" for number in range(CLIPS)]
    table = Table("clip", "detected", "raw", "ours", "speed ratio", "gravity deg")
    totals = []
    renders = rendered(paths, options.motions, partial(make, seed=seed))
    for number, path in enumerate(renders):
        try:
            name, share, raw, ours = measure(path)
        except NoPersonFound as error:
            table.add_row(MOTIONS[number % 10], "0 %", str(error))
            continue
        totals.append((raw["pa_mpjpe_mm"], ours["pa_mpjpe_mm"]))
        cells = (raw["pa_mpjpe_mm"], ours["pa_mpjpe_mm"], ours["speed_ratio"], ours["tilt_deg"])
        shown = [
            f"{value:.2f}" if index == 2 else f"{value:.0f}" for index, value in enumerate(cells)
        ]
        table.add_row(name, f"{share:.0%}", *shown)
    means = np.mean(totals, 0)
    table.add_row("mean", "", *(f"{value:.1f}" for value in means))
    Console().print(table)


if __name__ == "__main__":
    main()
