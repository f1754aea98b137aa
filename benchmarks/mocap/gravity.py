"""Direction of gravity on steep and rolled cameras, and how honest its statement is.

    python -m benchmarks.mocap.gravity MOTIONS... [-o renders]

The four real cameras, and twelve renders of held-out motions: pitch from -20 to 60 degrees, roll
within 15, all sides, seed 26. Balance: what the centre of mass over the feet gives without the
temporal network. Spread: the stated standard deviation. Bar: among those declared sure mean 4 and
worst 8 degrees; nothing is declared sure, the surest half by its spread is printed instead.
MOTIONS are folders as for `fresh`; renders need `tools/requirements.txt`.
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


def measure(track: LandmarkTrack, truth: Truth) -> tuple[float, float, float]:
    """Return the errors of balance alone and of ours, and its spread, degrees."""
    config = MocapConfig()
    plain = replace(config, temporal=replace(config.temporal, enabled=False))
    before, now = recover_motion(track, plain), recover_motion(track, config)
    errors = [figures.tilt_error_deg(sequence, truth) for sequence in (before, now)]
    camera: dict[str, Any] = dict(now.camera)
    return errors[0], errors[1], float(camera.get("gravity_sd_deg", np.nan))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("motions", type=Path, nargs="+")
    parser.add_argument("-o", "--out", type=Path, default=Path("gravity"))
    options = parser.parse_args()
    clips = [(clip, detected(clip), load_truth(clip)) for clip in REAL]
    clips += rendered(options.motions, options.out)
    table, rows = Table("clip", "pitch", "balance", "ours", "spread"), []
    for name, track, truth in clips:
        rows.append(measure(track, truth))
        pitch = np.degrees(np.arcsin(-truth.up_c[2]))
        table.add_row(name, *(f"{value:.1f}" for value in (pitch, *rows[-1])))
    Console().print(table)
    balance, ours, spread = np.array(rows).T
    surest = ours[np.argsort(spread)[: len(ours) // 2]]
    print(f"all {len(rows)}: balance {balance.mean():.1f}, ours {ours.mean():.1f} degrees")
    print(f"surest half: mean {surest.mean():.1f}, worst {surest.max():.1f} degrees")


if __name__ == "__main__":
    main()
