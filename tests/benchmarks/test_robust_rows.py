"""The rows of `train --robust`: which trainings they are, what is kept and what a table shows."""

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.learning import robust_rows
from benchmarks.learning.policies import FROZEN, MOVES, Folders, load
from benchmarks.learning.split import load_split
from robojackson.rl.evaluation.passport import NOMINAL

HERE = Folders.at(None).results / "robust.json"


def case(name: str, strict: float, kept: float) -> dict[str, Any]:
    figures = {"strict_success": strict, "success": strict, "skill": 0.5, "survived_s": 9.0}
    return {"case": name, **figures, "kept": kept, "robust": kept >= 0.9}


def evaluation() -> dict[str, Any]:
    figures = dict.fromkeys(robust_rows.FIGURES, 0.5)
    cases = [case(NOMINAL, 1.0, 1.0), case("pushes", 0.88, 0.88), case("noise", 0.96, 0.96)]
    return {**figures, "robust": False, "passport": cases, "verdict": {"kind": "dances"}}


def test_a_row_is_a_robust_training_of_the_move_s_steps_and_its_passport(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    commands: list[list[str]] = []

    def run(*words: object, core: int | None = None) -> None:
        commands.append([str(word) for word in words])
        assert core == 1
        if words[0] == "evaluate":
            folder = Path(str(words[words.index("-o") + 1]))
            folder.mkdir(parents=True)
            (folder / "evaluation.json").write_text(json.dumps(evaluation()))

    monkeypatch.setattr(robust_rows, "must", run)
    folders = Folders.at(tmp_path)
    row = robust_rows.measured("g1_hip_shake", 100, folders, 1)
    train, evaluate = commands
    assert train[train.index("--steps") + 1] == "500000"
    assert train[train.index("--seed") + 1] == "100"
    assert "--robust" in train
    assert "--passport" in evaluate
    assert row["poses"] == load_split().references["g1_hip_shake"]
    assert [one["case"] for one in robust_rows.missed(row)] == ["pushes"]
    robust_rows.measured("g1_hip_shake", 100, folders, 1)
    assert [words[0] for words in commands[2:]] == ["train"], "an evaluation is not repeated"


def test_rows_are_kept_beside_each_other_and_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, figures = tmp_path / "robust.json", {"steps": 500_000, "poses": "", **evaluation()}
    for name, seed in (("g1_walk", 100), ("g1_hip_shake", 101), ("g1_hip_shake", 100)):
        robust_rows._keep(path, {"move": name, "seed": seed, **figures})
    rows = json.loads(path.read_text())["rows"]
    found = [(row["move"], row["seed"]) for row in rows]
    assert found == [("g1_hip_shake", 100), ("g1_hip_shake", 101), ("g1_walk", 100)]
    assert robust_rows._is_held(path, "g1_walk", 100)
    assert not robust_rows._is_held(path, "g1_walk", 101)
    robust_rows._show(rows)
    shown = capsys.readouterr().out
    assert shown.count("2 of 3") == 3
    assert shown.count("pushes 88%") == 3


def test_the_committed_rows_stand_on_the_frozen_motions() -> None:
    references = load_split().references
    rows = json.loads(HERE.read_text())["rows"]
    assert rows
    for row in rows:
        assert row["poses"] == references[row["move"]]
        assert row["passport"][0]["case"] == NOMINAL
        strict = row["passport"][0]["strict_success"]
        kept = [one["strict_success"] / strict if strict else None for one in row["passport"]]
        assert [one["kept"] for one in row["passport"]] == pytest.approx(kept)
        assert row["robust"] == (not robust_rows.missed(row))


def test_the_usual_moves_are_rows_of_the_g1() -> None:
    assert set(robust_rows.DEFAULT) <= set(robust_rows.TRAINED)
    assert all(MOVES[name].robot == "g1" for name in robust_rows.TRAINED)
    assert not any(name.endswith("_onboard") for name in robust_rows.TRAINED)
    assert load(FROZEN / "g1_hip_shake.parquet").cyclic
