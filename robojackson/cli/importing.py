"""Convert a human motion of another project's format to our own table, without importing
Prefect."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from robojackson.api.foreign_files import Up, read_foreign
from robojackson.cli import cards
from robojackson.cli.mocap_card import TURNED, floor_figures
from robojackson.cli.pictures.motion_source import FILE as SOURCE
from robojackson.cli.pictures.motion_source import import_record
from robojackson.cli.stages import Overrides
from robojackson.files.file_tree import results_in
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.evaluation.verdict import LEAST_MOTION_S

AIRBORNE = 0.2
"""Share of frames with a foot on the floor below which axes or frame rate are doubted."""


def import_motion(
    file: Path,
    out: Path,
    fps: float | None,
    up: Up | None,
    config: str,
    overrides: Overrides,
) -> dict[str, Any]:
    """Write smpl.parquet from a file of another project, and source.json, which names the file.

    Raises:
        StoreError: the file cannot be read, or the folder not written.
        UnknownName, BadTable: the file has an unknown format, is damaged, or would run code.
        BadConfiguration: a frame rate that no motion has, or axes that do not fit the file.
    """
    from robojackson.pipeline.pipeline_config import PipelineConfig

    began = time.monotonic()
    settings = load(PipelineConfig, config, overrides)
    read = read_foreign(file, fps, up, settings.mocap)
    with results_in(out) as files:
        files.write("smpl.parquet", read.motion.to_bytes())
        files.write(SOURCE, import_record(file, read.format))
    facts = {"smpl": str(out / "smpl.parquet"), "file": str(file), "format": read.format}
    figures = _figures(read.motion)
    following = cards.command_line("retarget", out / "smpl.parquet", "-o", out)
    ends = {"verdict": import_verdict(figures), "next": following}
    return facts | {**read.figures} | figures | ends | {"seconds": time.monotonic() - began}


def import_verdict(figures: Mapping[str, Any]) -> dict[str, str]:
    """Return kind and sentence about an imported motion."""
    seconds, share = figures["frames"] / figures["fps"], figures["contact_share"]
    summary = f"{seconds:.1f} s, with a foot on the floor in {share:.0%} of the frames"
    off = {"hangs": figures["head_down_share"], "lies": figures["lying_share"]}
    how = max(off, key=lambda each: off[each])
    if off[how] > TURNED:
        sentence = f"The trunk {how} in {off[how]:.0%} of the frames ({summary}): is --up right?"
        return {"kind": "turned", "sentence": sentence}
    if share < AIRBORNE:
        sentence = f"The person hardly touches the floor ({summary}): is --up right, or --fps?"
        return {"kind": "airborne", "sentence": sentence}
    if seconds < LEAST_MOTION_S:
        sentence = f"The motion is too short to evaluate a robot on: {summary}."
        return {"kind": "too_short", "sentence": sentence}
    return {"kind": "whole", "sentence": f"The motion stands on the floor: {summary}."}


def _figures(sequence: SmplSequence) -> dict[str, Any]:
    floor = floor_figures(sequence)
    return {
        "frames": len(sequence),
        "fps": sequence.fps,
        "lowest_keypoint_m": float(sequence.keypoints_w[..., 2].min()),
        **{key: floor[key] for key in ("head_down_share", "lying_share")},
        "contact_share": float(np.mean((sequence.contact != 0).any(1))),
        "notes": list(sequence.notes),
    }
