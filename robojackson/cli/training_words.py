"""The command that continues a training, with the settings in the training's folder."""

import json
from dataclasses import asdict
from pathlib import Path

from robojackson.cli import cards
from robojackson.config import leaves
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.retarget.scorecard_gate import failures
from robojackson.rl.checkpoint_folder import newest_checkpoint
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.policy import load_policy
from robojackson.rl.policy_facts import is_of_another_motion, recorded_law
from robojackson.rl.training_task import completed_settings


def train_this(reference: Path, robot: str | None = None) -> str:
    """Return the command that trains a policy of a motion, in a folder beside it.

    Args:
        robot: What `--robot` was given; None where the motion names its robot.
    """
    words = ("train", reference, "-o", reference.parent / "training")
    return cards.command_line(*words, *cards.of_robot(robot), *_forced(reference))


def train_after(policy: Path, reference: Path, minutes: float, robot: str | None = None) -> str:
    """Return the command after an evaluation of a policy that does not dance: more training, or,
    if it was trained on another motion, a training on this one."""
    if is_of_another_motion(load_policy(policy), ReferenceMotion.load(reference)):
        return train_this(reference, robot)
    return train_longer(reference, policy.parent, minutes, robot)


def train_longer(reference: Path, folder: Path, minutes: float, robot: str | None = None) -> str:
    """Return the command that trains on in a folder, with every setting that is not the default.

    A checkpoint refuses other settings, whether from a file, an option or `--set`.
    """
    words = ("train", reference, "-o", folder, "--minutes", f"{minutes:g}", *cards.of_robot(robot))
    settings = (f"--set={each}" for each in _unusual(folder))
    return cards.command_line(*words, *_forced(reference), *settings)


def _forced(reference: Path) -> tuple[str, ...]:
    """Return the words without which the gate refuses a training of a motion."""
    known = reference.is_file() and failures(ReferenceMotion.load(reference).scorecard)
    return ("--force",) if known else ()


def _unusual(folder: Path) -> list[str]:
    """Return the settings of a training as KEY=VALUE; none where its folder has no checkpoint."""
    checkpoint = newest_checkpoint(folder)
    if checkpoint is None:
        return []
    usual = dict(leaves(json.loads(json.dumps(asdict(TrainConfig())))))
    kept = json.loads((checkpoint / "run.json").read_text())["configuration"]
    own = leaves(completed_settings(kept))
    return [
        f"{key}={value if isinstance(value, str) else json.dumps(value)}"
        for key, value in own
        if key in usual and usual[key] != value
    ]


def is_fed_onboard(policy: Path) -> bool:
    """Return whether a policy needs feedback from an estimated root, which other files than a
    deploy pack do not have."""
    return recorded_law(load_policy(policy)).get("root_state") == "estimated"


def pack_of(tracker: Path, reference: Path, out: Path | None, robot: str | None = None) -> str:
    """Return the command that writes the deploy pack of a tracker.

    Args:
        out: Folder of its evaluation; None where none was written.
        robot: What `--robot` was given; None where the motion names its robot.
    """
    given = () if out is None else ("--evaluation", out)
    words = ("export", tracker, "--to", "deploy", "--reference", reference, *given)
    return cards.command_line(*words, "-o", (out or Path()) / "pack", *cards.of_robot(robot))
