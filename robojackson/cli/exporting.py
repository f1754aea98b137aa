"""Write a motion or a policy in the file format of another project, without importing Prefect.

The content of the file determines the possible formats: a robot's motion, a person's motion or a
policy.
"""

import os
import shlex
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from robojackson.cli import cards, console
from robojackson.cli.lifetime.interruption import python
from robojackson.cli.trackers.named_tracker import is_tracker
from robojackson.errors import BadConfiguration, UnknownName
from robojackson.files.foreign_file import require_file
from robojackson.formats import registry
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.retarget.scorecard_gate import BARS, scorecard_record
from robojackson.robot.sampling import frame_count

POLICY_SUFFIX, LEAST_STRICT = ".safetensors", 0.9
DEPLOY = "deploy"
"""The format that is a folder: a policy with everything that a robot needs to run it."""


@dataclass(frozen=True)
class PackInputs:
    """What goes into a deploy pack beside the policy.

    Attributes:
        reference: The motion; None takes the one beside the policy.
        evaluation: evaluation.json; None takes the one beside the policy.
        licences: Licences of inputs by kind.
    """

    reference: Path | None = None
    evaluation: Path | None = None
    licences: Mapping[str, str] = field(default_factory=dict)


def export(
    source: Path,
    to: str,
    out: Path,
    robot: str | None = None,
    pack: PackInputs | None = None,
) -> dict[str, Any]:
    """Write a robot's motion, a person's motion or a policy as `to`; `deploy` writes a folder.

    Raises:
        UnknownName: no such format, or none for what the file holds.
        RejectedReference: the robot's model has changed since the motion was made.
        BadPolicy: the file is not a policy of ours.
        MissingDependency: the package that writes the format is not installed.
        StoreError: the file cannot be read, or the result not written.
    """
    from robojackson.api.motions import read_motion, require_another, write_motion

    began = time.monotonic()
    tracker = is_tracker(source)
    if to == DEPLOY and (source.suffix == POLICY_SUFFIX or tracker):
        return _deploy(source, out, robot, pack or PackInputs(), began)
    if pack is not None and pack != PackInputs():
        raise BadConfiguration("--reference, --evaluation and --licence are for --to deploy")
    require_another(source, out)
    if tracker:
        raise BadConfiguration(f"tracker {str(source)!r} can be written as {DEPLOY} alone")
    require_file(source, usual=("reference.parquet", "smpl.parquet", "policy.safetensors"))
    about: dict[str, Any]
    if source.suffix == POLICY_SUFFIX:
        from robojackson.api.foreign_files import write_policy

        if to not in (known := _policy_formats()):
            raise UnknownName("format", to, f"--to; {source} holds a policy", known)
        policy = write_policy(source, out, to)
        about = {"observations": policy.observation_size, "actions": policy.action_size}
        about |= _policy_verdict(out)
    else:
        write_motion(source, out, to, robot)
        motion = read_motion(source)
        if isinstance(motion, SmplSequence):
            about = {"frames": len(motion), "fps": motion.fps, **_person_verdict(motion, to, out)}
        else:
            about = {"robot": motion.robot, **_frames(motion, to)}
            about |= _robot_verdict(motion, source)
    figures = {"file": str(out), "format": to, **about, "bytes": out.stat().st_size}
    return figures | {"seconds": time.monotonic() - began}


def _deploy(
    source: Path, out: Path, robot: str | None, pack: PackInputs, began: float
) -> dict[str, Any]:
    """Write a deploy pack of a policy or a tracker; its verdict names what is missing."""
    from robojackson.api.deploy_pack import write_deploy_pack
    from robojackson.api.feedback_pack import write_feedback_pack

    said: dict[str, Any] = {"evaluation": pack.evaluation, "licences": pack.licences}
    if source.suffix != POLICY_SUFFIX:
        if pack.reference is None:
            raise BadConfiguration(
                f"a pack of tracker {str(source)!r} needs the motion: --reference reference.parquet"
            )
        with console.stages() as progress:
            made = write_feedback_pack(
                str(source), pack.reference, out, robot=robot, progress=progress, **said
            )
    else:
        with console.stages() as progress:
            made = write_deploy_pack(
                source, out, reference=pack.reference, robot=robot, progress=progress, **said
            )
    made = dict(made)
    missing = _open_points(made)
    kind = "incomplete" if missing else "written"
    sentence = "The pack runs without RoboJackson. " + (
        f"Open: {'; '.join(missing)}." if missing else "Nothing is open; read its README.md."
    )
    rights = {f"may_{name}": answer for name, answer in made.pop("licences").items()}
    made["files"] = len(made["files"])
    verdict = {"verdict": {"kind": kind, "sentence": sentence}}
    following = {"next": pack_command(out)}
    figures = {"folder": str(out), "format": DEPLOY, **made, **rights}
    return figures | {"seconds": time.monotonic() - began} | verdict | following


