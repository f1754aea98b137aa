"""Each one-stage command answers with its figures, writes its tables, and loads no Prefect."""

from pathlib import Path

import pytest

from robojackson.files import tables
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.table_schemas import EPISODE_RECORD, EVALUATION_RECORD
from tests.fixtures.commands import Said, robojackson

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("stages")]

SMOKE = ("--config", "smoke", "--json")
TINY = (
    "--steps=400",
    "--trainer=sb3",
    "--set=tqc.n_envs=4",
    "--set=tqc.warmup=100",
    "--set=tqc.updates_per_round=1",
    "--set=tqc.batch=32",
    "--set=progress_seconds=0.2",
    "--json",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("stages")


@pytest.fixture(scope="module")
def scored(short_clip: Path) -> Said:
    return robojackson("score", short_clip, *SMOKE)


@pytest.fixture(scope="module")
def captured(short_clip: Path, folder: Path) -> Said:
    return robojackson("mocap", short_clip, "-o", folder, *SMOKE)


@pytest.fixture(scope="module")
def retargeted(captured: Said, folder: Path) -> Said:
    return robojackson("retarget", folder / "smpl.parquet", "-o", folder, *SMOKE)


@pytest.fixture(scope="module")
def trained(retargeted: Said, folder: Path) -> Said:
    return robojackson("train", folder / "reference.parquet", "-o", folder / "run", *TINY)


@pytest.fixture(scope="module")
def evaluated(trained: Said, folder: Path) -> Said:
    policy = folder / "run" / "policy.safetensors"
    return robojackson("evaluate", policy, folder / "reference.parquet", "-o", folder, *SMOKE)


STAGES = ["scored", "captured", "retargeted", "trained", "evaluated"]


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_ends_well(stage: str, request: pytest.FixtureRequest) -> None:
    result: Said = request.getfixturevalue(stage)
    assert result.code == 0, result.err


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_loads_no_prefect(stage: str, request: pytest.FixtureRequest) -> None:
    result: Said = request.getfixturevalue(stage)
    assert not result.loaded_prefect


@pytest.mark.parametrize(
    ("stage", "keys"),
    [
        ("captured", {"frames", "fps", "detected", "floor", "contact_share", "seconds"}),
        ("retargeted", {"scorecard", "steps", "dt", "cyclic"}),
        ("trained", {"policy", "steps", "seconds", "stopped"}),
        (
            "evaluated",
            {"survived_s", "success", "strict_success", "skill", "site_error_m", "limb_gain"}
            | {"baselines"},
        ),
    ],
)
def test_a_stage_answers_with_its_figures(
    stage: str, keys: set[str], request: pytest.FixtureRequest
) -> None:
    result: Said = request.getfixturevalue(stage)
    assert keys <= set(result.answer)


def test_score_answers_for_every_video(scored: Said) -> None:
    keys = {"video", "frames", "fps", "missing_joints", "jitter", "stability_score"}
    assert [keys <= set(video) for video in scored.answer["videos"]] == [True]


def test_mocap_writes_its_tables(captured: Said, folder: Path) -> None:
    found = [
        len(tables.decode(cls, (folder / name).read_bytes(), name))
        for cls, name in ((LandmarkTrack, "landmarks.parquet"), (SmplSequence, "smpl.parquet"))
    ]
    assert found == [captured.answer["frames"]] * 2


def test_retarget_writes_its_table(retargeted: Said, folder: Path) -> None:
    data = (folder / "reference.parquet").read_bytes()
    assert len(tables.decode(ReferenceMotion, data, "f")) == retargeted.answer["steps"]


def test_train_writes_one_row_an_episode(trained: Said, folder: Path) -> None:
    data = (folder / "run" / "episodes.parquet").read_bytes()
    rows = tables.decode_rows(EPISODE_RECORD, data, "f")
    assert len(rows) == trained.answer["episodes"]


def test_evaluate_writes_one_row_a_rollout_of_every_policy(
    trained: Said, evaluated: Said, folder: Path
) -> None:
    data = (folder / "evaluations.parquet").read_bytes()
    rows = tables.decode_rows(EVALUATION_RECORD, data, "f")
    assert {row["step"] for row in rows} == {trained.answer["steps"]}
    known = {"trained", *evaluated.answer["baselines"], *evaluated.answer["variants"]}
    assert {row["policy"] for row in rows} == known


def test_episodes_and_evaluations_of_a_run_can_be_joined(evaluated: Said, folder: Path) -> None:
    episodes = (folder / "run" / "episodes.parquet").read_bytes()
    evaluations = (folder / "evaluations.parquet").read_bytes()
    keys = ("run_id", "move", "setup", "seed")
    found = [
        {tuple(row[key] for key in keys) for row in tables.decode_rows(schema, data, "f")}
        for schema, data in ((EPISODE_RECORD, episodes), (EVALUATION_RECORD, evaluations))
    ]
    assert found[0] == found[1] == {(f"{folder.name}-scratch-s0", folder.name, "scratch", 0)}


def test_training_again_with_the_same_budget_has_nothing_to_do(trained: Said, folder: Path) -> None:
    again = robojackson("train", folder / "reference.parquet", "-o", folder / "run", *TINY)
    assert again.answer["steps"] == trained.answer["steps"]
