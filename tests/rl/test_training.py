import dataclasses
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
import torch

from robojackson.errors import BadConfiguration, BadPolicy, StoreError, TrainingDiverged
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl import training
from robojackson.rl.config.train_config import (
    EvaluateConfig,
    PaperConfig,
    RandomConfig,
    TqcConfig,
    TrackConfig,
    TrainConfig,
)
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.env.vec_env import TrackingVecEnv
from robojackson.rl.evaluation.controllers import drivers
from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
from robojackson.rl.evaluation.starts import STAND
from robojackson.rl.policy import Policy, load_policy
from robojackson.rl.policy_facts import OUTLINE, outline_facts
from robojackson.rl.tqc.sb3_trainer import Sb3Trainer, WarmupTQC
from robojackson.rl.tqc.sbx_trainer import SbxTrainer
from robojackson.rl.tqc.trainers import make_trainer
from robojackson.rl.training import Hooks, TrainResult, train_policy
from robojackson.rl.training_run import Run
from robojackson.rl.training_task import Task
from robojackson.robot.model import Robot

pytestmark = pytest.mark.xdist_group("trained")

SMALL = TqcConfig(
    n_envs=4,
    warmup=64,
    batch=32,
    updates_per_round=2,
    buffer=2000,
    actor=(16, 16),
    critic=(16, 16),
)
BRIEF = EvaluateConfig(seconds=0.6, phases=3, resets=2)


def brief(trainer: str, steps: int = 320) -> TrainConfig:
    return TrainConfig(trainer=trainer, steps=steps, tqc=SMALL, progress_seconds=0.01)  # type: ignore[arg-type]


def run(robot: Robot, sway: ReferenceMotion, config: TrainConfig, out: Path) -> TrainResult:
    return train_policy(sway, robot, config, out)


