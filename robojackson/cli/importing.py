"""A human motion in the file format of another project, to our own table, with no Prefect."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from robojackson.cli import stages
from robojackson.errors import BadConfiguration, BadTable, StoreError
from robojackson.formats.foreign_motion import (
    Y_UP_TO_WORLD,
    Z_UP_TO_WORLD,
    ForeignMotion,
    HybrikMotion,
)
from robojackson.formats.format import Importer
from robojackson.formats.registry import recognise
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline import tables
from robojackson.pipeline.yaml_loader import load

LARGEST = 2**30
"""Bytes of a file that is read."""
SLOWEST, FASTEST = 1.0, 1000.0
"""Frames a second."""
AXES = {"y": Y_UP_TO_WORLD, "z": Z_UP_TO_WORLD}
Up = Literal["y", "z"]


def import_motion(
    file: Path,
    out: Path,
    fps: float | None,
    up: Up | None,
    config: str,
    overrides: stages.Overrides,
) -> dict[str, Any]:
    """smpl.parquet of a file of another project.

    Raises:
        StoreError: the file cannot be read, or the folder not written.
        UnknownName, BadTable: nobody's file, a damaged one, or one that asks to run something.
        BadConfiguration: a frame rate that no file of motion has, or axes that the file has not.
    """
    from robojackson.mocap.imported_motion import (
        ground_foreign_motion,
        ground_hybrik_motion,
        kinematics_error_mm,
    )
    from robojackson.pipeline.pipeline_config import PipelineConfig

    began = time.monotonic()
    settings = load(PipelineConfig, config, overrides)
    data = _bytes_of(file)
    importer = recognise(data, str(file))
    with _naming_the_file(file):
        motion = importer.read(data)
    rate, notes = _rate(motion, importer, fps)
    figures: dict[str, Any] = {}
    if isinstance(motion, HybrikMotion):
        if up:
            raise BadConfiguration("--up is for files with a world; HybrIK's are in camera axes")
        with _naming_the_file(file):
            sequence = ground_hybrik_motion(motion, rate, settings.mocap)
        figures["kinematics_error_mm"] = kinematics_error_mm(motion)
    else:
        axes = motion.to_world if up is None else AXES[up]
        with _naming_the_file(file):
            sequence = ground_foreign_motion(replace(motion, to_world=axes), rate)
    sequence = replace(sequence, notes=(*sequence.notes, *notes))
    with stages.results_in(out) as files:
        files.write("smpl.parquet", tables.encode(sequence))
    told = {"smpl": str(out / "smpl.parquet"), "file": str(file), "format": importer.name}
    seconds = time.monotonic() - began
    return told | figures | _figures(sequence) | {"seconds": seconds}


@contextmanager
def _naming_the_file(file: Path) -> Iterator[None]:
    """What is wrong is told with the file's name."""
    try:
        yield
    except BadTable as cause:
        raise BadTable(f"{file}: {cause}") from cause


def _bytes_of(file: Path) -> bytes:
    if file.is_dir():
        raise StoreError(f"{file}: a folder, not a file")
    if not file.is_file():
        raise StoreError(f"{file}: no such file")
    if (size := file.stat().st_size) > LARGEST:
        raise StoreError(f"{file}: {size} bytes; at most {LARGEST} are read")
    return file.read_bytes()


def _rate(
    motion: ForeignMotion | HybrikMotion, importer: Importer, given: float | None
) -> tuple[float, list[str]]:
    """Frames a second, and what the user should know of them."""
    told = motion.fps if isinstance(motion, ForeignMotion) else None
    rate = given or told or importer.fps
    if rate is None:
        raise BadConfiguration(
            f"this {importer.name} file does not say its frame rate: give it with --fps"
        )
    if not SLOWEST <= rate <= FASTEST:
        raise BadConfiguration(
            f"{rate:g} frames a second: wanted {SLOWEST:g} to {FASTEST:g}; give it with --fps"
        )
    if given and told and abs(given - told) > 0.01:
        return rate, [f"the file says {told:g} frames a second: {given:g} was given"]
    if not given and not told:
        return rate, [f"the file does not say its frame rate: taken as {rate:g}; --fps changes it"]
    return rate, []


def _figures(sequence: SmplSequence) -> dict[str, Any]:
    return {
        "frames": len(sequence),
        "fps": sequence.fps,
        "lowest_keypoint_m": float(sequence.keypoints_w[..., 2].min()),
        "contact_share": float(np.mean((sequence.contact != 0).any(1))),
        "notes": list(sequence.notes),
    }
