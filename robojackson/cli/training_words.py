"""The command that continues a training, with the settings in the training's folder."""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path

from robojackson.cli import cards
from robojackson.errors import BadConfiguration
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.yaml_loader import load, parsed_overrides
from robojackson.retarget.scorecard_gate import failures
from robojackson.rl.checkpoint_folder import newest_checkpoint
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.evaluation.verdict import longer_minutes
from robojackson.rl.policy import load_policy
from robojackson.rl.policy_facts import is_of_another_motion, recorded_law
from robojackson.rl.sim.trainable import require_trainable
from robojackson.rl.training_task import completed_settings
from robojackson.robot.model import Robot

CHOICES = ("mode", "tqc.preset", "paper.preset")
"""Settings that decide the defaults of others, each before those that it decides."""


def train_this(reference: Path, robot: str | None = None) -> str:
    """Return the command that trains a policy of a motion, in a folder beside it.

    Args:
        robot: What `--robot` was given; None where the motion names its robot.
    """
    return _command(reference, *cards.of_robot(robot), *_forced_of(reference))


def next_of_retargeting(
    reference: Path, card: Mapping[str, float], robot: Robot, config: TrainConfig
) -> dict[str, str]:
    """Return the command that trains a policy of a motion that was just written, as `next`; as
    `hint` what must be mended first, where no training on the robot is possible.

    Args:
        card: Score card of the motion.
    """
    try:
        require_trainable(robot, config)
    except BadConfiguration as cause:
        return {"hint": str(cause)}
    return {"next": _command(reference, *_forced(card))}


def train_after(policy: Path, reference: Path, minutes: float, robot: str | None = None) -> str:
    """Return the command after an evaluation of a policy that does not dance: more training, or,
    if it was trained on another motion, a training on this one."""
    if is_of_another_motion(load_policy(policy), ReferenceMotion.load(reference)):
        return train_this(reference, robot)
    return train_longer(reference, policy.parent, minutes, robot)


def train_longer(reference: Path, folder: Path, minutes: float, robot: str | None = None) -> str:
    """Return the command that trains on in a folder, with every setting that is not the default.

    A checkpoint refuses other settings, whether from a file, an option or `--set`.

    Args:
        minutes: Least budget, minutes; a training that has used half of it gets more, since a
            budget counts every sitting.
    """
    checkpoint = newest_checkpoint(folder)
    state = {} if checkpoint is None else json.loads((checkpoint / "run.json").read_text())
    budget = math.ceil(max(minutes, longer_minutes(state.get("seconds", 0.0) / 60)))
    words = ("train", reference, "-o", folder, "--minutes", budget, *cards.of_robot(robot))
    settings = (f"--set={each}" for each in _unusual(state.get("configuration", {})))
    return cards.command_line(*words, *_forced_of(reference), *settings)


def _command(reference: Path, *options: str) -> str:
    return cards.command_line("train", reference, "-o", reference.parent / "training", *options)


def _forced(card: Mapping[str, float]) -> tuple[str, ...]:
    """Return the words without which the gate refuses a training of a motion with a score card."""
    return ("--force",) if failures(card) else ()


def _forced_of(reference: Path) -> tuple[str, ...]:
    return _forced(ReferenceMotion.load(reference).scorecard) if reference.is_file() else ()


def _unusual(kept: Mapping[str, object]) -> list[str]:
    """Return the settings of a checkpoint as KEY=VALUE that are not the defaults of its mode and
    presets."""
    own, chosen = completed_settings(kept), dict[str, str]()
    for key in CHOICES:
        apart = dict(_differences(load(TrainConfig, None, chosen), own))
        if key in apart:
            chosen[key] = _as_yaml(apart[key])
    rest = _differences(load(TrainConfig, None, chosen), own)
    found = chosen | {key: _as_yaml(value) for key, value in rest}
    return [f"{key}={value}" for key, value in found.items()]


def _differences(usual: object, kept: object, key: str = "") -> Iterator[tuple[str, object]]:
    """Yield what a checkpoint holds where it differs from a configuration, by key path; a mapping
    that is no section is one value."""
    if not (is_dataclass(usual) and isinstance(kept, Mapping)):
        if kept != json.loads(json.dumps(usual)):
            yield key, kept
        return
    for one in fields(usual):
        if one.name in kept:
            inner = f"{key}.{one.name}" if key else one.name
            yield from _differences(getattr(usual, one.name), kept[one.name], inner)


def _as_yaml(value: object) -> str:
    """Return a value as `--set` reads it, text quoted only where YAML would read something else."""
    if not isinstance(value, str):
        return json.dumps(value)
    try:
        is_plain = parsed_overrides({"": value}) == {"": value}
    except BadConfiguration:
        is_plain = False
    return value if is_plain else json.dumps(value, ensure_ascii=False)


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
