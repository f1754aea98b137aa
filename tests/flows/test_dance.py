"""The whole flow on a real clip, as short as it can be: it makes everything, and only once."""

import asyncio
import json
import shutil
import wave
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from prefect import flow
from prefect.client.orchestration import get_client
from prefect.settings import (
    PREFECT_FLOWS_HEARTBEAT_FREQUENCY,
    PREFECT_LOGGING_LEVEL,
    temporary_settings,
)

from flows.dance import dance
from flows.search.dance_source import is_name, resolve
from flows.video_pass import dance_stages, scored_candidates
from flows.video_pass.scored_candidates import Candidate, choose, score_all
from robojackson.clips.quality.stability import Stability
from robojackson.errors import NoPersonFound, RejectedReference, UnreadableVideo
from robojackson.files import tables
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load
from storage import artifact_tables, run_catalogue, study_tables
from storage.artifact import Artifact
from storage.store import Store
from tests.fixtures.commands import robojackson

pytestmark = pytest.mark.xdist_group("dance")

OVERRIDES = {"train.trainer": "sb3", "train.steps": 300}
FILES = {
    "landmarks.parquet",
    "smpl.parquet",
    "reference.parquet",
    "scorecard.json",
    "policy.safetensors",
    "episodes.parquet",
    "evaluations.parquet",
    "dance.mp4",
    "index.html",
}
ONCE = {"probe_video": 1, "score_stability": 1, "detect_landmarks": 2, "recover_motion": 1}
ONCE |= {"retarget_motion": 1, "train_policy": 1, "evaluate_dance": 1, "render_video": 1}
ONCE |= {"draw_snapshot": 1, "write_page": 1}


class Passes:
    """The flow over one folder of candidates and one store, again and again."""

    def __init__(self, source: Path, store: Path) -> None:
        self.source, self.store = source, store
        self.first = self.run()
        self.executed_first = self.executed()

    def run(self) -> dict[str, Any]:
        music = {"render.music": str(self.store.parent / "clicks.wav")}
        return asyncio.run(dance(str(self.source), "smoke", {**OVERRIDES, **music}))

    def executed(self) -> dict[str, int]:
        """Return how often each task really ran in the last pass."""
        with get_client(sync_client=True) as client:
            flow_run = max(client.read_flow_runs(), key=lambda run: run.expected_start_time)
            runs = [
                run
                for run in client.read_task_runs(limit=200)
                if run.flow_run_id == flow_run.id and run.state_name == "Completed"
            ]
        names = [run.name.split("-", 1)[0] for run in runs]
        return {name: names.count(name) for name in names}


@pytest.fixture(scope="module")
def passes(
    prefect_server: None, tmp_path_factory: pytest.TempPathFactory, short_clip: Path
) -> Iterator[Passes]:
    folder = tmp_path_factory.mktemp("dance")
    (folder / "clips").mkdir()
    shutil.copy(short_clip, folder / "clips" / "hips.mp4")
    with wave.open(str(folder / "clicks.wav"), "wb") as music:
        music.setnchannels(1)
        music.setsampwidth(1)
        music.setframerate(8000)
        music.writeframes(4 * (bytes([255, 0] * 100) + bytes([128]) * 2800))
    expected = {
        PREFECT_FLOWS_HEARTBEAT_FREQUENCY: None,
        PREFECT_LOGGING_LEVEL: "ERROR",
    }
    with pytest.MonkeyPatch.context() as patch, temporary_settings(expected):
        patch.setenv("ROBOJACKSON_STORE", str(folder / "store"))
        yield Passes(folder / "clips", folder / "store")


@pytest.mark.slow
def test_the_flow_leaves_everything_in_one_folder(passes: Passes) -> None:
    there = {path.name for path in Path(passes.first["page"]).parent.iterdir()}
    assert there >= FILES


