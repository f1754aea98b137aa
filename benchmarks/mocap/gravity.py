"""Direction of gravity on steep and rolled cameras, and how honest its statement is.

    python -m benchmarks.mocap.gravity MOTIONS... [-o renders]

The four real cameras, and twelve renders of held-out motions: pitch from -20 to 60 degrees, roll
within 15, all sides, seed 26. Body: balance and the temporal network, without the scene's edges.
Spread: the stated standard deviation; what the edges show closely enough is declared sure. Bar:
among those mean 4 and worst 8 degrees, three quarters declared sure. MOTIONS are folders as for
`fresh`; renders need `tools/requirements.txt`.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.mocap import figures, fresh
from benchmarks.mocap.camera_pairs import detected
from benchmarks.mocap.truth import REAL, Truth, load_truth
from robojackson.errors import NoPersonFound
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.motion.landmark_track import LandmarkTrack

CLIPS, SEED = 12, 26
PITCH_DEG, ROLL_DEG = (-20.0, 60.0), 15.0


def make(number: int, files: dict[str, Path], tools: tuple[Any, Any]) -> dict[str, Any]:
    """Make one render; pitches are a twelfth of their range apart."""
    from tools.pairs import clips, scenery

    rng = np.random.default_rng([SEED, number])
    name = fresh.MOTIONS[number % len(fresh.MOTIONS)]
    motion = fresh.part_of(files[name], rng)
    step = (number * 5 % CLIPS + 0.5) / CLIPS
    angles = scenery.Angles(
        yaw=float(rng.uniform(-np.pi, np.pi)),
        pitch=float(np.radians(PITCH_DEG[0] + step * (PITCH_DEG[1] - PITCH_DEG[0]))),
        fills=float(rng.uniform(0.5, 1.0)),
        roll=float(np.radians(rng.uniform(-ROLL_DEG, ROLL_DEG))),
    )
    return clips.shoot(name, motion, 1, tools[0], tools[1], rng, angles, hidden=False)


def rendered(folders: list[Path], out: Path) -> Iterator[tuple[str, LandmarkTrack, Truth]]:
    """Yield the renders, made where they are missing."""
    paths = [out / f"gravity_{number:02d}.npz" for number in range(CLIPS)]
    for number, path in enumerate(fresh.rendered(paths, folders, make)):
        try:
            track, truth = fresh.read(path)
        except NoPersonFound:
            continue
        yield f"{number:02d} {truth.clip}", track, truth


def measure(track: LandmarkTrack, truth: Truth) -> dict[str, float]:
    """Return the errors of the body's up and of ours, its spread, degrees, and whether it is
    declared sure."""
    config = MocapConfig()
    alone = replace(config, gravity=replace(config.gravity, scene=False))
    body, ours = recover_motion(track, alone), recover_motion(track, config)
    camera: dict[str, Any] = dict(ours.camera)
    return {
        "pitch": float(np.degrees(np.arcsin(-truth.up_c[2]))),
        "body": figures.tilt_error_deg(body, truth),
        "ours": figures.tilt_error_deg(ours, truth),
        "spread": float(camera.get("gravity_sd_deg", np.nan)),
        "sure": float(camera["gravity_sure"]),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("motions", type=Path, nargs="+")
    parser.add_argument("-o", "--out", type=Path, default=Path("gravity"))
    options = parser.parse_args()
    clips = [(clip, detected(clip), load_truth(clip)) for clip in REAL]
    clips += rendered(options.motions, options.out)
    rows = [measure(track, truth) for _, track, truth in clips]
    table = Table("clip", *rows[0])
    for (name, _, _), row in zip(clips, rows, strict=True):
        table.add_row(name, *(f"{value:.1f}" for value in row.values()))
    Console().print(table)
    body, ours, spread, sure = (
        np.array([row[key] for row in rows]) for key in ("body", "ours", "spread", "sure")
    )
    print(f"all {len(rows)}: body {body.mean():.1f}, ours {ours.mean():.1f} degrees")
    if sure.any():
        known = sure > 0
        within = (ours[known] <= spread[known]).mean()
        print(
            f"declared sure: {sure.mean():.0%}, mean {ours[known].mean():.1f}, worst "
            f"{ours[known].max():.1f} degrees; {within:.0%} within the spread"
        )


if __name__ == "__main__":
    main()
