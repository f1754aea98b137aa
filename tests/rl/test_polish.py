"""When a training begins with what the feedback alone does."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from robojackson.api import policy_training
from robojackson.files.json_types import to_json_types
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.yaml_loader import build, load
from robojackson.rl.config.tqc_config import PRESETS, ActorStart
from robojackson.rl.config.train_config import TqcConfig, TrackConfig, TrainConfig
from robojackson.rl.evaluation.reward_audit import audit_both_readings, audit_record
from robojackson.rl.policy_facts import fact
from robojackson.rl.polish import paid_environment, polishes, residual_learning, sharper
from robojackson.rl.training import _warn_of_no_learning, _warn_of_short_budget, train_policy
from robojackson.robot.model import Robot


@pytest.fixture
def fed(robot: Robot) -> Robot:
    """Return a robot whose feedback follows a sampled path."""
    named = replace(robot.description, feedback=1.0, feedback_path="sampled")
    return replace(robot, description=named)


def configured(**named: object) -> TrainConfig:
    """Return a training of 100 steps with some settings."""
    return load(TrainConfig, "setups/scratch", {"steps": 100, **named})


def test_a_motion_that_ends_is_polished(fed: Robot, sway: ReferenceMotion) -> None:
    ending = replace(sway, cyclic=False)
    tqc = residual_learning(configured(), fed, ending, 0.5)
    assert {name: getattr(tqc, name) for name in PRESETS["polish"]} == PRESETS["polish"]
    assert replace(tqc, **{n: getattr(configured().tqc, n) for n in PRESETS["polish"]}) == (
        configured().tqc
    )


def test_what_is_set_by_hand_goes_before_the_preset_of_a_polish(
    fed: Robot, sway: ReferenceMotion
) -> None:
    ending = replace(sway, cyclic=False)
    own = {"tqc.burn_in": 40, "tqc.action_penalty": 0.01}
    tqc = residual_learning(configured(**own), fed, ending, 0.5)
    assert (tqc.burn_in, tqc.action_penalty) == (40, 0.01)
    assert tqc.log_std_init == PRESETS["polish"]["log_std_init"]


def by_hand(name: str, value: object, tmp_path: Path) -> TrainConfig:
    """Return a training of which one number is set by `--set`."""
    return configured(**{f"tqc.{name}": yaml.safe_dump(value)})


def in_python(name: str, value: object, tmp_path: Path) -> TrainConfig:
    """Return a training of which one number is set in Python."""
    return replace(configured(), tqc=TqcConfig(**{name: value}))  # type: ignore[arg-type]


def written(name: str, value: object, tmp_path: Path) -> TrainConfig:
    """Return a training whose whole configuration was written and read, as a pass does it."""
    file = tmp_path / "setup.yaml"
    file.write_text(yaml.safe_dump(to_json_types(by_hand(name, value, tmp_path))))
    return load(TrainConfig, str(file))


@pytest.mark.parametrize("way", [by_hand, in_python, written])
@pytest.mark.parametrize(("name", "value"), asdict(ActorStart()).items())
def test_a_default_that_is_set_by_hand_goes_before_the_preset_of_a_polish(
    fed: Robot, sway: ReferenceMotion, tmp_path: Path,
    name: str, value: object, way: Callable[[str, object, Path], TrainConfig],
) -> None:  # fmt: skip
    config = way(name, value, tmp_path)
    start = residual_learning(config, fed, replace(sway, cyclic=False), 0.5).actor_start
    assert asdict(start) == {**PRESETS["polish"], name: value}


def test_a_configuration_that_was_written_is_polished_as_the_one_before(
    fed: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    file = tmp_path / "setup.yaml"
    file.write_text(yaml.safe_dump(to_json_types(configured())))
    tqc = residual_learning(load(TrainConfig, str(file)), fed, replace(sway, cyclic=False), 0.5)
    assert asdict(tqc.actor_start) == PRESETS["polish"]


def test_null_is_not_given_beside_a_preset() -> None:
    """A file that was written whole holds nulls; a preset beside them gives its own numbers."""
    nulls = dict.fromkeys(asdict(ActorStart()))
    found = build(TqcConfig, {"preset": "polish", **nulls}, "tqc")
    assert asdict(found.actor_start) == PRESETS["polish"]


@pytest.mark.parametrize(("steps", "is_short"), [(40, True), (41, False), (None, False)])
def test_a_budget_in_which_the_actor_never_learns_is_reported(
    steps: int | None, is_short: bool, caplog: pytest.LogCaptureFixture
) -> None:
    _warn_of_short_budget(replace(configured().tqc, burn_in=40), steps)
    assert ("for 40 transitions (tqc.burn_in) and the budget is 40" in caplog.text) == is_short


@pytest.mark.parametrize(
    ("steps", "done", "words"),
    [
        (None, 39, "after 39 transitions, and until 40"),
        (100, 39, "the policy is the feedback alone; give it more minutes"),
        (None, 40, ""),
        (40, 39, ""),  # a warning came before
    ],
)
def test_a_training_that_ended_before_its_actor_learnt_is_reported(
    steps: int | None, done: int, words: str, caplog: pytest.LogCaptureFixture
) -> None:
    tqc = replace(configured().tqc, zero_init=True, burn_in=40)
    _warn_of_no_learning(tqc, steps, done)
    assert words in caplog.text
    assert bool(caplog.text) == bool(words)


@pytest.mark.slow
def test_a_time_budget_that_is_over_before_the_burn_in_is_reported(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    tqc = TqcConfig(
        preset="polish", n_envs=2, warmup=8, batch=16, buffer=1000, actor=(8, 8), critic=(8, 8)
    )
    config = replace(configured(), steps=None, minutes=1e-6, tqc=tqc)
    result = train_policy(sway, robot, config, tmp_path / "out")
    assert result.steps < 50_000
    assert "until 50,000 the critics learn alone (tqc.burn_in): the policy is" in caplog.text


def test_a_motion_that_repeats_is_learnt_from_falls(fed: Robot, sway: ReferenceMotion) -> None:
    repeating = replace(sway, cyclic=True)
    for held in (0.89, np.nan):
        assert residual_learning(configured(), fed, repeating, held) == configured().tqc


def test_what_the_feedback_holds_is_polished(fed: Robot, sway: ReferenceMotion) -> None:
    assert polishes(configured(), fed, replace(sway, cyclic=True), 0.9)
    assert not polishes(configured(), fed, [replace(sway, cyclic=True)] * 2, 1.0), "several motions"


@pytest.mark.parametrize(
    "named",
    [
        {"polish": "no"},
        {"trainer": "sb3"},
        {"start": "walker"},
        {"mode": "paper"},
        {"tqc.preset": "released"},
        {"track.control.feedback": 0.0},
        {"track.observation": "preview"},
        {"track.control.feedback_path": "reference"},
        {"track.random.pushes": 1.0},
    ],
    ids=lambda named: "-".join(map(str, *named.items())),
)
def test_other_trainings_are_not(
    fed: Robot, sway: ReferenceMotion, named: Mapping[str, object]
) -> None:
    assert not polishes(configured(**named), fed, replace(sway, cyclic=False), 1.0)


def test_a_policy_of_own_measurements_is_polished_on_the_estimated_root(
    fed: Robot, sway: ReferenceMotion
) -> None:
    onboard = configured(**{"track.observation": "onboard"})
    ending = replace(sway, cyclic=False)
    assert polishes(onboard, fed, ending, 0.5)
    by_exact_root = residual_learning(configured(), fed, ending, 0.5)
    estimated = residual_learning(onboard, fed, ending, 0.5)
    assert 0 < estimated.action_penalty < by_exact_root.action_penalty
    assert replace(estimated, action_penalty=by_exact_root.action_penalty) == by_exact_root


def test_a_narrower_bell_that_is_given_stays() -> None:
    for given, found in ((0.35, 0.15), (0.05, 0.05)):
        environment = sharper(configured(**{"track.reward.narrow": given}).environment)
        assert isinstance(environment, TrackConfig)
        assert (environment.reward.narrow, environment.reward.fine) == (found, 0.8)
    paper = configured(mode="paper").environment
    assert sharper(paper) == paper


def test_a_robot_without_feedback_is_not(robot: Robot, sway: ReferenceMotion) -> None:
    assert not polishes(configured(), robot, replace(sway, cyclic=False), 1.0)


def test_a_training_pays_narrower_bells_where_it_polishes_alone(
    fed: Robot, sway: ReferenceMotion
) -> None:
    ending, named = replace(sway, cyclic=False), configured(**{"tqc.preset": "polish"})
    usual = configured().environment
    assert paid_environment(configured(), fed, ending, np.nan) == sharper(usual) != usual
    assert paid_environment(named, fed, ending, np.nan) == sharper(usual)
    assert paid_environment(configured(polish="no"), fed, ending, np.nan) == usual


@pytest.mark.medium
def test_the_reward_audit_of_a_polish_is_of_the_reward_that_its_policy_records(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    tqc = {"preset": "polish", "n_envs": 2, "steps_per_round": 4, "buffer": 1000, "warmup": 500}
    config = configured(steps=8, tqc=tqc)
    trained = policy_training.train_policy(sway, robot, config=config, force=True, out=tmp_path)
    paid = fact(trained.policy, "environment", TrackConfig)
    assert trained.reward_audit == audit_record(audit_both_readings(robot, sway, paid))
    wider = audit_record(audit_both_readings(robot, sway, config.environment))
    assert trained.reward_audit["track"]["statue"] < wider["track"]["statue"]
