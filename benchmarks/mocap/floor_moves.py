"""Cartwheels and get-ups: errors of motions that the detector hardly sees.

    python -m benchmarks.mocap.floor_moves MOTIONS... [-o renders]

Four renders each of DeepMimic's cartwheel and of its get-up from the face: four sides.
MOTIONS holds `humanoid3d_cartwheel.txt` and `humanoid3d_getup_facedown.txt` (pybullet 3.2.7, whose
source distribution has them). PA-MPJPE of twelve joints over ALL frames; where no person was
detected, raw BlazePose is interpolated, and so is ours. Rows: raw; ours without the pass in reverse
order; ours by the first network alone, which both motions were kept from; ours as shipped, whose
second network descends from weights that had seen them. Bar: 30 % below raw.
"""

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from safetensors.numpy import load_file, save_file

from benchmarks.mocap import figures, fresh
from benchmarks.mocap.steadiness import joints
from benchmarks.mocap.truth import Truth
from robojackson.clips.people.reverse_pass import ReversePassConfig
from robojackson.errors import NoPersonFound
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.mocap.temporal.temporal_lift import WEIGHTS
from robojackson.mocap.temporal.temporal_network import ALSO

MOTIONS, SIDES = ("cartwheel", "getup_facedown"), 4


def make(number: int, files: dict[str, Path], tools: tuple[Any, Any], seed: int) -> dict[str, Any]:
    """Make one render: a motion from one of four sides."""
    from tools.pairs import clips, scenery

    rng = np.random.default_rng([seed, 5, number])
    name = MOTIONS[number // SIDES]
    motion = fresh.part_of(files[name], rng)
    yaw = 2.0 * np.pi * (number % SIDES + rng.uniform(0.0, 1.0)) / SIDES
    angles = scenery.Angles(yaw=yaw, pitch=float(np.radians(rng.uniform(0.0, 25.0))), fills=0.75)
    return clips.shoot(name, motion, 1, *tools, rng, angles, False, ReversePassConfig())


def rendered(folders: list[Path], out: Path, seed: int) -> Iterator[tuple[str, Path]]:
    """Yield the renders and their names, made where they are missing."""
    paths = [out / f"floor_{seed}_{number:02d}.npz" for number in range(len(MOTIONS) * SIDES)]
    for number, path in enumerate(fresh.rendered(paths, folders, partial(make, seed=seed))):
        yield f"{MOTIONS[number // SIDES]} {number % SIDES}", path


def first_network(folder: Path) -> Path:
    """Write the first of the shipped networks to a file of its own."""
    path = folder / "first.safetensors"
    arrays = load_file(WEIGHTS)
    save_file({name: each for name, each in arrays.items() if not name.startswith(ALSO)}, path)
    return path


def measure(path: Path, first: Path) -> dict[str, float]:
    """Return the share of detected frames and the error of each row, mm."""
    track, truth = fresh.read(path)
    raw = fresh.raw_joints(path)
    found = {"detected": float(track.detected.mean()), "raw": _error(raw, truth, track.fps)}
    ours = MocapConfig()
    alone = replace(ours, temporal=replace(ours.temporal, weights=str(first)))
    for name, seen, config in (
        ("one pass", fresh.read(path, "first")[0], ours),
        ("first network", track, alone),
        ("ours", track, ours),
    ):
        found[name] = _error(joints(recover_motion(seen, config)), truth, track.fps)
    return found


def _error(points: np.ndarray, truth: Truth, fps: float) -> float:
    return figures.joint_errors(points, truth, fps)["pa_mpjpe_mm"]


def main() -> None:
    """Make what is missing, measure, print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("motions", type=Path, nargs="+")
    parser.add_argument("-o", "--out", type=Path, default=Path("fresh"))
    parser.add_argument("--seed", type=int, default=26)
    options = parser.parse_args()
    names = ("detected", "raw", "one pass", "first network", "ours")
    table, rows = Table("clip", *names), []
    scratch = tempfile.TemporaryDirectory()
    first = first_network(Path(scratch.name))
    for name, path in rendered(options.motions, options.out, options.seed):
        try:
            found = measure(path, first)
        except NoPersonFound as error:
            table.add_row(name, "", str(error))
            continue
        rows.append([found[key] for key in names])
        table.add_row(name, f"{rows[-1][0]:.0%}", *(f"{value:.0f}" for value in rows[-1][1:]))
    mean = np.mean(rows, 0)
    table.add_row("mean", f"{mean[0]:.0%}", *(f"{value:.1f}" for value in mean[1:]))
    scratch.cleanup()
    table.add_row("beside raw", "", "", *(f"{value / mean[1] - 1:+.0%}" for value in mean[2:]))
    Console().print(table)


if __name__ == "__main__":
    main()
