"""From the source that a user names to files, and what happens without a network."""

import asyncio
import logging
import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import yaml
from prefect import flow
from prefect.utilities.callables import parameter_schema
from prefect.utilities.schema_tools.validation import validate

from flows.dance import dance
from flows.video_pass import inputs
from flows.video_pass.inputs import Search, videos_of
from robojackson.errors import NoPersonFound, RejectedReference, SearchFailed
from storage import candidate_catalogue
from storage.artifact import Artifact
from storage.store import Store
from tests.fixtures.web_server import serving

NOW = datetime(2026, 11, 21, tzinfo=UTC)
IMPATIENT = {
    **{"retries": 0, "timeout_s": 1, "request_pause_s": 0},
    "private_addresses": True,
}


@pytest.fixture
def config(tmp_path: Path) -> str:
    """Return a configuration without patience and with a dead proxy: only local servers can be
    reached."""
    path = tmp_path / "finding.yaml"
    path.write_text(yaml.safe_dump({"web": {**IMPATIENT, "proxy": "http://127.0.0.1:9"}}))
    return str(path)


def book(folder: Path, *addresses: str) -> str:
    listed = {"source": "urls", "address": str(folder / "urls.txt")}
    (folder / "urls.txt").write_text("\n".join(addresses))
    path = folder / "dances.yaml"
    path.write_text(yaml.safe_dump({"dances": [{"name": "Hips", "query": "hips dance", **listed}]}))
    return str(path)


def near(folder: Path) -> str:
    path = folder / "near.yaml"
    path.write_text(yaml.safe_dump({"web": IMPATIENT}))
    return str(path)


def files(source: str, config: str = "finding", book: str = "dances") -> dict[str, bytes]:
    """Return the names and contents of the videos that a source stands for."""

    @flow
    async def resolved() -> dict[str, bytes]:
        async with videos_of(source, Search(config=config, book=book)) as paths:
            return {path.name: path.read_bytes() for path in paths}

    return asyncio.run(resolved())


def refused(**given: Any) -> bool:
    """Return whether Prefect's server refuses these parameters for a run of `dance`."""
    schema = parameter_schema(dance.fn).model_dump_for_openapi()
    return bool(validate(given, schema, raise_on_error=False))


@pytest.mark.slow
def test_a_name_becomes_the_best_video(
    records: None, store_folder: Path, tmp_path: Path, short_clip: Path
) -> None:
    with serving(short_clip.read_bytes()) as web:
        listed = book(tmp_path, f"{web.url}/missing/a.mp4", f"{web.url}/good/b.mp4")
        found = files("HIPS dance ", near(tmp_path), listed)
    assert found == {"hips.mp4": short_clip.read_bytes()}


@pytest.mark.parametrize("name", [" take 1.mp4", "my clips ", "my clips /take 1 .mp4"])
def test_spaces_around_the_path_of_a_file_are_of_its_name(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, short_clip: Path
) -> None:
    (tmp_path / "my clips ").mkdir()
    for place in (" take 1.mp4", "my clips /take 1 .mp4"):
        shutil.copy(short_clip, tmp_path / place)
    monkeypatch.chdir(tmp_path)

    async def found() -> list[bytes]:
        async with videos_of(name, Search()) as paths:
            return [path.read_bytes() for path in paths]

    assert asyncio.run(found()) == [short_clip.read_bytes()]


@pytest.mark.medium
def test_a_video_that_was_downloaded_leaves_no_copy(
    records: None, store_folder: Path, tmp_path: Path, short_clip: Path
) -> None:
    with serving(short_clip.read_bytes()) as web:
        files("Hips", near(tmp_path), book(tmp_path, f"{web.url}/good/b.mp4"))
    assert not list((store_folder / "work").rglob("*.mp4"))


@pytest.mark.medium
def test_a_name_without_a_usable_video_reports_every_reason(
    records: None, store_folder: Path, tmp_path: Path
) -> None:
    with serving(b"") as web, pytest.raises(NoPersonFound, match="HTTP 404 not found"):
        files("Hips", near(tmp_path), book(tmp_path, f"{web.url}/missing/a.mp4"))


@pytest.mark.medium
def test_without_a_net_the_video_that_was_chosen_last_is_danced(
    records: None, store_folder: Path, config: str
) -> None:
    store = Store(store_folder)
    kept = store.save("video", "clip.mp4", b"the last one")
    facts = {"run_id": "r", "source": "youtube", "video_id": "v", "url": "https://host/v"}
    times = {"retrieved_at": NOW, "decided_at": NOW}
    chosen = {"decision": "chosen", "video_key": kept.key, "video_sha256": kept.sha256}
    candidate_catalogue.append(store, [{"dance": "APT", **facts, **times, **chosen}])
    assert files("apt dance", config) == {"apt.mp4": b"the last one"}


