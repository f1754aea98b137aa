"""The walkers that trainings start from, as short as a training can be."""

import json
import shlex
from pathlib import Path

import pytest

from robojackson.cli.learning import walker_training
from robojackson.errors import BadConfiguration, RejectedReference
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
    assert (found.name, made) == ("reference.parquet", [found.parent] * 2)
    assert (found.parent.parent, found.parent.name[:5]) == (tmp_path, "walk-")
    found.parent.mkdir()
    found.write_bytes(b"the walk of this robot")
    assert walker_training._reference("track", tmp_path, robot) == found
    strong = load_robot(load(RobotDescription, "robots/humanoid_strong"))
    other = walker_training._reference("track", tmp_path, strong)
    assert other.parent != found.parent  # the same model with other motors


def test_a_robot_that_cannot_walk_so_is_told_what_pretrain_takes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refusing(source: Path, out: Path, *rest: object) -> None:
        out.mkdir(exist_ok=True)
        (out / "reference.parquet").touch()
        raise RejectedReference("too fast", "try a slower tempo", forcible=True)

    monkeypatch.setattr("robojackson.cli.stages.mocap", lambda *rest: None)
    monkeypatch.setattr("robojackson.cli.stages.retarget", refusing)
    robot = load_robot(load(RobotDescription, "robots/humanoid"))
    for _ in range(2):
        with pytest.raises(RejectedReference, match=r"walk: too fast; .* --reference REFERENCE$"):
            walker_training._reference("track", tmp_path, robot)


@pytest.mark.parametrize("kind", ["track", "paper"])
def test_critics_from_a_walker_are_as_those_from_scratch(kind: str) -> None:
    """Or a comparison of both would compare critics."""
    walked = load(TrainConfig, f"setups/walker-{kind}")
    learnt = load(TrainConfig, "setups/scratch", {"mode": kind})
    shipped = pretrained("walker", kind)
    assert shipped is not None
    assert walked.tqc.layer_norm == learnt.tqc.layer_norm == shipped.layer_norm
