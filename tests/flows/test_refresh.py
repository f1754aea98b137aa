"""A night: dances from a server of our own, one of which fails, and the night after."""

import asyncio
import json
import logging
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import yaml
from prefect.client.orchestration import get_client
from prefect.client.schemas.filters import ArtifactFilter, ArtifactFilterKey
from prefect.settings import (
    PREFECT_FLOWS_HEARTBEAT_FREQUENCY,
    PREFECT_LOGGING_LEVEL,
    temporary_settings,
)

from configs.dance_book import Dance, DanceBook
from flows import refresh as nightly
from flows.refresh import refresh
from flows.search.requests import check_refresh
from flows.search.search_entries import Entry, SearchResult, rows
from robojackson.clips.quality.stability import STABILITY_SCORE
from robojackson.clips.web.candidate_selection import Selection
from robojackson.clips.web.video_candidate import VideoCandidate
from robojackson.errors import (
    BadConfiguration,
    SearchFailed,
    StoreError,
    TrackTooShort,
    UnknownName,
)
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load
from storage import candidate_catalogue
from storage.artifact import Artifact
from storage.store import Store
from tests.fixtures.web_server import Web, serving

pytestmark = pytest.mark.xdist_group("refresh")

OVERRIDES = {
    **{"web.retries": 1, "web.backoff_s": 0.01, "web.timeout_s": 1, "web.request_pause_s": 0},
    "web.private_addresses": True,
}
FAILURES = {
    "missing": "HTTP 404 not found",
    "busy": "HTTP 429 too many requests (2 attempts)",
    "half": "the server cut the file short (2 attempts)",
    "wrong_length": "cut off before its index",
}
HOSTILE = "..%2f..%2f..%2fescape%1b%5b31m"


@dataclass
class Nights:
    """Refreshes over one store and one server."""

    web: Web
    book: Path
    folder: Path
    first: dict[str, Any]

    @property
    def store(self) -> Store:
        return Store(self.folder / "store")

    def again(self, dances: list[str] | None = None) -> dict[str, Any]:
        return night(self.book, dances)

    def row(self, word: str) -> dict[str, Any]:
        """Return the row of the catalogue for the first video whose address has the word."""
        return next(
            row for row in candidate_catalogue.records(self.store) if f"/{word}/" in row["url"]
        )


def night(book: Path, dances: list[str] | None = None) -> dict[str, Any]:
    return asyncio.run(refresh(dances, str(book), "finding", OVERRIDES, "smoke"))


def artifact(key: str) -> Any:
    """Return the data of the newest artifact of a key."""
    expected = ArtifactFilter(key=ArtifactFilterKey(any_=[key]))
    with get_client(sync_client=True) as client:
        found = client.read_artifacts(artifact_filter=expected)
    return max(found, key=lambda each: each.created).data


def write_book(folder: Path, web: Web) -> Path:
    addresses = [f"{web.url}/{kind}/clip.mp4" for kind in ("good", *FAILURES)]
    (folder / "urls.txt").write_text("\n".join([*addresses, f"{web.url}/good/{HOSTILE}.mp4", ""]))
    listed = {"source": "urls", "address": str(folder / "urls.txt"), "top": 9}
    dances = [
        {"name": "Nowhere", "query": "x", "source": "site", "address": f"{web.url}/missing/"},
        {"name": "Good One", "query": "good", **listed},
    ]
    path = folder / "dances.yaml"
    path.write_text(yaml.safe_dump({"dances": dances}))
    return path


@pytest.fixture(scope="module")
def nights(
    prefect_server: None, tmp_path_factory: pytest.TempPathFactory, short_clip: Path
) -> Iterator[Nights]:
    folder = tmp_path_factory.mktemp("refresh")
    expected = {
        PREFECT_FLOWS_HEARTBEAT_FREQUENCY: None,
        PREFECT_LOGGING_LEVEL: "ERROR",
    }
    with (
        pytest.MonkeyPatch.context() as patch,
        temporary_settings(expected),
        serving(short_clip.read_bytes()) as web,
    ):
        patch.setenv("ROBOJACKSON_STORE", str(folder / "store"))
        book = write_book(folder, web)
        yield Nights(web, book, folder, night(book))


@pytest.mark.medium
def test_a_dance_whose_search_fails_does_not_stop_the_others(nights: Nights) -> None:
    assert list(nights.first["dances"]) == ["Good One"]
    assert list(nights.first["failed"]) == ["Nowhere"]
    assert "HTTP 404 not found" in nights.first["failed"]["Nowhere"]


@pytest.mark.medium
def test_the_chosen_video_is_ready_to_train(nights: Nights) -> None:
    done = nights.first["dances"]["Good One"]
    assert done["is_new"]
    assert Path(done["reference"]).is_file()
    assert done["scorecard"]


@pytest.mark.medium
def test_every_candidate_is_in_the_catalogue(nights: Nights) -> None:
    decisions = [row["decision"] for row in candidate_catalogue.records(nights.store, "good one")]
    assert sorted(decisions[:6]) == ["chosen", *["failed"] * 4, "rejected"]


