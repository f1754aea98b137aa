"""From the name of a dance to the file that is danced, and what happens without a net."""

from datetime import UTC, datetime
from pathlib import Path

import pytest
import yaml

from flows.find import clip_of
from robojackson.errors import NoPersonFound, SearchFailed
from storage import candidates
from storage.store import Store
from tests.search.server import serving

NOW = datetime(2026, 11, 21, tzinfo=UTC)
IMPATIENT = {"retries": 0, "timeout_s": 1, "request_pause_s": 0}


@pytest.fixture
def config(tmp_path: Path) -> str:
    """No patience, and a proxy that is not there: whatever is no local server is out of reach."""
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


def test_a_name_becomes_the_best_video(
    records: Path, store_folder: Path, tmp_path: Path, short_clip: Path
) -> None:
    with serving(short_clip.read_bytes()) as web:
        listed = book(tmp_path, f"{web.url}/missing/a.mp4", f"{web.url}/good/b.mp4")
        path = clip_of("HIPS dance", near(tmp_path), listed)
    assert (path.stem, path.read_bytes() == short_clip.read_bytes()) == ("hips", True)


def test_a_name_without_a_video_that_can_be_danced_tells_every_reason(
    records: Path, store_folder: Path, tmp_path: Path
) -> None:
    with serving(b"") as web, pytest.raises(NoPersonFound, match="HTTP 404 not found"):
        clip_of("Hips", near(tmp_path), book(tmp_path, f"{web.url}/missing/a.mp4"))


def test_without_a_net_the_video_that_was_chosen_last_is_danced(
    records: Path, store_folder: Path, config: str
) -> None:
    store = Store(store_folder)
    kept = store.keep("video", "clip.mp4", b"the last one")
    facts = {"run_id": "r", "source": "youtube", "video_id": "v", "url": "https://host/v"}
    times = {"retrieved_at": NOW, "decided_at": NOW}
    chosen = {"decision": "chosen", "video_key": kept.key, "video_sha256": kept.sha256}
    candidates.append(store, [{"dance": "APT", **facts, **times, **chosen}])
    assert clip_of("apt dance", config).read_bytes() == b"the last one"


def test_without_a_net_and_without_a_choice_the_search_has_failed(
    records: Path, store_folder: Path, config: str
) -> None:
    with pytest.raises(SearchFailed, match="no connection"):
        clip_of("a dance that nobody knows", config)
