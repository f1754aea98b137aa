"""A dance that was made before is answered from its records, without Prefect."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.fixtures.commands import Said, robojackson

pytestmark = pytest.mark.xdist_group("recorded_dance")

SHORT = ("--config", "smoke", "--set", "train.steps=300", "--set", "train.trainer=sb3")


class Dances:
    """The command `dance`, given again and again for one store."""

    def __init__(self, folder: Path, clip: Path) -> None:
        self.store, self.clip = folder / "store", folder / "hips.mp4"
        shutil.copy(clip, self.clip)
        self.first = self.run()
        assert self.first.code == 0, self.first.err

    def run(self, *words: str, **more: str) -> Said:
        environment = {"ROBOJACKSON_STORE": str(self.store), **more}
        return robojackson("dance", self.clip, *SHORT, *words, "--json", **environment)


@pytest.fixture(scope="module")
def dances(tmp_path_factory: pytest.TempPathFactory, short_clip: Path) -> Iterator[Dances]:
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("PREFECT_API_URL", raising=False)
        yield Dances(tmp_path_factory.mktemp("replay"), short_clip)


@pytest.mark.slow
def test_a_recorded_dance_is_answered_alike_without_prefect(dances: Dances) -> None:
    again = dances.run()
    assert (again.code, again.loaded_prefect) == (0, False)
    assert again.answer == dances.first.answer
    assert dances.first.loaded_prefect


@pytest.mark.slow
def test_another_home_of_prefect_changes_nothing(dances: Dances, tmp_path: Path) -> None:
    """A worker has a home of its own, and shares the records all the same."""
    again = dances.run(PREFECT_HOME=str(tmp_path / "home"))
    assert (again.code, again.loaded_prefect) == (0, False)


@pytest.mark.slow
def test_a_missing_file_starts_the_flow_which_makes_it_again(dances: Dances) -> None:
    film = Path(dances.first.answer["video"])
    before = film.read_bytes()
    film.unlink()
    again = dances.run()
    assert (again.code, again.loaded_prefect, film.read_bytes()) == (0, True, before)


@pytest.mark.slow
def test_forcing_every_task_runs_the_flow(dances: Dances) -> None:
    result = dances.run(
        PREFECT_TASKS_REFRESH_CACHE="true", PREFECT_API_URL="http://127.0.0.1:9/api"
    )
    assert result.code == 1
    assert "http://127.0.0.1:9/api does not answer" in result.err


@pytest.mark.slow
def test_a_recorded_motion_that_the_gate_refuses_is_refused_alike(dances: Dances) -> None:
    wrong = ("--set", "retarget.method=paper")
    first, again = dances.run(*wrong), dances.run(*wrong)
    assert [found.code for found in (first, again)] == [1, 1]
    assert [found.loaded_prefect for found in (first, again)] == [True, False]
    refused = [
        [line for line in found.err.splitlines() if line.startswith("robojackson: Rejected")]
        for found in (first, again)
    ]
    assert refused[0] == refused[1] != []
