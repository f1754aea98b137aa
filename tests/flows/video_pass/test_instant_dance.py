"""A tracker dances at once: its page is there before anything else, and stays where it is."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from robojackson.cli.trackers.tracker_files import add_tracker
from robojackson.report.pages.page_content import TO_COME
from tests.fixtures.commands import Said, robojackson
from tests.fixtures.stand_in_tracker import NAME, stand_in, write_yaml

pytestmark = pytest.mark.xdist_group("instant_dance")

SMALL = ("--config", "smoke", "--set", "evaluate.phases=2", "--set", "evaluate.seconds=0.5")
SMALL += ("--set", "evaluate.resets=2")
TRAINED = (*SMALL, "--set", "train.steps=300", "--set", "train.trainer=sb3")


class Dances:
    """The command `dance` beside a stand-in tracker of the humanoid."""

    def __init__(self, folder: Path, clip: Path) -> None:
        self.clip = folder / "hips.mp4"
        shutil.copy(clip, self.clip)
        self.places = {
            "ROBOJACKSON_STORE": str(folder / "store"),
            "ROBOJACKSON_CONFIGS": str(folder / "configs"),
        }
        file, description = stand_in(folder)
        write_yaml(description, folder / "configs")
        with pytest.MonkeyPatch.context() as patch:
            for name, value in self.places.items():
                patch.setenv(name, value)
            add_tracker(NAME, file)
        self.instant = self.run(*SMALL, "--instant")
        assert self.instant.code == 0, self.instant.err

    def run(self, *words: str) -> Said:
        return robojackson("dance", self.clip, *words, "--json", **self.places)


@pytest.fixture(scope="module")
def dances(tmp_path_factory: pytest.TempPathFactory, short_clip: Path) -> Iterator[Dances]:
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("PREFECT_API_URL", raising=False)
        yield Dances(tmp_path_factory.mktemp("instant"), short_clip)


@pytest.mark.slow
def test_nothing_is_trained_and_the_tracker_is_evaluated(dances: Dances) -> None:
    result = dances.instant.answer
    there = {path.name for path in Path(result["page"]).parent.iterdir()}
    assert there >= {
        "index.html",
        "tracker.mp4",
        "tracker_evaluations.parquet",
        "reference.parquet",
    }
    assert not {"policy.safetensors", "episodes.parquet", "network.onnx"} & there
    assert result["evaluation"]["tracker"] == NAME
    assert result["evaluation"]["rollouts"] == 5  # two phases, two resets, and the stand


@pytest.mark.slow
def test_the_page_names_the_tracker_and_was_there_before_the_whole_evaluation(
    dances: Dances,
) -> None:
    page = Path(dances.instant.answer["page"])
    text = page.read_text()
    assert f"tracker {NAME}" in text
    assert "not trained on this one" in text
    assert "trained robot" not in text
    lines = dances.instant.err.splitlines()
    shown = next(i for i, line in enumerate(lines) if f"is on {page}" in line)
    evaluated = [i for i, line in enumerate(lines) if "'evaluate_tracker-hips'" in line]
    filmed = next(i for i, line in enumerate(lines) if "'render_video-hips'" in line)
    assert evaluated[0] < shown < filmed < evaluated[-1]
    assert TO_COME not in text


@pytest.mark.slow
def test_what_a_browser_cannot_run_is_reported_once(dances: Dances) -> None:
    page, lines = Path(dances.instant.answer["page"]), dances.instant.err.splitlines()
    assert not page.with_name("live.html").exists()
    reason = "no live page: a browser cannot run the network of another project"
    assert sum(reason in line for line in lines) == 1


@pytest.mark.slow
def test_a_recorded_instant_dance_is_answered_without_prefect(dances: Dances) -> None:
    again = dances.run(*SMALL, "--instant")
    assert (again.code, again.loaded_prefect) == (0, False)
    assert again.answer == dances.instant.answer


@pytest.mark.slow
def test_a_trained_robot_joins_the_tracker_on_one_page(dances: Dances) -> None:
    first = dances.run(*TRAINED)
    assert first.code == 0, first.err
    result = first.answer
    assert list(result["evaluation"]["trackers"]) == [NAME]
    text = Path(result["page"]).read_text()
    assert "trained robot" in text
    assert f"tracker {NAME}" in text
    assert {"dance.mp4", "tracker.mp4"} <= {p.name for p in Path(result["page"]).parent.iterdir()}
    lines = first.err.splitlines()
    assert any(f"is on {result['page']}" in line for line in lines)
    again = dances.run(*TRAINED)
    assert (again.loaded_prefect, json.dumps(again.answer)) == (False, json.dumps(result))


@pytest.mark.slow
def test_without_a_tracker_instant_is_one_line_before_any_work(dances: Dances) -> None:
    none = dances.run(*SMALL, "--instant", "--robot", "humanoid_strong")
    assert none.code == 1
    assert "BadPolicy: there is no tracker for robot 'humanoid_strong'; trackers:" in none.err
    assert not none.loaded_prefect
