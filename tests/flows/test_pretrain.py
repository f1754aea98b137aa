"""Flow `pretrain`: its process dies with it, and its folder of work is one training's alone."""

import asyncio
from pathlib import Path
from typing import Any

import pytest

from flows import pretrain
from robojackson.cli import stages
from robojackson.cli.learning import walker_training
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.rl.walkers import walker_file
from robojackson.robot.model import load_robot
from storage.store import Store
from tests.fixtures.commands import robojackson
from tests.fixtures.own_robot import own_robot


@pytest.fixture
def commands(store_folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Return the commands of simulated processes, which leave a walker in their folder."""
    commands: list[list[str]] = []

    async def play(command: list[str], run_id: str, work: Path, *rest: Any) -> bytes:
        commands.append(command)
        kind = command[command.index("--kind") + 1]
        for name in (f"walker_{kind}.safetensors", "walker.json", "checkpoint.zip"):
            (work / name).write_text(f"{name} of {work.name}")
        return b""

    monkeypatch.setattr(pretrain, "run_process", play)
    return commands


def train(kind: str = "paper", **given: Any) -> str:
    return asyncio.run(pretrain.pretrain.fn(kind, **given))


def folder_of(command: list[str]) -> Path:
    return Path(command[command.index("-o") + 1])


def test_the_walker_is_kept_and_its_folder_of_work_is_gone(
    commands: list[list[str]], store_folder: Path
) -> None:
    key = train(steps=64)
    (command,) = commands
    result = f"walker_paper.safetensors of {folder_of(command).name}"
    assert Store(store_folder).read(key).decode() == result
    assert not folder_of(command).exists()


def test_trainings_that_differ_share_no_folder(commands: list[list[str]]) -> None:
    for given in ({"steps": 64}, {"steps": 65}, {"steps": 64, "seed": 1}):
        train(**given)
    train("track", steps=64)
    assert len({folder_of(command) for command in commands}) == len(commands)


def test_the_walker_of_another_robot_is_what_its_trainings_start_from(
    commands: list[list[str]], store_folder: Path, tmp_path: Path
) -> None:
    file = own_robot(tmp_path / "mine")
    model = file.parent / "model.xml"
    model.write_text(model.read_text().replace('armature="1"', 'armature="2"'))
    key = train("track", steps=64, robot=str(file))
    (command,) = commands
    assert command[command.index("--robot") + 1] == str(file)
    assert walker_file(describe_robot(str(file)), "track") == store_folder / key


def test_a_configuration_that_was_changed_starts_again(
    commands: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    train(steps=64)
    monkeypatch.setattr(pretrain, "PIPELINE", "smoke")
    train(steps=64)
    assert folder_of(commands[0]) != folder_of(commands[1])


@pytest.mark.medium
def test_a_walker_whose_flow_is_gone_is_not_trained(tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = robojackson("pretrain", "--kind", "paper", "-o", out, "--steps", 64, "--parent", 1)
    assert "the process that started this training is gone" in result.err
    assert not out.exists()


def test_the_process_is_reported_whose_it_is(
    commands: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pretrain.os, "getpid", lambda: 4321)
    train(steps=64)
    assert commands[0][commands[0].index("--parent") + 1] == "4321"


def test_the_bundled_walk_is_found_from_any_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found: list[bool] = []
    monkeypatch.setattr(stages, "mocap", lambda video, *rest: found.append(video.is_file()))
    monkeypatch.setattr(stages, "retarget", lambda *given: None)
    humanoid = load_robot(describe_robot("humanoid"))
    walker_training._reference("track", tmp_path, humanoid)
    assert found == [True]