@pytest.mark.medium
def test_a_steadier_choice_of_the_nightly_refresh_is_danced(
    records: None, store_folder: Path, tmp_path: Path, short_clip: Path
) -> None:
    store = Store(store_folder)
    kept = store.save("video", "clip.mp4", b"of the night")
    facts = {"dance": "Hips", "run_id": "refresh-1", "source": "folder", "video_id": "v"}
    facts |= {"url": str(tmp_path / "v.mp4"), "retrieved_at": NOW, "decided_at": NOW}
    score = {"frames": 60, "detected": 60, "missing_joints": 0, "jitter": 0.0}
    names = ("stability_score", "missing_joints_per_frame", "jitter_per_frame", "score_per_second")
    score |= dict.fromkeys(names, 0.0)
    chosen = {"decision": "chosen", "video_key": kept.key, "video_sha256": kept.sha256}
    candidate_catalogue.append(store, [{**facts, **score, **chosen}])
    with serving(short_clip.read_bytes()) as web:
        listed = book(tmp_path, f"{web.url}/good/b.mp4")
        assert files("Hips", near(tmp_path), listed) == {"hips.mp4": b"of the night"}


@pytest.mark.medium
def test_without_a_net_the_last_choice_of_any_search_is_danced(
    records: None, store_folder: Path, config: str
) -> None:
    store = Store(store_folder)
    for run, name in (("refresh-1", "of the night"), ("dance-2", "of the day")):
        kept = store.save("video", "clip.mp4", name.encode())
        facts = {"dance": "APT", "run_id": run, "source": "youtube", "video_id": run}
        facts |= {"url": f"https://host/{run}", "decision": "chosen"}
        times = {"retrieved_at": NOW, "decided_at": datetime.now(UTC)}
        chosen = {"video_key": kept.key, "video_sha256": kept.sha256}
        candidate_catalogue.append(store, [{**facts, **times, **chosen}])
    assert files("apt dance", config) == {"apt.mp4": b"of the day"}


@pytest.mark.medium
def test_without_a_net_and_without_a_choice_the_search_has_failed(
    records: None, store_folder: Path, config: str
) -> None:
    with pytest.raises(SearchFailed, match="no connection"):
        files("a dance that nobody knows", config)


@pytest.mark.medium
def test_an_address_is_downloaded_without_a_search(
    records: None, store_folder: Path, tmp_path: Path, short_clip: Path
) -> None:
    with serving(short_clip.read_bytes()) as web:
        found = files(f"{web.url}/good/my-dance.mp4", near(tmp_path))
    assert found == {"my-dance.mp4": short_clip.read_bytes()}


@pytest.mark.medium
def test_without_a_net_an_address_is_the_video_that_was_downloaded_before(
    records: None, store_folder: Path, tmp_path: Path, short_clip: Path
) -> None:
    """By its record, and where that is lost by the note beside the video."""
    with serving(short_clip.read_bytes()) as web:
        address = f"{web.url}/good/my-dance.mp4"
        first = files(address, near(tmp_path))
    shutil.rmtree(store_folder / "records", ignore_errors=True)
    assert files(address, near(tmp_path)) == first


@pytest.mark.parametrize(
    ("address", "name"),
    [
        ("https://host/good/my-dance.mp4?token=x", "my-dance"),
        ("https://www.youtube.com/watch?v=abc_123", "v-abc-123"),
        ("https://host/shorts/xyz", "shorts-xyz"),
    ],
)
def test_two_videos_of_one_page_have_two_names(
    address: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inputs, "get_run_logger", lambda: logging.getLogger(__name__))
    monkeypatch.setattr(inputs, "of_candidate", lambda *_: Artifact("video/a.mp4", 64 * "0"))
    assert inputs.of_address(address, Search())[0] == name


@pytest.mark.medium
def test_an_address_that_gives_nothing_is_reported_with_its_reason(
    records: None, store_folder: Path, tmp_path: Path
) -> None:
    with serving(b"") as web, pytest.raises(SearchFailed, match="HTTP 404 not found"):
        files(f"{web.url}/missing/a.mp4", near(tmp_path))


@pytest.mark.medium
def test_a_path_is_taken_as_it_is(records: None, short_clip: Path) -> None:
    assert files(str(short_clip)) == {short_clip.name: short_clip.read_bytes()}


@pytest.mark.slow
def test_a_name_goes_all_the_way_into_the_flow(
    records: None, store_folder: Path, tmp_path: Path, short_clip: Path
) -> None:
    """To the gate, which refuses the second of a dance as the paper's mapping leaves it."""
    with serving(short_clip.read_bytes()) as web:
        listed = book(tmp_path, f"{web.url}/good/b.mp4")
        search = Search(config=near(tmp_path), book=listed)
        with pytest.raises(RejectedReference):
            asyncio.run(dance("Hips", "smoke", {"retarget.method": "paper"}, search=search))


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"source": ""},
        {"source": "  "},
        {"source": "APT", "minutes": 0},
        {"source": "APT", "start_s": -1},
        {"source": "APT", "search": {"engine": "x"}},
    ],
    ids=str,
)
def test_nonsense_is_refused_before_a_run(given: dict[str, Any]) -> None:
    assert refused(**given)


def test_a_name_alone_is_enough_for_a_run() -> None:
    assert not refused(source="APT")