def pack_command(folder: Path) -> str:
    """Return the command that runs a deploy pack, in MuJoCo's viewer where a window can be opened:
    macOS allows it to `mjpython` alone, which the package mujoco installs."""
    viewed = has_screen()
    interpreter = "mjpython" if viewed and sys.platform == "darwin" else python()
    return shlex.join([interpreter, str(folder / "run.py"), *(["--view"] if viewed else [])])


def has_screen() -> bool:
    """Return whether a window can be opened here."""
    variables = ("DISPLAY", "WAYLAND_DISPLAY")
    return sys.platform in ("darwin", "win32") or any(map(os.environ.get, variables))


def _open_points(made: Mapping[str, Any]) -> list[str]:
    """Return what a deploy pack still lacks."""
    found, weakest = [], made["weakest_strict_success"]
    if weakest is None:
        found.append("no sim-to-sim passport (evaluate --passport)")
    elif weakest < LEAST_STRICT:
        row = f"{made['weakest_case']}, strict success {100 * weakest:.0f} %"
        found.append(f"the passport's weakest row: {row} (train --robust holds more)")
    if made["unknown_licences"]:
        found.append(f"licences unknown: {', '.join(made['unknown_licences'])} (--licence)")
    return found


def _policy_verdict(out: Path) -> dict[str, object]:
    sentence = "The file computes the policy: observations in, actions out."
    check = f"import onnxruntime as o; print(o.InferenceSession({str(out)!r}).get_inputs())"
    following = shlex.join([python(), "-c", check])
    return {"verdict": {"kind": "written", "sentence": sentence}, "next": following}


def _person_verdict(motion: SmplSequence, to: str, out: Path) -> dict[str, object]:
    seconds, fps = len(motion) / motion.fps, motion.fps
    sentence = f"The whole motion is in the file: {seconds:.1f} s at {fps:.4g} frames a second."
    verdict: dict[str, object] = {"verdict": {"kind": "written", "sentence": sentence}}
    if to not in registry.importers():
        return verdict
    folder = out.with_name(f"{out.stem}_imported")
    return verdict | {"next": cards.command_line("import", out, "-o", folder)}


def _frames(motion: ReferenceMotion, to: str) -> dict[str, float]:
    """Return number and rate of the frames in the file of a robot's motion."""
    fps = registry.robot_exporters()[to].fps
    return {"frames": frame_count(motion, fps), "fps": fps or 1.0 / motion.dt}


def _robot_verdict(motion: ReferenceMotion, source: Path) -> dict[str, object]:
    """Return the verdict on a robot's motion from its own score card, which an export does not
    change."""
    card, folder = scorecard_record(motion), source.parent
    verdict = cards.retarget_verdict(card)
    if not set(BARS) & set(card):
        sentence = "The motion has no score card: no check that the robot can do it was made."
        verdict = {"kind": "unchecked", "sentence": sentence}
    person, robot = folder / "smpl.parquet", motion.robot_file or motion.robot
    if verdict["kind"] == "feasible" or not person.is_file():
        return {"verdict": verdict}
    words = ("retarget", person, "-o", folder, "--robot", robot)
    return {"verdict": verdict, "next": cards.command_line(*words)}


def licences_from(declared: Sequence[str]) -> dict[str, str]:
    """Return the licences that a user declared as KIND=LICENCE.

    Raises:
        BadConfiguration: a declaration has no kind.
    """
    pairs = [one.partition("=") for one in declared]
    for kind, equals, licence in pairs:
        if not (kind.strip() and equals and licence.strip()):
            raise BadConfiguration(
                f"--licence {kind}: expected KIND=LICENCE, such as clip=CC-BY-4.0"
            )
    return {kind.strip(): licence.strip() for kind, _, licence in pairs}


def _policy_formats() -> Mapping[str, object]:
    return {**registry.policy_exporters(), DEPLOY: None}


def names() -> list[str]:
    """Return the possible formats by the kind of file."""
    kinds: dict[str, Mapping[str, object]] = {
        "a robot's motion": registry.robot_exporters(),
        "a person's motion": registry.person_exporters(),
        "a policy": _policy_formats(),
    }
    return [f"{kind}: {', '.join(sorted(found))}" for kind, found in kinds.items()]
