"""Inputs of a policy, as far as the files beside it show, for the licence passport."""

import hashlib
import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from robojackson.errors import StoreError
from robojackson.files.foreign_file import read_json, read_text
from robojackson.formats.deploy.licence_passport import (
    OF_CLIP,
    UNKNOWN,
    Ingredient,
    robot_ingredient,
    runner_ingredients,
)
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.rl.policy import Policy
from robojackson.rl.walkers import SCRATCH, STARTS, start_name
from robojackson.robot.model import Robot

LANDMARKS, PERSON, SOURCE = "landmarks.parquet", "smpl.parquet", "source.json"
SPDX = re.compile(r"^\W*SPDX-License-Identifier:\s*([\w.+ ()-]{1,60})", re.MULTILINE)
"""The line of a REUSE sidecar that names the licence."""
LONGEST = 60
"""Characters of a licence's name."""
NETWORK_NOTE = "pose by the network"
"""Beginning of the note of a motion that a user's networks recovered."""


def policy_ingredients(
    policy: Policy, path: Path, reference: Path, robot: Robot
) -> list[Ingredient]:
    """List the inputs of a policy; what no file records is unknown.

    Args:
        path: The policy's file.
        reference: The motion's file, beside or above which its landmarks lie if it is of a video.
    """
    return [
        Ingredient("weights", "the policy", "own", "trained here", _sha256(path)),
        *_start(str(policy.facts.get("start", UNKNOWN))),
        *motion_ingredients(reference, robot, network=True),
    ]


def motion_ingredients(reference: Path, robot: Robot, network: bool) -> list[Ingredient]:
    """List the inputs of a pack beside what drives it: the motion's, the robot and the software."""
    return [
        clip_ingredient(reference),
        *_body_models(reference),
        motion_ingredient(reference, _sha256(reference)),
        robot_ingredient(robot.description, robot.sha256),
        Ingredient("software", "run.py and the texts of the pack", "Apache-2.0", "RoboJackson"),
        *runner_ingredients(network),
    ]


def clip_ingredient(reference: Path) -> Ingredient:
    """Return the clip of a motion, or the file that it was imported from, with the licence that a
    file beside it, or beside the video of which it is a range, states: REUSE's `CLIP.license`, or
    the `.info.json` of a download."""
    name, note = "the video or recording that is danced", "declare it with --licence clip=LICENCE"
    record = _record_of(reference)
    path = record.get("video") or record.get("imported")
    if not path:
        return Ingredient("clip", name, UNKNOWN, f"not stated: {note}")
    clip = Path(str(path))
    kind = f"imported, {record.get('format')}: " if "imported" in record else ""
    digest = str(record.get("sha256", ""))
    licence, where = stated_licence(clip)
    if not licence and "range_of" in record:
        licence, where = stated_licence(Path(str(record["range_of"])))
    if licence:
        return Ingredient("clip", clip.name, licence, f"{kind}stated by {where}", digest)
    return Ingredient("clip", clip.name, UNKNOWN, f"{kind}not stated beside it: {note}", digest)


def motion_ingredient(reference: Path, digest: str) -> Ingredient:
    """Return the reference motion: our own where it was recovered from a video here; as its file's
    where it was imported.

    Args:
        digest: Of the motion's file.
    """
    name, record = "reference motion", _record_of(reference)
    if "imported" in record:
        clip = clip_ingredient(reference)
        note = f"retargeted here from {clip.name}, {OF_CLIP}"
        return Ingredient("motion", name, clip.licence, note, digest)
    if "video" in record or _folder_with(reference, LANDMARKS):
        return Ingredient("motion", name, "own", "made here, from the clip", digest)
    note = f"no {SOURCE} or {LANDMARKS} is beside it: declare it with --licence motion=LICENCE"
    return Ingredient("motion", name, UNKNOWN, note, digest)


def _record_of(reference: Path) -> Mapping[str, object]:
    """Return what `mocap` or `import` recorded of a motion's source; empty where nothing is."""
    folder = _folder_with(reference, SOURCE)
    with suppress(StoreError):
        found = read_json(folder / SOURCE) if folder else {}
        return found if isinstance(found, dict) else {}
    return {}


def _folder_with(reference: Path, name: str) -> Path | None:
    """Return the folder of the motion, or the one above, that has a file of that name."""
    folders = reference.parent, reference.parent.parent
    return next((folder for folder in folders if (folder / name).is_file()), None)


def stated_licence(clip: Path) -> tuple[str, str]:
    """Return the licence that a sidecar of a clip states and the sidecar's name; empty texts where
    none does."""
    beside = clip.with_name(clip.name + ".license")
    with suppress(StoreError):
        found = SPDX.search(read_text(beside))
        if found:
            return found[1].strip(), beside.name
    info = clip.with_suffix(".info.json")
    with suppress(StoreError):
        facts = read_json(info)
        licence = facts.get("license") if isinstance(facts, dict) else None
        if isinstance(licence, str) and licence.strip():
            return " ".join(licence.split())[:LONGEST], info.name
    return "", ""


def _body_models(reference: Path) -> list[Ingredient]:
    """Return the networks that recovered the motion, if it is of a video."""
    folder = _folder_with(reference, LANDMARKS)
    if folder is None or not (folder / PERSON).is_file():
        note = "no landmarks and motion of a person are beside it: declare them"
        return [Ingredient("body models", "what recovered the motion", UNKNOWN, note)]
    notes = SmplSequence.load(folder / PERSON).notes
    networks = [note for note in notes if note.startswith(NETWORK_NOTE)]
    note = f"{PERSON} beside the motion records it"
    found = [Ingredient("body models", "MediaPipe's pose landmarker", "Apache-2.0", LANDMARKS)]
    if networks:
        return found + [Ingredient("body models", name, UNKNOWN, note) for name in networks]
    ours = "temporal network and skeleton of RoboJackson"
    return [*found, Ingredient("body models", ours, "Apache-2.0", f"{PERSON} names no other")]


def _start(start: str) -> list[Ingredient]:
    """Return the weights that the training began with."""
    if start == SCRATCH:
        return []
    if start in STARTS:
        note = f"RoboJackson's {start} (assets/PROVENANCE.md)"
        return [Ingredient("weights", f"start: {start}", "Apache-2.0", note)]
    return [Ingredient("weights", f"start: {start_name(start)}", UNKNOWN, "the training began so")]


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