@pytest.fixture(scope="module", params=["sbx", "sb3"])
def trained(
    request: pytest.FixtureRequest,
    robot: Robot,
    sway: ReferenceMotion,
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[TrainResult, list[dict[str, float]], list[dict[str, float]], str]:
    episodes: list[dict[str, float]] = []
    progress: list[dict[str, float]] = []
    result = train_policy(
        sway,
        robot,
        brief(request.param),
        tmp_path_factory.mktemp(request.param),
        Hooks(progress=progress.append, sink=episodes.extend),
    )
    return result, episodes, progress, request.param


@pytest.mark.medium
def test_a_run_in_two_sittings_ends_as_one_that_was_never_stopped(
    trained: tuple, robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    """Networks, optimizers, replay, random numbers and every simulation go on to the bit."""
    whole, episodes, _, name = trained
    rows: list[dict[str, float]] = []
    rounds = iter([False] * 5 + [True])
    with pytest.raises(KeyboardInterrupt):
        train_policy(
            sway, robot, brief(name), tmp_path, Hooks(sink=rows.extend, stop=rounds.__next__)
        )
    result = train_policy(sway, robot, brief(name), tmp_path, Hooks(sink=rows.extend))
    assert result.policy.read_bytes() == whole.policy.read_bytes()
    assert rows == episodes


@pytest.mark.medium
def test_a_run_whose_budget_ends_before_its_first_step_goes_on(
    trained: tuple, robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    """There is no observation yet, and a checkpoint that held none could not be read."""
    whole, _, _, name = trained
    spent = dataclasses.replace(brief(name), minutes=1e-9)
    assert run(robot, sway, spent, tmp_path).steps == 0
    result = run(robot, sway, brief(name), tmp_path)
    assert result.policy.read_bytes() == whole.policy.read_bytes()


@pytest.mark.medium
def test_exploration_that_depends_on_the_state_goes_on_to_the_bit(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    """Its matrix is drawn before the moment at which a checkpoint is written."""
    tqc = dataclasses.replace(SMALL, gsde=True, log_std_init=-2.0)
    config = dataclasses.replace(brief("sb3"), tqc=tqc)
    whole = run(robot, sway, config, tmp_path / "whole")
    rounds = iter([False] * 5 + [True])
    with pytest.raises(KeyboardInterrupt):
        train_policy(sway, robot, config, tmp_path / "halves", Hooks(stop=rounds.__next__))
    halves = run(robot, sway, config, tmp_path / "halves")
    assert halves.policy.read_bytes() == whole.policy.read_bytes()


@pytest.mark.medium
@pytest.mark.parametrize("place", range(4))
def test_a_death_between_two_files_of_the_last_checkpoint_loses_nothing(
    place: int,
    trained: tuple,
    robot: Robot,
    sway: ReferenceMotion,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two policy files take their place, the old checkpoint goes aside, the new one comes."""
    whole, _, _, name = trained
    run(robot, sway, brief(name, 160), tmp_path)
    left = iter(range(place + 1))

    def dies(way: Any) -> Any:
        def moved(*files: Any) -> Any:
            watched = str(files[0]).endswith((".safetensors.part", "checkpoint", ".new"))
            if watched and next(left) == place:
                raise SystemExit
            return way(*files)

        return moved

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", dies(os.replace))
        patch.setattr(Path, "rename", dies(Path.rename))
        with pytest.raises(SystemExit):
            run(robot, sway, brief(name), tmp_path)
    result = run(robot, sway, brief(name), tmp_path)
    assert result.policy.read_bytes() == whole.policy.read_bytes()


@pytest.mark.medium
def test_both_trainers_end_at_their_budget_with_a_policy(trained: tuple) -> None:
    result, _, _, name = trained
    assert result.steps == 320
    assert result.updates > 0
    assert result.stopped == "steps"
    assert load_policy(result.policy).facts["trainer"] == name


@pytest.mark.medium
def test_every_episode_leaves_a_row_with_each_reward_term(trained: tuple) -> None:
    _, episodes, _, _ = trained
    assert [row["episode"] for row in episodes] == list(range(1, len(episodes) + 1))
    for row in episodes:
        terms = [value for key, value in row.items() if key.startswith("reward_")]
        assert sum(terms) == pytest.approx(row["episode_return"])


@pytest.mark.medium
def test_progress_shows_rate_and_time_left(trained: tuple) -> None:
    _, _, progress, _ = trained
    assert all(row["steps_per_s"] > 0 and row["seconds_left"] >= 0 for row in progress)
    assert progress


@pytest.mark.medium
def test_a_finished_run_given_more_steps_goes_on(
    trained: tuple, robot: Robot, sway: ReferenceMotion
) -> None:
    """Episode numbers, steps and time go on, and so do the updates."""
    result, episodes, _, name = trained
    rows: list[dict[str, float]] = []
    longer = train_policy(
        sway, robot, brief(name, 640), result.policy.parent, Hooks(sink=rows.extend)
    )
    assert longer.steps == 640
    assert longer.seconds > result.seconds
    assert longer.updates > result.updates
    assert rows[0]["episode"] == len(episodes) + 1
    assert rows[0]["step"] > 320


@pytest.mark.medium
def test_a_finished_run_with_the_same_budget_reports_that_no_step_is_added(
    trained: tuple, robot: Robot, sway: ReferenceMotion, caplog: pytest.LogCaptureFixture
) -> None:
    result, _, _, name = trained
    run(robot, sway, brief(name), result.policy.parent)
    assert "no step is added: the steps are used up; give a larger budget" in caplog.text


@pytest.mark.medium
@pytest.mark.parametrize(("polish", "pushes"), [(True, 0.0), (False, 0.0), (True, 1.0)])
def test_a_polish_on_stock_physics_is_written_by_what_was_chosen_and_no_other_training(
    robot: Robot,
    sway: ReferenceMotion,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    polish: bool,
    pushes: float,
) -> None:
    """The choice is made where nothing is disturbed, which is not what a robust one is for."""

    def marked(policy: Policy, **given: object) -> Policy:
        return dataclasses.replace(policy, facts={**policy.facts, "chosen": sorted(given)})

    monkeypatch.setattr(training, "better_of", marked)
    config = brief("sbx")
    tqc = dataclasses.replace(config.tqc, zero_init=polish)
    track = dataclasses.replace(config.track, random=RandomConfig(pushes=pushes))
    config = dataclasses.replace(config, tqc=tqc, track=track)
    found = load_policy(run(robot, sway, config, tmp_path).policy).facts.get("chosen")
    chosen = polish and not pushes
    assert found == (["clip", "reference", "robot", "threads"] if chosen else None)


@pytest.mark.medium
def test_a_polish_that_was_stopped_in_its_last_moment_is_chosen_when_it_goes_on(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[int] = []

    def better(policy: Policy, **_: object) -> Policy:
        tried.append(1)
        return dataclasses.replace(policy, facts={**policy.facts, "beside_feedback": {}})

    monkeypatch.setattr(training, "better_of", better)
    config = brief("sbx")
    config = dataclasses.replace(config, tqc=dataclasses.replace(config.tqc, zero_init=True))
    longer = dataclasses.replace(config, steps=10 * config.steps)
    stops = iter([False] * 8 + [True])
    with pytest.raises(KeyboardInterrupt):
        train_policy(sway, robot, longer, tmp_path, Hooks(stop=lambda: next(stops)))
    assert not tried
    ended = dataclasses.replace(config, steps=1)
    policy = train_policy(sway, robot, ended, tmp_path).policy
    assert load_policy(policy).facts["beside_feedback"] == {}
    train_policy(sway, robot, ended, tmp_path)
    assert tried == [1], "a training that is over was chosen again"


@pytest.mark.medium
def test_a_training_does_not_go_on_along_another_path(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    """As where its folder was copied to a machine that searched another one."""
    config = brief("sbx")
    control = dataclasses.replace(config.track.control, feedback=1.0)
    config = dataclasses.replace(config, track=dataclasses.replace(config.track, control=control))
    file = run(robot, sway, config, tmp_path).policy
    kept = load_policy(file)
    path = np.array(kept.facts[OUTLINE])
    longer = dataclasses.replace(config, steps=640)
    dataclasses.replace(kept, facts={**kept.facts, **outline_facts(path + 0.1)}).save(file)
    with pytest.raises(BadPolicy, match="another path than this machine"):
        run(robot, sway, longer, tmp_path)
    dataclasses.replace(kept, facts={**kept.facts, **outline_facts(path + 0.001)}).save(file)
    assert run(robot, sway, longer, tmp_path).steps == 640


@pytest.mark.medium
def test_a_checkpoint_of_another_configuration_is_refused(
    trained: tuple, robot: Robot, sway: ReferenceMotion
) -> None:
    result, _, _, name = trained
    other = dataclasses.replace(brief(name), seed=5)
    with pytest.raises(BadConfiguration, match="another configuration"):
        run(robot, sway, other, result.policy.parent)


@pytest.mark.medium
def test_another_training_s_folder_is_refused_before_any_work(
    trained: tuple, robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    result, _, _, name = trained
    task = Task.of(sway, robot)
    task.require_own(result.policy.parent, dataclasses.replace(brief(name), steps=9999))
    task.require_own(tmp_path, brief(name))
    with pytest.raises(BadConfiguration, match=r"seed: 0 there, 5 here"):
        task.require_own(result.policy.parent, dataclasses.replace(brief(name), seed=5))


@pytest.mark.medium
def test_a_budget_that_is_over_before_the_first_round_leaves_a_policy_that_has_learnt_nothing(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    config = dataclasses.replace(brief("sbx"), steps=None, minutes=1e-6)
    result = run(robot, sway, config, tmp_path)
    assert (result.steps, result.updates) == (0, 0)
    assert load_policy(result.policy).facts["updates"] == 0


@pytest.mark.medium
def test_a_robot_whose_yaml_was_changed_between_two_sittings_is_refused(
    trained: tuple, robot: Robot, sway: ReferenceMotion
) -> None:
    """Its model is the same file; the gains are not."""
    result, _, _, name = trained
    softer = dataclasses.replace(robot.description, stiffness={".*": 20.0})
    with pytest.raises(BadConfiguration, match="another configuration"):
        run(dataclasses.replace(robot, description=softer), sway, brief(name), result.policy.parent)


@pytest.mark.medium
def test_a_checkpoint_from_before_the_yaml_was_kept_and_ranges_graded_is_continued(
    trained: tuple, robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    result, _, _, name = trained
    shutil.copytree(result.policy.parent, tmp_path / "out")
    (kept,) = (tmp_path / "out").glob("checkpoint*/run.json")
    state = json.loads(kept.read_text())
    del state["configuration"]["task"]["description_sha256"]
    del state["configuration"]["track"]["random"]["least"]
    kept.write_text(json.dumps(state))
    assert run(robot, sway, brief(name), tmp_path / "out").steps == state["steps"]


@pytest.mark.medium
def test_a_polish_is_paid_by_narrower_bells_and_its_policy_says_so(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    usual = brief("sbx")
    reward = usual.track.reward
    wide, sharp = (reward.narrow, reward.fine), (reward.polished_narrow, reward.polished_fine)
    for preset, bells in (("dance", wide), ("polish", sharp)):
        tqc = dataclasses.replace(SMALL, preset=preset)
        config, out = dataclasses.replace(usual, tqc=tqc), tmp_path / preset
        facts = load_policy(run(robot, sway, config, out).policy).facts
        environment = facts["environment"]
        assert isinstance(environment, dict)
        assert (environment["reward"]["narrow"], environment["reward"]["fine"]) == bells
    (kept,) = (tmp_path / "polish").glob("checkpoint*/run.json")
    state = json.loads(kept.read_text())
    for name in ("polished_narrow", "polished_fine"):
        del state["configuration"]["track"]["reward"][name]
    kept.write_text(json.dumps(state))
    with pytest.raises(BadConfiguration, match=r"polished_narrow: 0\.35 there"):
        run(robot, sway, config, out)
    then = dataclasses.replace(reward, polished_narrow=0.35, polished_fine=0.5)
    track = dataclasses.replace(config.track, reward=then)
    assert run(robot, sway, dataclasses.replace(config, track=track), out).steps == state["steps"]


@pytest.mark.medium
def test_a_checkpoint_from_before_returns_over_several_steps_is_continued_with_one(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    one = dataclasses.replace(brief("sbx"), tqc=dataclasses.replace(SMALL, n_steps=1))
    run(robot, sway, one, tmp_path / "out")
    (kept,) = (tmp_path / "out").glob("checkpoint*/run.json")
    state = json.loads(kept.read_text())
    del state["configuration"]["tqc"]["n_steps"]
    kept.write_text(json.dumps(state))
    assert run(robot, sway, one, tmp_path / "out").steps == state["steps"]
    with pytest.raises(BadConfiguration, match="another configuration"):
        run(robot, sway, brief("sbx"), tmp_path / "out")


@pytest.mark.medium
def test_a_checkpoint_from_before_roots_were_estimated_is_continued_where_none_is(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    for kind, continues in (("full", True), ("onboard", False)):
        track = dataclasses.replace(brief("sbx").track, observation=kind)
        config, out = dataclasses.replace(brief("sbx"), track=track), tmp_path / kind
        run(robot, sway, config, out)
        (kept,) = out.glob("checkpoint*/run.json")
        state = json.loads(kept.read_text())
        old = state["configuration"]["track"]["control"]
        del old["root_state"]
        kept.write_text(json.dumps(state))
        if continues:
            assert run(robot, sway, config, out).steps == state["steps"]
        else:
            with pytest.raises(BadConfiguration, match=r"control\.feedback: 0\.0 there, null here"):
                run(robot, sway, config, out)
            control = dataclasses.replace(track.control, feedback=0.0)
            then = dataclasses.replace(config, track=dataclasses.replace(track, control=control))
            assert run(robot, sway, then, out).steps == state["steps"]


@pytest.mark.medium
@pytest.mark.parametrize("part", ["run.json", "networks.*", "environment.npz"])
def test_a_damaged_checkpoint_is_refused_by_its_name(
    trained: tuple, robot: Robot, sway: ReferenceMotion, tmp_path: Path, part: str
) -> None:
    result, _, _, name = trained
    shutil.copytree(result.policy.parent, tmp_path / "out")
    file = next((tmp_path / "out" / "checkpoint").glob(part))
    file.write_bytes(b"[" * 100_000)
    with pytest.raises(StoreError, match=r"checkpoint: the checkpoint is damaged .*remove it"):
        run(robot, sway, brief(name), tmp_path / "out")


@pytest.mark.medium
def test_a_run_that_begins_again_learns_nothing_from_the_one_before(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    """Only its checkpoint was removed, as the refusal of another configuration says."""
    run(robot, sway, brief("sb3", 480), tmp_path)
    shutil.rmtree(tmp_path / "checkpoint")
    learnt = (tmp_path / "policy.safetensors").read_bytes()
    run(robot, sway, brief("sb3"), tmp_path)
    assert (tmp_path / "before-policy.safetensors").read_bytes() == learnt
    assert (tmp_path / "policy.safetensors").read_bytes() != learnt
    names = sorted(path.name for path in (tmp_path / "replay").iterdir())
    assert [name.split("-")[1] for name in names] == ["000000000080.npz"]


@pytest.mark.medium
def test_a_diverging_training_reports_it_and_keeps_its_policy(
    trained: tuple, robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    name = trained[3]
    run(robot, sway, brief(name, 160), tmp_path)
    kept = (tmp_path / "policy.safetensors").read_bytes()
    rows: list[dict[str, float]] = []

    def spoil(trainer: Any, folder: Path, replay: Path, steps: int, updates: int) -> None:
        load(trainer, folder, replay, steps, updates)
        bias = "mean.bias"
        trainer.start_from({bias: np.full_like(trainer.networks()[bias], np.nan)})

    of = {"sbx": SbxTrainer, "sb3": Sb3Trainer}[name]
    load = of.load
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(of, "load", spoil)
        with pytest.raises(TrainingDiverged, match=r"160 steps.*checkpoint is older"):
            train_policy(sway, robot, brief(name), tmp_path, Hooks(sink=rows.extend))
    assert rows == []
    assert (tmp_path / "policy.safetensors").read_bytes() == kept


@pytest.mark.medium
@pytest.mark.parametrize("gsde", [False, True])
@pytest.mark.parametrize("method", ["train", "_store_transition"])
def test_a_training_that_diverges_within_a_round_of_torch_reports_it(
    method: str, gsde: bool, robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    """Torch refuses the distribution of its actions with a ValueError, before the next check."""
    tqc = dataclasses.replace(SMALL, gsde=gsde)
    config = dataclasses.replace(brief("sb3"), tqc=tqc)
    run(robot, sway, dataclasses.replace(config, steps=160), tmp_path)
    kept = (tmp_path / "policy.safetensors").read_bytes()
    original = getattr(WarmupTQC, method)

    def spoil(model: WarmupTQC, *args: Any, **named: Any) -> None:
        with torch.no_grad():
            for parameter in model.actor.parameters():
                parameter.fill_(torch.nan)
        original(model, *args, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(WarmupTQC, method, spoil)
        with pytest.raises(TrainingDiverged, match=r"not finite .*checkpoint is older"):
            run(robot, sway, config, tmp_path)
    assert (tmp_path / "policy.safetensors").read_bytes() == kept


@pytest.mark.medium
def test_a_checkpoint_of_another_reference_is_refused(
    trained: tuple, robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    result, _, _, name = trained
    other = dataclasses.replace(sway, qpos=sway.qpos + 0.01)
    with pytest.raises(BadConfiguration, match="another reference motion of robot 'humanoid';"):
        run(robot, other, brief(name, 960), result.policy.parent)
    task = dataclasses.replace(Task.of(sway, robot), robot="g1")
    with pytest.raises(BadConfiguration, match=r"training of robot 'humanoid', .* of 'g1';"):
        task.require_same({"task": dataclasses.asdict(Task.of(sway, robot))}, {}, tmp_path)


@pytest.mark.medium
def test_a_crash_between_two_renames_loses_nothing(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    run(robot, sway, brief("sb3"), tmp_path)
    (tmp_path / "checkpoint").rename(tmp_path / "checkpoint.old")
    rows: list[dict[str, float]] = []
    train_policy(sway, robot, brief("sb3", 480), tmp_path, Hooks(sink=rows.extend))
    assert all(row["step"] > 320 for row in rows)


@pytest.mark.medium
@pytest.mark.parametrize("name", ["sbx", "sb3"])
def test_the_policy_file_acts_as_the_trainers_own_actor(
    robot: Robot, sway: ReferenceMotion, name: str
) -> None:
    env = TrackingVecEnv(TrackingCore(robot, sway, TrackConfig(), 4, 0))
    trainer = make_trainer(name, env, SMALL, seed=0)
    observation = env.reset()
    if name == "sbx":
        state = trainer.model.policy.actor_state  # type: ignore[attr-defined]
        mean = state.apply_fn(state.params, observation).mode()
    else:
        mean, _ = trainer.model.predict(observation, deterministic=True)  # type: ignore[attr-defined]
    hidden = observation
    *inner, (weight, bias) = trainer.layers()
    for w, b in inner:
        hidden = np.maximum(hidden @ w + b, 0)
    np.testing.assert_allclose(np.tanh(hidden @ weight + bias), np.asarray(mean), atol=1e-5)


def test_an_interrupted_run_keeps_its_replay(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    with pytest.raises(KeyboardInterrupt):
        train_policy(
            sway, robot, brief("sb3"), tmp_path, Hooks(stop=iter([False, False, True]).__next__)
        )
    state = json.loads((tmp_path / "checkpoint" / "run.json").read_text())
    files = [path.name for path in (tmp_path / "replay").iterdir()]
    assert state["steps"] == 64
    assert files == ["000000000000-000000000016.npz"]


def test_rows_are_safe_before_the_checkpoint_that_follows_them(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    calls: list[str] = []
    hooks = Hooks(
        sink=lambda rows: calls.append("row"),
        saving=lambda: calls.append("checkpoint" if (tmp_path / "checkpoint").exists() else "safe"),
    )
    train_policy(sway, robot, brief("sb3"), tmp_path, hooks)
    assert calls[-1] == "safe"
    assert "row" in calls


@pytest.mark.slow
def test_an_interrupted_run_leaves_no_round_computing(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """XLA computes in a thread of its own; Python crashes when it ends before that thread."""
    states: list[SbxTrainer] = []
    original = SbxTrainer.__init__

    def spy(trainer: SbxTrainer, *args: object) -> None:
        original(trainer, *args)  # type: ignore[arg-type]
        states.append(trainer)

    def interrupt(row: dict[str, float]) -> None:
        if row["updates"] > 0:
            raise KeyboardInterrupt

    monkeypatch.setattr(SbxTrainer, "__init__", spy)
    monkeypatch.setattr(Run, "checkpoint", lambda run: None)
    slow = dataclasses.replace(SMALL, updates_per_round=2000, batch=256)
    config = dataclasses.replace(brief("sbx"), tqc=slow, progress_seconds=1e-9)
    with pytest.raises(KeyboardInterrupt):
        train_policy(sway, robot, config, tmp_path, Hooks(progress=interrupt))
    arrays = jax.tree_util.tree_leaves(states[0]._state())
    assert all(array.is_ready() for array in arrays if isinstance(array, jax.Array))


def test_a_run_without_a_budget_is_refused(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    with pytest.raises(BadConfiguration, match="budget"):
        run(robot, sway, TrainConfig(), tmp_path)


@pytest.mark.medium
def test_the_table_of_an_evaluation_has_every_start_and_baseline(
    trained: tuple, robot: Robot, sway: ReferenceMotion
) -> None:
    result, _, _, _ = trained
    verdict = evaluate_policy(load_policy(result.policy), sway, robot, BRIEF)
    policies = {row["policy"] for row in verdict.rows}
    assert policies == {"trained", "hold", "statue", "mean_pose", "zero_residual", "random"}
    own = [row for row in verdict.rows if row["policy"] == "trained"]
    assert len(own) == 3 * 2 + 1
    assert own[-1]["phase"] == STAND
    assert all(0 <= row["success"] <= 1 for row in verdict.rows)  # type: ignore[operator]
    assert verdict.summary["verdict"]["kind"] == "too_short"  # type: ignore[index]
    assert verdict.summary["success"] is None
    assert set(verdict.summary["baselines"]) == policies - {"trained", "hold"}  # type: ignore[call-overload]


@pytest.mark.parametrize(
    ("facts", "shape", "reason"),
    [
        ({"mode": "paper", "repeats": "often"}, (45, 17), "repeats = 'often'"),
        ({"mode": "paper"}, (45, 3), "gives 3 actions"),
    ],
)
def test_a_policy_that_no_robot_can_follow_is_refused(
    facts: dict[str, Any],
    shape: tuple[int, int],
    reason: str,
    robot: Robot,
    sway: ReferenceMotion,
) -> None:
    layers = ((np.zeros(shape, np.float32), np.zeros(shape[1], np.float32)),)
    policy = Policy(layers, {**facts, "control": {"law": "torque"}})
    with pytest.raises(BadPolicy, match=reason):
        drivers(policy, sway, robot, 0)


@pytest.mark.medium
def test_an_evaluation_is_repeatable(trained: tuple, robot: Robot, sway: ReferenceMotion) -> None:
    result, _, _, _ = trained
    policy = load_policy(result.policy)
    first, second = (evaluate_policy(policy, sway, robot, BRIEF) for _ in range(2))
    np.testing.assert_array_equal(first.rollout_qpos, second.rollout_qpos)


@pytest.mark.medium
def test_a_policy_for_another_robot_is_refused(
    trained: tuple, robot: Robot, sway: ReferenceMotion
) -> None:
    result, _, _, _ = trained
    policy = load_policy(result.policy)
    (weight, bias), *rest = policy.layers
    other = dataclasses.replace(policy, layers=((weight[:-1], bias), *rest))
    with pytest.raises(BadPolicy, match="trained for"):
        evaluate_policy(other, sway, robot, BRIEF)


@pytest.mark.medium
def test_evaluation_needs_neither_jax_nor_torch_nor_prefect() -> None:
    code = (
        "import sys, robojackson.rl.evaluation.policy_evaluation, robojackson.rl.policy\n"
        "heavy = {'jax', 'torch', 'stable_baselines3', 'prefect'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_tensorboard_gets_the_terms_of_the_reward(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    config = dataclasses.replace(brief("sb3"), tensorboard=True)
    train_policy(sway, robot, config, tmp_path)
    events = EventAccumulator(str(tmp_path / "tensorboard")).Reload()
    assert {"survived_s", "reward_joints", "steps_per_s"} <= set(events.Tags()["scalars"])


@pytest.mark.medium
def test_logging_for_tensorboard_needs_no_torch() -> None:
    code = (
        "import sys, pathlib, tempfile\n"
        "from robojackson.rl.tensorboard_log import ScalarLog\n"
        "ScalarLog(pathlib.Path(tempfile.mkdtemp())).add(1, {'a': 1.0})\n"
        "assert 'torch' not in sys.modules and 'tensorflow' not in sys.modules\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.medium
@pytest.mark.parametrize("name", ["sb3"])
def test_paper_mode_trains_from_the_shipped_walker(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path, name: str
) -> None:
    """Ends at its budget in steps, with the walker's layers and every term in its rows."""
    config = TrainConfig(
        mode="paper",
        trainer=name,  # type: ignore[arg-type]
        steps=160,
        start="walker",
        curiosity="formula",
        paper=PaperConfig(seconds=1.0),
        tqc=TqcConfig(preset="paper", warmup=150, batch=8),
    )
    rows: list[dict[str, float]] = []
    result = train_policy(sway, robot, config, tmp_path, Hooks(sink=rows.extend))
    assert result.steps == 160
    assert load_policy(result.policy).observation_size == 348
    assert {"reward_imitation", "reward_curiosity", "error_world_m2"} <= set(rows[0])
