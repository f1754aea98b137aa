"""What the training process says, takes for granted and leaves behind."""

import os
import signal
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from robojackson.api import policy_training
from robojackson.api.trained_policy import TrainedPolicy
from robojackson.cli.learning import training_process, training_request
from robojackson.cli.lifetime import interruption
from robojackson.cli.lifetime.interruption import UNSAVED
from robojackson.cli.lifetime.orphans import VARIABLE, holding
from robojackson.errors import BadConfiguration, RejectedReference
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load
from robojackson.rl import training
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.policy import Policy
from robojackson.rl.training_hooks import Hooks
from robojackson.robot.model import RobotDescription, load_robot

NAN = float("nan")
ROW = {"steps": 1000, "steps_per_s": 500.0, "survived_s": NAN, "site_error_m": NAN}
ROW |= {"episode_return": NAN, "seconds_left": 65.0}


@pytest.fixture
def budgets(monkeypatch: pytest.MonkeyPatch) -> list[TrainConfig]:
    """Return the configurations of trainings, each of which is refused."""
    seen: list[TrainConfig] = []

    def refuse(motion, robot, config: TrainConfig, *rest, **more) -> None:
        seen.append(config)
        raise RejectedReference("no")

    monkeypatch.setattr(policy_training, "read_if_path", lambda kind, path: None)
    humanoid = load_robot(load(RobotDescription, "robots/humanoid"))
    monkeypatch.setattr(policy_training, "robot_of", lambda motion: humanoid)
    monkeypatch.setattr(training, "train_policy", refuse)
    monkeypatch.setattr(policy_training, "audit_both_readings", lambda *what: {})
    monkeypatch.setattr(training_process.signal, "signal", lambda *wish: None)
    return seen


def test_before_the_first_episode_there_are_dashes() -> None:
    result = "    1,000 steps  500/s  survived - s  error - cm  return -  1:05 left"
    assert training_process.status(ROW) == result


def test_a_refused_training_leaves_nothing(budgets: list, tmp_path: Path) -> None:
    with pytest.raises(RejectedReference):
        training_process.train(
            tmp_path / "reference.parquet", tmp_path / "a" / "b", None, {}, force=True
        )
    assert list(tmp_path.iterdir()) == []