@pytest.mark.medium
@pytest.mark.parametrize("kind", FAILURES)
def test_a_failure_of_the_server_is_the_reason_in_the_table(nights: Nights, kind: str) -> None:
    row = nights.row(kind)
    assert row["decision"] == "failed"
    assert row["reason"].startswith(FAILURES[kind])


@pytest.mark.medium
def test_the_same_video_under_another_name_is_a_copy(nights: Nights) -> None:
    found = [
        row for row in candidate_catalogue.records(nights.store) if row["decision"] == "rejected"
    ]
    assert found[0]["reason"].startswith("a copy of")


@pytest.mark.medium
def test_a_hostile_name_leaves_nothing_outside_the_store(nights: Nights) -> None:
    outside = {path.name for path in nights.folder.iterdir()}
    assert outside == {"store", "urls.txt", "dances.yaml"}


@pytest.mark.medium
def test_prefect_shows_the_table_with_the_reasons(nights: Nights) -> None:
    rows = json.loads(artifact("candidates-good-one"))
    assert {row["decision"] for row in rows} <= {"chosen", "accepted", "rejected", "failed"}
    assert "\x1b" not in artifact("pictures-good-one")


@pytest.mark.medium
def test_prefect_links_to_the_chosen_video(nights: Nights) -> None:
    assert f"{nights.web.url}/good/" in artifact("chosen-good-one")


@pytest.mark.medium
def test_the_next_night_downloads_only_what_is_missing(nights: Nights) -> None:
    before, heads = len(nights.web.requests), len(nights.web.heads)
    result = nights.again(["Good One"])
    requests = Counter(path for path, _ in nights.web.requests[before:])
    downloads = requests - Counter(nights.web.heads[heads:])
    assert {path.split("/")[1] for path in downloads} == set(FAILURES)
    done = result["dances"]["Good One"]
    assert not done["is_new"]
    assert done["reference"] == nights.first["dances"]["Good One"]["reference"]


@pytest.mark.medium
def test_a_dance_that_is_not_due_waits(nights: Nights) -> None:
    """Only the dance that failed is searched again, and fails again."""
    with pytest.raises(SearchFailed, match=r"^Nowhere: [^;]*$"):
        nights.again()


@pytest.mark.medium
def test_every_dance_failing_is_a_failed_run(nights: Nights) -> None:
    with pytest.raises(SearchFailed, match=r"Nowhere: .*404"):
        nights.again(["Nowhere"])


@dataclass
class Night:
    """A refresh of APT over a catalogue in which `oldest` and `old` were chosen before `new`."""

    store: Store
    monkeypatch: pytest.MonkeyPatch
    faults: dict[str, Exception]

    def __post_init__(self) -> None:
        """Fill the catalogue and stand in for search and motion."""
        kept = self.store.save("video", "clip.mp4", b"x")
        for place, name in enumerate(("oldest", "old")):
            row = {
                "dance": "APT", "source": "site", "url": "http://host/v", "title": "", "query": "",
                "video_key": kept.key, "video_sha256": kept.sha256, "video_id": name,
                "run_id": f"refresh-{place}", "decision": "chosen", "stability_score": 1.0,
                "retrieved_at": datetime.now(UTC), "decided_at": datetime.now(UTC),
            }  # fmt: skip
            candidate_catalogue.append(self.store, [row])
        self.kept = kept
        self.monkeypatch.setenv("ROBOJACKSON_STORE", str(self.store.root))
        for name, stand_in in {
            "search_and_rank": self.search, "motion": self.motion, "publish_search": self.show,
            "in_good_quality": lambda *given: Artifact("new", "0" * 64),
            "of_champion": lambda row, *given: Artifact(row["video_id"], "0" * 64),
            "get_run_logger": lambda: logging.getLogger("refresh"),
        }.items():  # fmt: skip
            self.monkeypatch.setattr(nightly, name, stand_in)

    def search(self, dance: Dance, *rest: object) -> SearchResult:
        """Find one new video, which is the best."""
        candidate = VideoCandidate(
            "new", "http://host/new", "", "", "site", retrieved_at=datetime.now(UTC)
        )
        entry = Entry(candidate, "chosen", video=self.kept)
        made = SearchResult(dance, "refresh-2", (entry,), Selection((candidate,), ()))
        candidate_catalogue.append(self.store, rows(made))
        return made

    def search_nothing(self, dance: Dance, *rest: object) -> SearchResult:
        """Find no new video."""
        return SearchResult(dance, "refresh-3", (), Selection((), ()))

    def assess(self, name: str, decision: str, score: float) -> None:
        """Add an assessment of an earlier night to the catalogue."""
        figures = dict.fromkeys((c.name for c in STABILITY_SCORE.columns), 1)
        row = {
            **{"dance": "APT", "source": "site", "url": f"http://host/{name}", "title": name},
            **{"query": "", "video_id": name, "run_id": "refresh-1", "decision": decision},
            **{"video_key": self.kept.key, "video_sha256": self.kept.sha256},
            **{"retrieved_at": datetime.now(UTC), "decided_at": datetime.now(UTC)},
            **figures, "score_per_second": score,
        }  # fmt: skip
        candidate_catalogue.append(self.store, [row])

    def motion(self, store: Store, video: Artifact, settings: object) -> dict[str, Any]:
        """Fail for the videos that cannot be danced."""
        if video.key in self.faults:
            raise self.faults[video.key]
        return {"reference": video.key}

    async def show(self, *shown: object) -> None:
        """Show nothing."""

    def refreshed(self) -> dict[str, Any]:
        """Return the result of the flow."""
        given = ({"name": "APT", "query": "APT"}, "finding", {}, "smoke", {})
        return asyncio.run(nightly.refresh_dance.fn("APT", *given))

    @property
    def champion(self) -> str | None:
        """Return the id of the video that reigns."""
        found = candidate_catalogue.champion(self.store, "APT")
        return found and found["video_id"]


