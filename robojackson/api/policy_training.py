"""Training: a reference motion in, a policy out."""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from robojackson.api.arguments import (
    FilePath,
    Progress,
    RobotLike,
    counter,
    read_if_path,
    require_robot,
    robot_of,
)
from robojackson.api.robots import load_robot
from robojackson.api.trained_policy import TrainedPolicy
from robojackson.files.file_tree import results_in, without_empty_folders
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.episode_log import EpisodeLog
from robojackson.pipeline.folder_lock import locked
from robojackson.pipeline.run_names import motion_name, require_run_id, run_labels
from robojackson.pipeline.yaml_loader import load, refusal
from robojackson.retarget.scorecard_gate import check, scorecard_record
from robojackson.rl import training
from robojackson.rl.checkpoint_folder import newest_checkpoint
from robojackson.rl.config.train_config import PaperConfig, TrackConfig, TrainConfig
from robojackson.rl.evaluation.reward_audit import audit_both_readings, audit_record
from robojackson.rl.modes.rewards import RewardFunction
from robojackson.rl.policy import load_policy
from robojackson.rl.sim.trainable import require_trainable
from robojackson.rl.training_hooks import Hooks, Row, stopped_by_interrupt
from robojackson.rl.training_task import Task
from robojackson.robot.model import Robot

DEFAULT_MINUTES = 9.0
"""Wall time of a training for which no budget is given."""
SETUPS = {
    (False, False): "scratch",
    (True, False): "pretrain",
    (True, True): "curiosity",
    (False, True): "scratch-curiosity",
}
"""What a configuration is called that no file gave: by whether it starts from networks, and whether
curiosity is paid."""
OF_DANCER = "pretrained-dancer"
"""The same, where it starts from the dancer."""
OWN_REWARD = "own"
"""Name of a reward term that is given as a bare function."""


def train_policy(
    reference: FilePath | ReferenceMotion,
    robot: RobotLike | None = None,
    *,
    config: TrainConfig | None = None,
    setup: FilePath | None = None,
    steps: int | None = None,
    minutes: float | None = None,
    seed: int | None = None,
    reward: RewardFunction | Mapping[str, RewardFunction] | None = None,
    out: FilePath | None = None,
    move: str = "",
    run_id: str = "",
    force: bool = False,
    hooks: Hooks | None = None,
    progress: bool | Callable[[Row], None] = False,
) -> TrainedPolicy:
    """Train a robot to follow a reference motion with TQC.

    Args:
        reference: What `retarget_motion` returned, or its reference.parquet.
        robot: The one that the motion was made for; None finds it by name.
        config: Every number of the training.
        setup: `scratch`, `pretrain` and others of configs/setups, or a file; what the tables call
            it where `config` is given, too.
        steps: Budget in control steps of all simulations, over that of the configuration.
        minutes: Budget of wall time, over that of the configuration; 9 where nothing ends it.
        seed: Seed of networks, environments and replay, over that of the configuration.
        reward: Terms of your own beside the configured ones: a function of `RewardState` that
            returns one number a robot, (N,), or several by name. Not part of a checkpoint.
        out: Folder for checkpoints and tables; the same call resumes from it. None keeps nothing.
        move: Name of the dance in the tables.
        run_id: Name of the run in the tables; made of move, setup and seed when empty.
        force: Train on a motion that the gate refuses, too.
        hooks: Callbacks of progress, how it is stopped, and further reward terms.
        progress: True shows a bar; a function gets a row every few seconds: steps, seconds_left,
            survived_s, site_error_m, episode_return.

    Returns:
        The policy with the table of its episodes.

    Raises:
        RejectedReference: the robot cannot follow the motion, or its model has changed since.
        BadConfiguration: a budget or seed that cannot be; a reward that is no number a robot; a
            checkpoint of another configuration.
        BadPolicy: the networks to start from do not fit.
        StoreError: another training holds the folder.
        KeyboardInterrupt: Ctrl-C, after a checkpoint of what was learnt was written to `out`.
    """
    settings = _configured(config, setup, steps, minutes, seed)
    motion = read_if_path(ReferenceMotion, reference)
    machine = robot_of(motion) if robot is None else require_robot(motion, load_robot(robot))
    require_trainable(machine, settings)
    if not force:
        check(scorecard_record(motion))
    name = move or ("motion" if isinstance(reference, ReferenceMotion) else motion_name(reference))
    labels = _labels(settings, name, setup, run_id, hooks.setup if hooks else "")
    heard = replace(_paying(hooks or Hooks(), reward), setup=labels["setup"])
    with _folder(out) as folder, _telling(progress, f"training {name}") as report:
        return _trained(motion, machine, settings, folder, labels, heard, report)