def test_a_motion_without_a_score_card_is_not_trained_on(
    budgets: list, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The gate of `dance` holds for `train` alone, too; --force goes on."""
    unseen = SimpleNamespace(scorecard={}, certificate=None)
    monkeypatch.setattr(policy_training, "read_if_path", lambda kind, path: unseen)
    with pytest.raises(RejectedReference, match=r"no score card.*--force"):
        training_process.train(tmp_path / "reference.parquet", tmp_path / "a", None, {})
    assert budgets == []


@pytest.mark.parametrize(
    ("given", "budget"),
    [({}, (None, 9.0)), ({"steps": 10}, (10, None)), ({"minutes": 2.0}, (None, 2.0))],
)
def test_a_training_without_a_budget_gets_the_usual_one(
    given: dict, budget: tuple, budgets: list[TrainConfig], tmp_path: Path
) -> None:
    with pytest.raises(RejectedReference):
        training_process.train(tmp_path / "reference.parquet", tmp_path, None, given, force=True)
    assert [(config.steps, config.minutes) for config in budgets] == [budget]


def written(folder: Path, text: str) -> str:
    path = folder / "mine.yaml"
    path.write_text(text)
    return str(path)


def test_a_configuration_of_dance_trains_with_its_section(tmp_path: Path) -> None:
    config = written(tmp_path, "train: {seed: 3, tqc: {batch: 64}}\n")
    expected = training_request.requested(config, None, {})
    assert (expected.train.seed, expected.train.tqc.batch, expected.gate) == (3, 64, True)
    assert expected.train == load(PipelineConfig, config).train


@pytest.mark.parametrize("key", ["seed", "train.seed"])
def test_what_is_typed_wins_over_the_configuration(key: str, tmp_path: Path) -> None:
    config = written(tmp_path, "gate: false\ntrain: {seed: 3}\n")
    expected = training_request.requested(config, None, {key: "4"})
    assert (expected.train.seed, expected.gate) == (4, False)


def test_a_wrong_key_of_the_configuration_is_named_with_its_path(tmp_path: Path) -> None:
    config = written(tmp_path, "train: {tqc: {bach: 64}}\n")
    with pytest.raises(BadConfiguration, match=r"mine\.yaml: .*'train\.tqc\.bach'.*mean 'batch'"):
        training_request.requested(config, None, {})


def test_a_setup_beside_a_configuration_is_refused(tmp_path: Path) -> None:
    config = written(tmp_path, "train: {seed: 3}\n")
    with pytest.raises(BadConfiguration, match=r"--setup pretrain: give one"):
        training_request.requested(config, "pretrain", {})


def test_the_reward_audit_is_one_line() -> None:
    found = {"root": {"perfect_step": 4.9, "statue": 1.002, "flail": 0.978}}
    assert (
        training_process.format_reward_audit(found)
        == "of a perfect dance's reward: (root) statue 100 %, flail 98 %"
    )


@pytest.mark.parametrize(
    ("given", "found"),
    [("pretrain", "setups/pretrain"), ("setups/x", "setups/x"), ("a.yaml", "a.yaml"), (None, None)],
)
def test_a_bare_name_is_one_of_the_setups(given: str | None, found: str | None) -> None:
    assert policy_training.setup_file(given) == found


@pytest.mark.parametrize(
    ("given", "setup", "name"),
    [
        ({}, None, "scratch"),
        ({"start": "walker"}, None, "pretrain"),
        ({"start": "walker", "curiosity": "formula"}, None, "curiosity"),
        ({"curiosity": "formula"}, None, "scratch-curiosity"),
        ({"start": "walker"}, "mine/slow.yaml", "slow"),
    ],
)
def test_a_run_is_called_by_its_file_or_by_what_it_does(
    given: dict[str, str], setup: str | None, name: str
) -> None:
    common = policy_training._labels(TrainConfig(**given), "walk", setup, "")  # type: ignore[arg-type]
    assert (common["setup"], common["run_id"]) == (name, f"walk-{name}-s0")


@pytest.mark.parametrize(
    ("setup", "reward", "name", "terms"),
    [
        (None, None, "mine.2", {"bonus": len}),
        ("setups/pretrain", abs, "pretrain", {"bonus": len, "own": abs}),
    ],
)
def test_reward_terms_and_setup_of_the_hooks_are_those_of_the_training(
    setup: str | None,
    reward: Callable[..., Any] | None,
    name: str,
    terms: dict[str, Callable[..., Any]],
    budgets: list,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    """Both were dropped, and a training went on without the term."""
    seen: list[Hooks] = []

    def learn(motion, robot, config: TrainConfig, out: Path, hooks: Hooks) -> None:
        seen.append(hooks)
        raise RejectedReference("no")

    monkeypatch.setattr(training, "train_policy", learn)
    with pytest.raises(RejectedReference):
        policy_training.train_policy(
            tmp_path / "reference.parquet", setup=setup, reward=reward, force=True,
            hooks=Hooks(rewards={"bonus": len}, setup="mine.2"),
        )  # fmt: skip
    assert [(hooks.setup, hooks.rewards) for hooks in seen] == [(name, terms)]


@pytest.mark.parametrize(
    "words", [["--steps", "64"], ["--set", "train.steps=64"], ["--set=train.cpu_minutes=.01"]]
)
def test_after_a_training_that_learnt_nothing_no_other_budget_is_left(
    words: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With `--set train.steps=64` the next command learnt nothing again."""
    monkeypatch.setattr(interruption.sys, "argv", ["robojackson", "train", "a.parquet", *words])
    trained = TrainedPolicy(Policy((), {}), None, TrainConfig(), [], 64, 0, 1.0, "steps", {})  # type: ignore[arg-type]
    answer = training_process._answer(trained, Path("a.parquet"), Path("policy.safetensors"), None)
    assert answer["next"] == "robojackson train a.parquet --minutes 10"


def test_after_a_training_signals_are_what_they_were(tmp_path: Path) -> None:
    request, before = training_process._StopRequest(tmp_path), signal.getsignal(signal.SIGINT)
    with request.listening():
        assert signal.getsignal(signal.SIGINT) == request.receive
        request.unsaved.set()
    assert signal.getsignal(signal.SIGINT) is before
    assert not request.unsaved.is_set


def test_a_second_signal_does_not_wait_for_a_checkpoint(tmp_path: Path) -> None:
    request = training_process._StopRequest(tmp_path)
    assert not request()
    request.receive(2, None)
    assert request()
    with pytest.raises(KeyboardInterrupt):
        request.receive(2, None)


def test_under_a_supervisor_a_second_signal_does_not_cut_a_checkpoint_short(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The supervisor and the task each send one; ending at once is the supervisor's part."""
    monkeypatch.setenv(VARIABLE, "mark")
    request = training_process._StopRequest(tmp_path)
    request.receive(15, None)
    request.receive(15, None)
    assert request()


def test_what_is_first_learnt_after_the_signal_does_not_delay_the_end(tmp_path: Path) -> None:
    request = training_process._StopRequest(tmp_path)
    request.receive(2, None)
    request.mark_unsaved()
    assert not request.unsaved.is_set


@pytest.mark.parametrize("has_learnt", [False, True])
def test_a_checkpoint_is_announced_where_there_is_learning_to_save(
    has_learnt: bool, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    request = training_process._StopRequest(tmp_path)
    if has_learnt:
        request.mark_unsaved()
    request.receive(2, None)
    request.unsaved.clear()
    assert (f"with a checkpoint in {tmp_path}" in capfd.readouterr().err) == has_learnt


def test_a_signal_before_any_learning_finds_the_flag_down(
    budgets: list, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The flag is what the supervisor waits for: the training's hook sets it, the end clears it."""
    flags: list[tuple[bool, set[int]]] = []
    ours = {os.getpid()}

    def learn(motion, robot, config: TrainConfig, out: Path, hooks: Hooks) -> None:
        flags.append((False, holding(UNSAVED, ours)))
        hooks.on_learning()
        flags.append((True, holding(UNSAVED, ours)))
        raise RejectedReference("no")

    monkeypatch.setattr(training, "train_policy", learn)
    with pytest.raises(RejectedReference):
        training_process.train(
            tmp_path / "reference.parquet", tmp_path / "out", None, {}, force=True
        )
    assert flags == [(False, set()), (True, ours)]
    assert holding(UNSAVED, ours) == set()
