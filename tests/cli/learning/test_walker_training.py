"""The walkers that trainings start from, as short as a training can be."""

import json
import shlex
from pathlib import Path

import pytest

from robojackson.cli.learning import walker_training
from robojackson.errors import BadConfiguration
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.pretrained import pretrained
from robojackson.rl.tqc.network_arrays import load_networks
from robojackson.robot.model import RobotDescription, load_robot

TINY = {
    "trainer": "sb3",
    "steps": 64,
    "seed": 3,
    **{"tqc.n_envs": 2, "tqc.warmup": 16, "tqc.batch": 8, "tqc.updates_per_round": 1},
}


@pytest.mark.medium
def test_a_walker_for_the_papers_mode_takes_all_348_observations(tmp_path: Path) -> None:
    mine = tmp_path / "reference.parquet"
    mine.write_bytes(b"a dance that the user keeps here")
    made = walker_training.pretrain("paper", tmp_path, None, TINY)
    assert mine.read_bytes() == b"a dance that the user keeps here"
    networks = load_networks(Path(made["walker"]))
    assert networks.observation_size == 348
    assert not networks.tensors["actor.0.weight"][45:].any()
    answer = json.loads((tmp_path / "walker.json").read_text())
    assert shlex.split(answer["command"])[:4] == ["robojackson", "pretrain", "--kind", "paper"]
    assert (answer["seed"], answer["steps"]) == (3, 64)
    assert answer["evaluation"]["episode_return"] > 0
    assert [point["step"] for point in answer["curve"]] == sorted(
        p["step"] for p in answer["curve"]
    )


def test_a_walker_that_follows_no_motion_takes_none(tmp_path: Path) -> None:
    with pytest.raises(BadConfiguration, match="--kind track"):
        walker_training.pretrain("paper", tmp_path, tmp_path / "reference.parquet", TINY)
    assert not list(tmp_path.iterdir())


def test_a_walker_of_another_mode_is_refused_before_any_work(tmp_path: Path) -> None:
    with pytest.raises(BadConfiguration, match="kind 'track' learns in mode track"):
        walker_training.pretrain("track", tmp_path, None, {"mode": "paper"})
    assert not list(tmp_path.iterdir())


def test_a_walker_of_track_does_not_take_what_lies_in_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "reference.parquet").write_bytes(b"a dance that the user keeps here")
    made: list[Path] = []

    def a_stage(source: Path, out: Path, *rest: object) -> None:
        made.append(out)

    monkeypatch.setattr("robojackson.cli.stages.mocap", a_stage)
    monkeypatch.setattr("robojackson.cli.stages.retarget", a_stage)
    robot = load_robot(load(RobotDescription, "robots/humanoid"))
    found = walker_training._reference("track", tmp_path, robot)
    assert (found, made) == (tmp_path / "walk" / "reference.parquet", [tmp_path / "walk"] * 2)


@pytest.mark.parametrize("kind", ["track", "paper"])
def test_critics_from_a_walker_are_as_those_from_scratch(kind: str) -> None:
    """Or a comparison of both would compare critics."""
    walked = load(TrainConfig, f"setups/walker-{kind}")
    learnt = load(TrainConfig, "setups/scratch", {"mode": kind})
    shipped = pretrained("walker", kind)
    assert shipped is not None
    assert walked.tqc.layer_norm == learnt.tqc.layer_norm == shipped.layer_norm