def _labels(
    config: TrainConfig, move: str, setup: FilePath | None, run_id: str, named: str = ""
) -> dict[str, Any]:
    """Return the labels of the run's rows; `named` is the setup's name where no file gives one."""
    usual = SETUPS[config.start != "scratch", config.curiosity != "off"]
    usual = OF_DANCER if config.start == "dancer" else usual
    labels = run_labels(move, Path(setup).stem if setup else named or usual, config.seed)
    return labels | ({"run_id": require_run_id(run_id)} if run_id else {})


def _trained(
    motion: ReferenceMotion,
    robot: Robot,
    config: TrainConfig,
    folder: Path,
    labels: Mapping[str, object],
    hooks: Hooks,
    report: Callable[[Row], None],
) -> TrainedPolicy:
    """Train in a folder that is locked meanwhile; its table is saved in any case."""
    with without_empty_folders(folder), results_in(folder) as files, locked(folder):
        if resumes := newest_checkpoint(folder) is not None:
            Task.of(motion, robot).require_own(folder, config)
        rows = EpisodeLog(files, labels, resumes=resumes)
        audit: dict[str, dict[str, float]] = {}

        def paying(environment: TrackConfig | PaperConfig) -> None:
            audit.update(audit_record(audit_both_readings(robot, motion, environment)))
            hooks.audited(audit)
            hooks.paying(environment)

        try:
            joined = replace(_joined(hooks, rows, report), paying=paying)
            with stopped_by_interrupt(joined) as stoppable:
                result = training.train_policy(motion, robot, config, folder, stoppable)
        finally:
            if len(rows):
                rows.save()
        if not len(rows):
            rows.save()
        return TrainedPolicy(
            load_policy(result.policy), motion, config, rows.rows, result.steps,
            result.updates, result.seconds, result.stopped, audit,
        )  # fmt: skip


def _configured(
    config: TrainConfig | None,
    setup: FilePath | None,
    steps: int | None,
    minutes: float | None,
    seed: int | None,
) -> TrainConfig:
    """Return the configuration with what was given over it, and the usual budget where it has
    none."""
    found = config or load(TrainConfig, setup_file(setup))
    try:
        found = replace(
            found,
            steps=found.steps if steps is None else steps,
            minutes=found.minutes if minutes is None else minutes,
            seed=found.seed if seed is None else seed,
        )
    except ValidationError as cause:
        raise refusal(TrainConfig, cause, "train_policy") from cause
    return found if found.has_budget else replace(found, minutes=DEFAULT_MINUTES)


def setup_file(name: FilePath | None) -> str | None:
    """Return the name for the loader: a bare name is one of configs/setups."""
    if name is None:
        return None
    text = str(name)
    return text if {"/", "."} & set(text) else f"setups/{text}"


def _paying(hooks: Hooks, reward: RewardFunction | Mapping[str, RewardFunction] | None) -> Hooks:
    """Return hooks with the reward terms of an argument beside their own."""
    if reward is None:
        return hooks
    named = reward if isinstance(reward, Mapping) else {OWN_REWARD: reward}
    return replace(hooks, rewards={**hooks.rewards, **named})


def _joined(hooks: Hooks, rows: EpisodeLog, report: Callable[[Row], None]) -> Hooks:
    """Return the caller's hooks, with the table of episodes and the bar of ours."""

    def progress(row: Row) -> None:
        hooks.progress(row)
        report(row)

    def sink(new: list[Row]) -> None:
        rows.add(new)
        hooks.sink(new)

    def saving() -> None:
        rows.save()
        hooks.saving()

    return replace(hooks, progress=progress, sink=sink, saving=saving)


@contextmanager
def _telling(progress: bool | Callable[[Row], None], label: str) -> Iterator[Callable[[Row], None]]:
    if callable(progress):
        yield progress
        return
    shown: Progress = progress
    with counter(shown, label) as count:

        def report(row: Row) -> None:
            if count is not None:
                spent = row["steps"] / max(row["steps_per_s"], 1e-9)
                count(round(spent), round(spent + row["seconds_left"]))

        yield report


@contextmanager
def _folder(out: FilePath | None) -> Iterator[Path]:
    """Yield the folder of a training: the caller's, or a temporary one."""
    if out is not None:
        yield Path(out)
        return
    with tempfile.TemporaryDirectory(prefix="robojackson-") as folder:
        yield Path(folder)
