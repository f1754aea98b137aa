"""The parameter `instant` of the deployment, and the time that its bar gives a tracker."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

import flows.dance
from flows.cli.commands import INSTANT_MINUTES, SEARCH_MINUTES, instant_minutes
from robojackson.cli.trackers.tracker_files import add_tracker
from robojackson.pipeline.pipeline_config import PipelineConfig
from tests.fixtures.stand_in_tracker import NAME, stand_in, write_yaml


class Chosen(Exception):
    """The stages would begin now, with these settings."""


@pytest.mark.parametrize(
    ("given", "overrides", "instant"),
    [(True, {}, True), (False, {}, False), (False, {"instant": True}, True)],
)
def test_the_flow_s_parameter_reaches_the_settings(
    monkeypatch: pytest.MonkeyPatch,
    store_folder: Path,
    given: bool,
    overrides: dict[str, Any],
    instant: bool,
) -> None:
    found: list[PipelineConfig] = []

    @asynccontextmanager
    async def no_videos(*words: object) -> AsyncIterator[list[Path]]:
        yield []

    async def stages(store: object, paths: object, settings: PipelineConfig, *trim: object) -> None:
        found.append(settings)
        raise Chosen

    monkeypatch.setattr(flows.dance, "videos_of", no_videos)
    monkeypatch.setattr(flows.dance, "make_dance", stages)
    with pytest.raises(Chosen):
        asyncio.run(flows.dance.dance.fn("clip.mp4", overrides=overrides, instant=given))
    assert [settings.instant for settings in found] == [instant]


def test_the_bar_gives_the_regulator_the_minutes_of_its_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    regulated = PipelineConfig(robot="g1", instant=True, tracker="regulator")
    assert instant_minutes(regulated) == INSTANT_MINUTES + SEARCH_MINUTES
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("ROBOJACKSON_CONFIGS", str(tmp_path / "configs"))
    file, description = stand_in(tmp_path)
    write_yaml(description, tmp_path / "configs")
    add_tracker(NAME, file)
    assert instant_minutes(PipelineConfig(robot="humanoid", instant=True)) == INSTANT_MINUTES