@pytest.mark.parametrize(("impossible", "danced"), [(["new"], "old"), (["new", "old"], "oldest")])
def test_a_choice_of_which_no_motion_can_be_made_leaves_the_one_before(
    impossible: list[str], danced: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    faults: dict[str, Exception] = {name: TrackTooShort("1 frame") for name in impossible}
    night = Night(Store(tmp_path), monkeypatch, faults)
    result = night.refreshed()
    chosen = (result["chosen"]["video_id"], result["reference"], night.champion)
    assert chosen == (danced, danced, danced)
    assert not result["is_new"]
    assert ("site", "new") in candidate_catalogue.known(night.store, "APT")


def test_where_every_choice_fails_the_steadiest_fit_video_is_danced_and_stays_the_choice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    faults: dict[str, Exception] = dict.fromkeys(("new", "old", "oldest"), TrackTooShort("1 frame"))
    night = Night(Store(tmp_path), monkeypatch, faults)
    night.assess("shaky", "accepted", 0.9)
    night.assess("steady", "accepted", 0.2)
    night.assess("cut", "rejected", 0.1)
    results = [night.refreshed()]
    monkeypatch.setattr(nightly, "search_and_rank", night.search_nothing)
    results.append(night.refreshed())
    assert [made["chosen"]["video_id"] for made in results] == ["steady", "steady"]
    assert [made["is_new"] for made in results] == [True, False]
    assert night.champion == "steady"


def test_a_fault_of_every_video_does_not_use_up_the_catalogue(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    night = Night(Store(tmp_path), monkeypatch, {})
    monkeypatch.setattr(nightly, "MOST_TRIES", 2)
    for name, score in (("steady", 0.2), ("shaky", 0.9)):
        night.assess(name, "accepted", score)
    night.faults.update(dict.fromkeys(("new", "old", "oldest", "steady"), TrackTooShort("1 frame")))
    with pytest.raises(TrackTooShort):
        night.refreshed()
    accepted = {row["video_id"] for row in candidate_catalogue.accepted(night.store, "APT")}
    assert accepted == {"steady", "shaky"}


def test_a_night_that_finds_nothing_dances_what_an_earlier_one_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    faults: dict[str, Exception] = dict.fromkeys(("new", "old", "oldest"), TrackTooShort("1 frame"))
    night = Night(Store(tmp_path), monkeypatch, faults)
    with pytest.raises(TrackTooShort):
        night.refreshed()
    night.assess("steady", "accepted", 0.2)
    monkeypatch.setattr(nightly, "search_and_rank", night.search_nothing)
    assert night.refreshed()["chosen"]["video_id"] == "steady"
    assert night.champion == "steady"


@pytest.mark.parametrize(
    "fault", [StoreError("No space left on device"), BadConfiguration("its model is not here")]
)
def test_a_fault_of_the_machine_is_none_of_the_video(
    fault: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    night = Night(Store(tmp_path), monkeypatch, dict.fromkeys(("new", "old", "oldest"), fault))
    with pytest.raises(type(fault)):
        night.refreshed()
    assert night.champion == "new", "the next night makes its motion"


def test_dances_that_would_share_their_notes_are_refused() -> None:
    book = DanceBook((Dance(name="C", query="c"), Dance(name="C++", query="c plus plus")))
    with pytest.raises(BadConfiguration, match="'C' and 'C\\+\\+' have the same letters"):
        nightly._require_distinct(book)


@pytest.mark.parametrize("robot", [None, "humanoid_strong"])
def test_a_refresh_by_hand_is_for_the_robot_that_is_named(
    robot: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[Any] = []

    async def refused(*words: Any, return_state: bool) -> Any:
        given.extend(words)
        raise SearchFailed("far enough")

    monkeypatch.setattr(nightly, "refresh_dance", refused)
    monkeypatch.setattr(nightly, "launch", lambda flow, *words: asyncio.run(flow.fn(*words)))
    with pytest.raises(SearchFailed, match="far enough"):
        nightly.run(["APT"], "finding", {}, robot)
    pipeline, overrides = given[-2:]
    assert load(PipelineConfig, pipeline, overrides).robot == (robot or PipelineConfig().robot)


def test_a_refresh_for_a_robot_that_there_is_not_is_refused_before_it_begins() -> None:
    with pytest.raises(UnknownName, match="unknown robot 'nosuch'"):
        check_refresh(None, "finding", {}, "nosuch")