@pytest.mark.slow
def test_beats_are_in_score_card_tables_and_page(passes: Passes) -> None:
    beats = passes.first["beats"]
    assert list(beats) == ["person", "reference", "robot", "control"]
    page = Path(passes.first["page"])
    assert json.loads((page.parent / "scorecard.json").read_text())["beats"] == beats
    assert "<h2>On the beat</h2>" in page.read_text()
    rows = study_tables.query(Store(passes.store), "SELECT * FROM beats")
    found = {row["motion"]: {key: row[key] for key in beats["robot"]} for row in rows}
    assert found == beats


@pytest.mark.slow
def test_the_first_pass_runs_every_task(passes: Passes) -> None:
    assert passes.executed_first == ONCE


@pytest.mark.slow
def test_a_second_pass_runs_no_task(passes: Passes) -> None:
    passes.run()
    assert passes.executed() == {}


@pytest.mark.slow
def test_a_deleted_table_runs_its_stage_alone_when_it_comes_back_the_same(passes: Passes) -> None:
    for path in passes.store.glob("retarget/*/reference.parquet"):
        path.unlink()
    passes.run()
    assert passes.executed() == {"retarget_motion": 1}


@pytest.mark.slow
def test_an_altered_video_in_the_folder_is_put_back(passes: Passes) -> None:
    film = Path(passes.first["video"])
    before = film.read_bytes()
    film.write_bytes(before[:-1])
    passes.run()
    assert (passes.executed(), film.read_bytes()) == ({"write_page": 1}, before)


@pytest.mark.slow
def test_a_renamed_copy_of_the_clip_trains_nothing(passes: Passes) -> None:
    (passes.source / "hips.mp4").rename(passes.source / "sway.mp4")
    result = passes.run()
    assert passes.executed() == {"write_page": 1}
    shown = Path(result["page"]).read_text()
    assert ("sway.mp4" in shown, "hips.mp4" in shown) == (True, False)
    named = set()
    for name, schema in study_tables.CELL.items():
        table = Path(result["page"]).with_name(f"{name}.parquet")
        rows = tables.decode_rows(schema, table.read_bytes(), name)
        named |= {(row["run_id"], row["move"]) for row in rows}
    assert named == {(result["run_id"], "sway")}


@pytest.mark.slow
def test_the_catalogue_knows_the_run(passes: Passes) -> None:
    known = {run.run_id for run in run_catalogue.list_runs(Store(passes.store))}
    assert passes.first["run_id"] in known


class Played:
    """A stage that runs in place of a real one."""

    def __init__(self, function: Callable[..., Artifact | dict[str, Artifact]]) -> None:
        self._function = function

    def outcomes(self, calls: Iterable[tuple[Any, ...]]) -> list[Any]:
        made: list[Any] = []
        for call in calls:
            try:
                made.append(self._function(*call))
            except NoPersonFound as cause:
                made.append(cause)
        return made


def a_candidate(name: str, score: float, detected: int = 10) -> Candidate:
    artifact = Artifact(key="k", sha256="0" * 64)
    return Candidate(name, {}, artifact, Stability(10, detected, 0, score, score, 0.0, 0.0, score))


def test_the_lowest_score_is_danced() -> None:
    candidates = [a_candidate("a", 3.0), a_candidate("b", 1.0), a_candidate("c", 2.0)]
    assert choose(candidates).name == "b"


def test_a_clip_without_a_person_is_not_danced_however_steady() -> None:
    candidates = [a_candidate("a", 3.0), a_candidate("empty", 0.0, detected=0)]
    assert choose(candidates).name == "a"


def test_only_clips_without_a_person_are_an_error_that_counts_frames() -> None:
    with pytest.raises(NoPersonFound, match="empty: no person found in 10 of 10 frames"):
        choose([a_candidate("empty", 0.0, detected=0)])


