"""The command that `robojackson dance` suggests next."""

import sys

import pytest

from flows.cli import commands
from robojackson.cli.lifetime import interruption
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load


@pytest.fixture(autouse=True)
def typed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["robojackson", "dance", "a.mp4", "--config", "smoke"])


@pytest.mark.parametrize(
    ("kind", "overrides", "message"),
    [
        (
            "too_short",
            {"evaluate.seconds": 0.5},
            "robojackson dance a.mp4 --config smoke --set evaluate.seconds=10",
        ),
        ("too_short", {}, "film or choose a range of at least two seconds (--start, --end)"),
        ("falls", {"minutes": 10}, "robojackson dance a.mp4 --config smoke --minutes 20"),
        (
            "falls",
            {"train.steps": 2000, "train.cpu_minutes": 5},
            "robojackson dance a.mp4 --config smoke --set train.steps=4000 "
            "--set train.cpu_minutes=10",
        ),
        ("dances", {}, f"{interruption.python()} -m webbrowser page.html"),
    ],
)
def test_the_next_command_mends_what_was_wrong(
    kind: str, overrides: dict[str, float], message: str
) -> None:
    settings = load(PipelineConfig, "base", overrides)
    assert commands._next(kind, "page.html", settings) == message


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--set", "minutes=5"], "robojackson dance a.mp4 --minutes 24"),
        (["--set=minutes=5", "--minutes", "3"], "robojackson dance a.mp4 --minutes 24"),
    ],
)
def test_a_setting_of_the_line_does_not_outlive_the_advice(
    words: list[str], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would win over the option, and the same command would come to the same end."""
    monkeypatch.setattr(sys, "argv", ["robojackson", "dance", "a.mp4", *words])
    settings = load(PipelineConfig, "base", {"minutes": 12})
    assert commands._next("falls", "page.html", settings) == message


def test_a_budget_of_the_training_is_doubled_in_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    line = ["robojackson", "dance", "a.mp4", "--set", "train.steps=9000", "--set", "robot=g1"]
    monkeypatch.setattr(sys, "argv", line)
    settings = load(PipelineConfig, "base", {"train.steps": 9000})
    message = commands._next("falls", "page.html", settings)
    assert message == "robojackson dance a.mp4 --set robot=g1 --set train.steps=18000"
