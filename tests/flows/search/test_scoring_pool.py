"""Candidates are scored by threads, or by Dask on request, and come out the same."""

import asyncio
import sys
from pathlib import Path
from typing import Any

import pytest
from prefect import flow
from prefect.task_runners import TaskRunner, ThreadPoolTaskRunner
from prefect_dask import DaskTaskRunner

from flows.search.scoring_pool import VARIABLE, scorers
from flows.video_pass.scored_candidates import score_all
from robojackson.clips.trim import trim
from robojackson.errors import MissingDependency
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load

ROOT = Path(__file__).parents[3]


def test_threads_score_by_themselves() -> None:
    assert isinstance(scorers({}), ThreadPoolTaskRunner)


def test_a_cluster_that_is_there_is_used() -> None:
    pool = scorers({VARIABLE: "tcp://127.0.0.1:8786"})
    assert isinstance(pool, DaskTaskRunner)
    assert pool.address == "tcp://127.0.0.1:8786"


def test_dask_that_is_not_installed_is_reported_in_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "prefect_dask", None)
    with pytest.raises(MissingDependency, match=r"pip install 'robojackson\[dask\]'"):
        scorers({VARIABLE: "local"})


def scores(runner: TaskRunner[Any], clips: tuple[Path, ...]) -> dict[str, float]:
    settings = load(PipelineConfig, "smoke")

    @flow(task_runner=runner)
    async def score() -> dict[str, float]:
        found = score_all(clips, settings, None, None)
        return {candidate.name: candidate.score.stability_score for candidate in found}

    return asyncio.run(score())


@pytest.mark.slow
def test_a_dask_cluster_gives_the_scores_of_threads(
    records: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = ("hip_shake", "walk")
    clips = tuple(trim(ROOT / f"clips/{n}.mp4", 0.0, 1.0, tmp_path / f"{n}.mp4") for n in names)
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "one"))
    expected = scores(scorers({}), clips)
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "other"))
    assert scores(scorers({VARIABLE: "local"}), clips) == expected
    assert len(expected) == 2