@pytest.fixture
def score(
    records: None, store_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., list[str]]:
    """Return the names of the candidates that are left when the simulated landmarks of some files
    fail."""

    def probe_video(source: Any, limits: Any, start: Any, end: Any) -> dict[str, Artifact]:
        return dict.fromkeys(("video", "info"), Artifact(source.path.name, source.sha256))

    def detect_landmarks(video: Artifact, info: Artifact, size: str, dancer: Any) -> Artifact:
        if video.key.startswith("empty"):
            raise NoPersonFound(f"{video.key}: no person 3")
        return video

    def score_stability(track: Artifact, config: Any) -> Artifact:
        score = a_candidate(track.key, 1.0).score
        return artifact_tables.save(
            Store.from_environment(), "stability", "stability.parquet", score
        )

    for played in (probe_video, detect_landmarks, score_stability):
        monkeypatch.setattr(scored_candidates, played.__name__, Played(played))

    @flow
    async def scoring(paths: tuple[Path, ...]) -> list[str]:
        found = score_all(paths, load(PipelineConfig, "smoke"), None, None)
        return [candidate.name for candidate in found]

    def run(*names: str) -> list[str]:
        paths = tuple(tmp_path / name for name in names)
        for path in paths:
            path.write_text(path.name)
        return asyncio.run(scoring(paths))

    return run


@pytest.mark.medium
def test_a_clip_whose_landmarks_fail_leaves_its_neighbours_to_be_danced(
    score: Callable[..., list[str]],
) -> None:
    assert score("a.mp4", "empty.mp4", "b.mp4") == ["a.mp4", "b.mp4"]


@pytest.mark.medium
def test_when_the_landmarks_of_all_clips_fail_the_first_cause_is_reported(
    score: Callable[..., list[str]],
) -> None:
    with pytest.raises(NoPersonFound, match=r"^empty_1.mp4: no person 3"):
        score("empty_1.mp4", "empty_2.mp4")


@pytest.mark.slow
def test_a_person_who_is_not_there_is_one_line(short_clip: Path, tmp_path: Path) -> None:
    words = ("dance", short_clip, "--person", 3, "--config", "smoke")
    text = robojackson(*words, ROBOJACKSON_STORE=str(tmp_path / "store"))
    (refusal,) = (line for line in text.err.splitlines() if line.startswith("robojackson: "))
    assert (text.code, "Traceback" in text.err) == (1, False)
    assert refusal.startswith("robojackson: NoPersonFound: ")


def test_without_a_source_the_hip_shake_is_danced() -> None:
    assert resolve(None).name == "hip_shake.mp4"


@pytest.mark.parametrize("source", ["", "  ", "x" * 1001])
def test_a_source_without_words_or_with_too_many_is_refused(source: str) -> None:
    for look in (is_name, resolve):
        with pytest.raises(UnreadableVideo, match=r"SOURCE is empty|too long"):
            look(source)


def test_a_training_that_says_its_processor_time_gets_no_clock() -> None:
    settings = load(PipelineConfig, "base", {"train.cpu_minutes": 60})
    budgeted, whole_pass = dance_stages._budgeted(settings)
    assert (budgeted.minutes, budgeted.cpu_minutes, whole_pass) == (None, 60, False)


def test_a_training_without_a_budget_has_that_of_the_pass() -> None:
    budgeted, whole_pass = dance_stages._budgeted(load(PipelineConfig, "base", {"minutes": 3.5}))
    assert (budgeted.minutes, whole_pass) == (3.5, True)


def test_files_that_cannot_be_read_are_left_out(tmp_path: Path) -> None:
    good, gone = tmp_path / "b.mp4", tmp_path / "a.mp4"
    good.write_bytes(b"x")
    assert [path for path, _ in scored_candidates._readable([gone, good])] == [good]
    with pytest.raises(UnreadableVideo, match=r"a\.mp4: cannot be read \(No such file"):
        scored_candidates._readable([gone])


@pytest.mark.parametrize("source", ["gone.mp4", "no/such/thing", "moonwalk"])
def test_a_source_that_is_not_there_is_refused(source: str) -> None:
    with pytest.raises(UnreadableVideo):
        resolve(source)


@pytest.mark.medium
def test_a_reference_that_breaks_a_bar_is_not_trained(passes: Passes) -> None:
    """The paper's mapping breaks joint limits: the gate says so before a robot is trained on it."""
    with pytest.raises(RejectedReference, match=r"reference refused: .* is allowed"):
        asyncio.run(dance(str(passes.source), "smoke", {**OVERRIDES, "retarget.method": "paper"}))
    assert "train_policy" not in passes.executed()
