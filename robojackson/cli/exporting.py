"""A motion or a policy in the file format of another project, from file to file, with no Prefect.

What the file holds decides which formats fit: a robot's motion, a person's motion or a policy.
"""

import shlex
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from robojackson.cli import cards
from robojackson.files.table_file import require_file
from robojackson.formats import registry
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.retarget.scorecard_gate import BARS, scorecard_record

POLICY_SUFFIX = ".safetensors"


def export(source: Path, to: str, out: Path, robot: str | None = None) -> dict[str, Any]:
    """Write a robot's motion, a person's motion or a policy as `to`.

    Raises:
        UnknownName: no such format, or none for what the file holds.
        RejectedReference: the robot's model has changed since the motion was made.
        BadPolicy: it is no policy file of ours.
        MissingDependency: the package that writes the format is not installed.
        StoreError: the file cannot be read, or the result not written.
    """
    from robojackson.api.motions import read_motion, require_another, write_motion

    began = time.monotonic()
    require_another(source, out)
    require_file(source)
    about: dict[str, Any]
    if source.suffix == POLICY_SUFFIX:
        from robojackson.api.foreign_files import write_policy
        from robojackson.rl.policy import load_policy

        write_policy(source, out, to)
        policy = load_policy(source)
        about = {"observations": policy.observation_size, "actions": policy.action_size}
        about |= _policy_verdict(out)
    else:
        write_motion(source, out, to, robot)
        motion = read_motion(source)
        if isinstance(motion, SmplSequence):
            about = {"frames": len(motion), "fps": motion.fps, **_person_verdict(motion, out)}
        else:
            about = {"robot": motion.robot, "steps": len(motion)}
            about |= _robot_verdict(motion, source)
    figures = {"file": str(out), "format": to, **about, "bytes": out.stat().st_size}
    return figures | {"seconds": time.monotonic() - began}


def _policy_verdict(out: Path) -> dict[str, Any]:
    sentence = "The file computes what the policy does: observations in, actions out."
    check = f"import onnxruntime as o; print(o.InferenceSession({str(out)!r}).get_inputs())"
    following = shlex.join(["python", "-c", check])
    return {"verdict": {"kind": "written", "sentence": sentence}, "next": following}


def _person_verdict(motion: SmplSequence, out: Path) -> dict[str, Any]:
    seconds, fps = len(motion) / motion.fps, motion.fps
    sentence = f"The whole motion is in the file: {seconds:.1f} s at {fps:.4g} frames a second."
    following = cards.command_line("import", out, "-o", out.with_suffix(""))
    return {"verdict": {"kind": "written", "sentence": sentence}, "next": following}


def _robot_verdict(motion: ReferenceMotion, source: Path) -> dict[str, Any]:
    """Judge a robot's motion by its own score card: an export keeps what is wrong with it."""
    card, words = scorecard_record(motion), ("train", source, "-o", source.parent / "training")
    verdict = cards.retarget_verdict(card)
    if not set(BARS) & set(card):
        sentence = "The motion has no score card: nothing has checked that the robot can do it."
        verdict = {"kind": "unchecked", "sentence": sentence}
    if verdict["kind"] != "feasible":
        words = ("retarget", source.parent / "smpl.parquet", "-o", source.parent)
    return {"verdict": verdict, "next": cards.command_line(*words)}


def names() -> list[str]:
    """Return the formats that something can be written in, by what a file has to hold."""
    kinds: dict[str, Mapping[str, object]] = {
        "a robot's motion": registry.robot_exporters(),
        "a person's motion": registry.person_exporters(),
        "a policy": registry.policy_exporters(),
    }
    return [f"{kind}: {', '.join(sorted(found))}" for kind, found in kinds.items()]
