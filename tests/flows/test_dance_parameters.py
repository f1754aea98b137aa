"""The deployment's parameters `instant` and `robust`, and the time that its bar gives a tracker."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import flows.dance
from flows.cli.commands import INSTANT_MINUTES, SEARCH_MINUTES, instant_minutes
from robojackson.cli.trackers.tracker_files import add_tracker
from robojackson.errors import BadConfiguration
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.rl.config.track_config import RandomConfig
from robojackson.rl.evaluation.passport import ROBUST
from tests.fixtures.stand_in_tracker import NAME, stand_in, write_yaml


class Chosen(Exception):
    """The stages would begin now, with these settings."""


@pytest.fixture
def settings_of(
    monkeypatch: pytest.MonkeyPatch, store_folder: Path
) -> Callable[..., PipelineConfig]:
    """Return a function that starts the flow with parameters and returns its stages' settings."""
    found: list[PipelineConfig] = []

    @asynccontextmanager
    async def no_videos(*words: object) -> AsyncIterator[list[Path]]:
        yield []

    async def stages(store: object, paths: object, settings: PipelineConfig, *trim: object) -> None:
        found.append(settings)
        raise Chosen

    monkeypatch.setattr(flows.dance, "videos_of", no_videos)
    monkeypatch.setattr(flows.dance, "make_dance", stages)

    def started(**given: Any) -> PipelineConfig:
        with pytest.raises(Chosen):
            asyncio.run(flows.dance.dance.fn("clip.mp4", **given))
        return found.pop()

    return started


@pytest.mark.parametrize(
    ("given", "overrides", "instant"),
    [(True, {}, True), (False, {}, False), (False, {"instant": True}, True)],
)
def test_the_flow_s_parameter_reaches_the_settings(
    settings_of: Callable[..., PipelineConfig],
    given: bool,
    overrides: dict[str, Any],
    instant: bool,
) -> None:
    assert settings_of(overrides=overrides, instant=given).instant == instant


@pytest.mark.parametrize(("robot", "observation"), [("humanoid", "full"), ("g1", "onboard")])
def test_a_robust_dance_varies_the_physics_and_gets_a_passport(
    settings_of: Callable[..., PipelineConfig], robot: str, observation: str
) -> None:
    """A robot with feedback observes its own measurements; what is given comes first."""
    usual, found = settings_of(robot=robot), settings_of(robot=robot, robust=True)
    assert (usual.train.track.random, usual.evaluate.passport) == (RandomConfig(), False)
    assert (found.train.track.random, found.evaluate.passport) == (ROBUST, True)
    assert found.train.track.observation == observation
    assert (usual.setup, found.setup) == ("scratch", "robust")
    own = {"train.track.random.pushes": 0.5, "train.track.observation": "preview", "setup": "mine"}
    chosen = settings_of(robot=robot, robust=True, overrides=own)
    assert chosen.train.track.random == replace(ROBUST, pushes=0.5)
    assert (chosen.train.track.observation, chosen.setup) == ("preview", "mine")


def test_whole_sections_among_the_overrides_leave_a_dance_robust(
    settings_of: Callable[..., PipelineConfig],
) -> None:
    """As a deployment's form invites; what a section says of the ranges is kept."""
    sections = {"train": {"seed": 3}, "evaluate": {"seconds": 5}}
    found = settings_of(robot="g1", robust=True, overrides=sections)
    assert (found.train.seed, found.evaluate.seconds) == (3, 5)
    assert (found.train.track.random, found.evaluate.passport) == (ROBUST, True)
    said = {"train": {"track": {"random": {"pushes": 0.5}}}, "evaluate": {"passport": False}}
    found = settings_of(robot="g1", robust=True, overrides=said)
    assert found.train.track.random == replace(ROBUST, pushes=0.5)
    assert not found.evaluate.passport


@pytest.mark.parametrize(
    ("own", "observation"),
    [
        ({"train.track.control.feedback": 0}, "full"),
        ({"train.track.control.law": "hold"}, "full"),
        ({"train.track.control.root_state": "exact"}, "full"),
        ({"train.start": "walker"}, "full"),
        ({"train.track.observation": "preview"}, "preview"),
        ({"robot": "humanoid", "train.track.control.feedback": 1}, "onboard"),
    ],
)
def test_a_robust_dance_observes_own_measurements_on_top_of_feedback_alone(
    settings_of: Callable[..., PipelineConfig], own: dict[str, Any], observation: str
) -> None:
    found = settings_of(robust=True, overrides={"robot": "g1", **own})
    assert found.train.track.observation == observation
    assert found.train.track.random == ROBUST


def test_the_paper_s_mode_cannot_be_robust(settings_of: Callable[..., PipelineConfig]) -> None:
    with pytest.raises(BadConfiguration, match="mode=paper has no varied physics"):
        asyncio.run(
            flows.dance.dance.fn("clip.mp4", robust=True, overrides={"train.mode": "paper"})
        )


@pytest.mark.parametrize("given", [{"instant": True}, {"overrides": {"instant": True}}])
def test_an_instant_dance_cannot_be_robust(
    settings_of: Callable[..., PipelineConfig], given: dict[str, Any]
) -> None:
    with pytest.raises(BadConfiguration, match="trains nothing: leave out instant, or robust"):
        asyncio.run(flows.dance.dance.fn("clip.mp4", robust=True, **given))


def test_the_bar_gives_the_regulator_the_minutes_of_its_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    regulated = PipelineConfig(robot="g1", instant=True, tracker="regulator")
    assert instant_minutes(regulated) == INSTANT_MINUTES + SEARCH_MINUTES
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "store"))
    file, description = stand_in(tmp_path)
    write_yaml(description, tmp_path / "configs")
    monkeypatch.setenv("ROBOJACKSON_CONFIGS", str(tmp_path / "configs"))
    add_tracker(NAME, file)
    assert instant_minutes(PipelineConfig(robot="humanoid", instant=True)) == INSTANT_MINUTES
