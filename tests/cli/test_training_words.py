"""The command that goes on with a training."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from robojackson.cli.training_words import train_longer
from robojackson.rl.config.train_config import TrainConfig

USUAL = TrainConfig()


def folder_of(config: TrainConfig, tmp_path: Path) -> Path:
    (tmp_path / "checkpoint").mkdir()
    facts = {"configuration": {**asdict(config), "task": {"robot": "humanoid"}}}
    (tmp_path / "checkpoint" / "run.json").write_text(json.dumps(facts))
    return tmp_path


@pytest.mark.parametrize(
    ("config", "words"),
    [
        (USUAL, ""),
        (replace(USUAL, seed=3), " --set=seed=3"),
        (replace(USUAL, tqc=replace(USUAL.tqc, warmup=200)), " --set=tqc.warmup=200"),
        (replace(USUAL, trainer="sb3"), " --set=trainer=sb3"),
    ],
)
def test_it_names_every_setting_that_the_checkpoint_insists_on(
    config: TrainConfig, words: str, tmp_path: Path
) -> None:
    folder = folder_of(config, tmp_path)
    result = train_longer(Path("r.parquet"), folder, 20)
    assert result == f"robojackson train r.parquet -o {folder} --minutes 20{words}"


def test_a_folder_without_a_checkpoint_is_trained_from_the_start(tmp_path: Path) -> None:
    assert train_longer(Path("r"), tmp_path, 20).endswith("--minutes 20")
