"""The catalogue of candidates: nothing is lost, nothing counted twice, whoever writes beside."""

import io
import threading
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from robojackson.errors import BadTable
from storage import candidate_catalogue
from storage.store import Store

NOW = datetime(2026, 11, 21, 3, 0, tzinfo=UTC)


def row(video_id: str = "v1", **more: Any) -> dict[str, Any]:
    return {
        "run_id": "r1",
        "dance": "APT",
        "source": "youtube",
        "video_id": video_id,
        "url": f"https://host/{video_id}",
        "retrieved_at": NOW,
        "decision": "accepted",
        "decided_at": NOW,
        **more,
    }


@pytest.fixture(params=["folder", "memory"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Store:
    """Return a folder, and an object store that fsspec keeps in memory."""
    return Store(tmp_path if request.param == "folder" else f"memory://c-{tmp_path.name}")


def ids(store: Store) -> list[str]:
    return sorted(found["video_id"] for found in candidate_catalogue.records(store))


def test_an_empty_catalogue_is_empty(store: Store) -> None:
    assert candidate_catalogue.records(store) == []


def test_rows_come_back_as_they_were(store: Store) -> None:
    given = row(title="APT 아파트", view_count=7, stability_score=0.25, reason="")
    candidate_catalogue.append(store, [given])
    (found,) = candidate_catalogue.records(store)
    assert {key: found[key] for key in given} == given


def test_nothing_is_written_for_nothing(store: Store) -> None:
    assert (candidate_catalogue.append(store, []), store.list("candidates")) == (None, [])


def test_a_row_that_is_none_leaves_nothing_behind(store: Store) -> None:
    with pytest.raises(BadTable, match="run_id"):
        candidate_catalogue.append(store, [row(), {"video_id": "x"}])
    assert store.list("candidates") == []


def test_the_oldest_stands_first(store: Store) -> None:
    for day, name in ((2, "late"), (0, "early"), (1, "middle")):
        candidate_catalogue.append(store, [row(name, decided_at=NOW + timedelta(days=day))])
    assert [r["video_id"] for r in candidate_catalogue.records(store)] == [
        "early",
        "middle",
        "late",
    ]


def test_of_one_search_the_chosen_stands_first_and_the_rejected_last(store: Store) -> None:
    result = (("poor", "rejected", 0.1), ("good", "accepted", 0.5), ("best", "chosen", 0.2))
    rows = [row(name, decision=shown, score_per_second=score) for name, shown, score in result]
    candidate_catalogue.append(store, [*rows, row("lost", decision="failed")])
    found = [each["video_id"] for each in candidate_catalogue.records(store)]
    assert found == ["best", "good", "lost", "poor"]


def test_compaction_keeps_every_row_in_one_file(store: Store) -> None:
    for number in range(7):
        candidate_catalogue.append(store, [row(f"v{number}")])
    before = candidate_catalogue.records(store)
    candidate_catalogue.compact(store, least=2)
    assert len(store.list("candidates")) == 1
    assert candidate_catalogue.records(store) == before


def test_a_compaction_makes_no_file_that_its_reader_refuses(tmp_path: Path) -> None:
    """One long address counts for every row of its file."""
    store, most = Store(tmp_path), 17_000
    candidate_catalogue.append(store, [row("long", url=f"https://host/{'x' * 15_800}")])
    candidate_catalogue.append(store, [row(f"v{number}") for number in range(most)])
    assert len(candidate_catalogue.compact(store, least=2)) == 2
    sql = "SELECT count(*) AS n FROM candidates"
    assert candidate_catalogue.query(store, sql) == [{"n": most + 1}]


def test_what_a_reader_would_refuse_is_not_written(store: Store) -> None:
    long = row("long", url=f"https://host/{'x' * 2**18}")
    with pytest.raises(BadTable, match="too much text"):
        candidate_catalogue.append(store, [long, *(row(f"v{number}") for number in range(1_024))])
    assert store.list("candidates") == []


def test_few_files_are_left_alone(store: Store) -> None:
    candidate_catalogue.append(store, [row()])
    assert candidate_catalogue.compact(store) == []


def test_a_compaction_that_dies_before_it_tidies_up_doubles_no_row(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in range(3):
        candidate_catalogue.append(store, [row(f"v{number}")])
    monkeypatch.setattr(Store, "remove", lambda self, key: None)
    candidate_catalogue.compact(store, least=2)
    assert len(store.list("candidates")) == 4
    assert ids(store) == ["v0", "v1", "v2"]


@pytest.mark.medium
def test_refreshes_and_compactions_at_once_lose_nothing(tmp_path: Path) -> None:
    store = Store(tmp_path)
    errors: list[BaseException] = []

    def refresh(number: int) -> None:
        try:
            for night in range(6):
                candidate_catalogue.append(store, [row(f"{number}-{night}")])
                if night % 2:
                    candidate_catalogue.compact(store, least=3)
        except BaseException as cause:
            errors.append(cause)

    threads = [threading.Thread(target=refresh, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    assert ids(store) == sorted(f"{n}-{night}" for n in range(4) for night in range(6))


@pytest.mark.medium
def test_a_reader_beside_a_compaction_sees_every_row(tmp_path: Path) -> None:
    store = Store(tmp_path)
    candidate_catalogue.append(store, [row(f"v{number}") for number in range(5)])
    done = threading.Event()
    seen: list[int] = []

    def read() -> None:
        while not done.is_set():
            seen.append(len(candidate_catalogue.records(store)))

    reader = threading.Thread(target=read)
    reader.start()
    for number in range(10):
        candidate_catalogue.append(store, [row(f"later{number}")])
        candidate_catalogue.compact(store, least=2)
    done.set()
    reader.join()
    assert min(seen) >= 5
    assert seen == sorted(seen)


def test_one_dance_is_distinguished_from_the_others(store: Store) -> None:
    candidate_catalogue.append(store, [row("a"), row("b", dance='O\'Hara "x"')])
    found = [
        [r["video_id"] for r in candidate_catalogue.records(store, d)]
        for d in ("apt", 'O\'Hara "x"')
    ]
    assert found == [["a"], ["b"]]


def test_a_question_in_sql_is_answered(store: Store) -> None:
    candidate_catalogue.append(
        store, [row("a", stability_score=3.0), row("b", stability_score=1.0)]
    )
    sql = "SELECT dance, min(stability_score) AS best, count(*) AS n FROM candidates GROUP BY dance"
    assert candidate_catalogue.query(store, sql) == [{"dance": "APT", "best": 1.0, "n": 2}]


@pytest.mark.parametrize(
    "sql", ["SELEC 1", "SELECT nothing FROM candidates", "SELECT * FROM read_text('/etc/passwd')"]
)
def test_a_question_that_is_none_is_one_line(store: Store, sql: str) -> None:
    with pytest.raises(BadTable, match=r"^catalogue: [^\n]*$"):
        candidate_catalogue.query(store, sql)


def test_the_video_that_was_chosen_last_reigns(store: Store) -> None:
    kept = store.save("video", "clip.mp4", b"x")
    chosen = {"decision": "chosen", "video_key": kept.key, "video_sha256": kept.sha256}
    for day, name in enumerate(("first", "second")):
        candidate_catalogue.append(
            store, [row(name, decided_at=NOW + timedelta(days=day), **chosen)]
        )
    candidate_catalogue.append(store, [row("third", decided_at=NOW + timedelta(days=2))])
    reigning = candidate_catalogue.champion(store, "APT")
    assert reigning is not None
    assert reigning["video_id"] == "second"


def test_a_video_whose_file_is_gone_does_not_reign(store: Store) -> None:
    lost = {"decision": "chosen", "video_key": "video/gone/clip.mp4", "video_sha256": "0" * 64}
    candidate_catalogue.append(store, [row(**lost)])
    assert candidate_catalogue.champion(store, "APT") is None


def test_a_choice_whose_file_was_removed_is_assessed_again(store: Store) -> None:
    """Else no later night has a video to dance, and a worse one would win."""
    kept = store.save("video", "clip.mp4", b"x")
    chosen = {"decision": "chosen", "video_key": kept.key, "video_sha256": kept.sha256}
    lost = {"decision": "chosen", "video_key": "video/gone/clip.mp4", "video_sha256": "0" * 64}
    times = [NOW + timedelta(hours=hour) for hour in range(4)]
    rows = [row("oldest", **lost), row("reigns", decided_at=times[1], **chosen)]
    rows += [row("removed", decided_at=times[2], **lost), row("other", decided_at=times[2])]
    candidate_catalogue.append(store, rows)
    known = {("youtube", "oldest"), ("youtube", "reigns"), ("youtube", "other")}
    assert candidate_catalogue.known(store, "APT") == known
    again = row("removed", decision="rejected", decided_at=times[3])
    candidate_catalogue.append(store, [again])  # it is not downloaded every night
    assert candidate_catalogue.known(store, "APT") == known | {("youtube", "removed")}


def test_a_video_that_failed_may_be_tried_again(store: Store) -> None:
    candidate_catalogue.append(
        store, [row("bad", decision="failed"), row("seen", decision="rejected")]
    )
    assert candidate_catalogue.known(store, "APT") == {("youtube", "seen")}


def test_a_choice_that_failed_since_does_not_reign(store: Store) -> None:
    kept = store.save("video", "clip.mp4", b"x")
    chosen = {"decision": "chosen", "video_key": kept.key, "video_sha256": kept.sha256}
    for hour, name in enumerate(("first", "second")):
        candidate_catalogue.append(
            store, [row(name, decided_at=NOW + timedelta(hours=hour), **chosen)]
        )
    late = NOW + timedelta(hours=2)
    candidate_catalogue.append(store, [row("second", decision="failed", decided_at=late)])
    reigning = candidate_catalogue.champion(store, "APT")
    assert reigning is not None
    assert reigning["video_id"] == "first"
    assert candidate_catalogue.known(store, "APT") == {("youtube", "first"), ("youtube", "second")}


def test_what_a_person_looked_for_is_nothing_to_the_nightly_runs(store: Store) -> None:
    kept = store.save("video", "clip.mp4", b"x")
    chosen = {"decision": "chosen", "video_key": kept.key, "video_sha256": kept.sha256}
    candidate_catalogue.append(store, [row("steady", run_id="refresh-1", **chosen)])
    later = NOW + timedelta(hours=1)
    candidate_catalogue.append(store, [row("shaky", run_id="find-1", decided_at=later, **chosen)])
    reigning = candidate_catalogue.champion(store, "APT", "refresh")
    assert reigning is not None
    assert reigning["video_id"] == "steady"
    assert candidate_catalogue.known(store, "APT", "refresh") == {("youtube", "steady")}


def test_a_video_that_could_never_be_assessed_is_reported(store: Store) -> None:
    candidate_catalogue.append(
        store, [row("bad", decision="failed"), row("seen", decision="failed")]
    )
    candidate_catalogue.append(store, [row("seen", decision="rejected", decided_at=NOW)])
    assert candidate_catalogue.failed(store, "APT") == {("youtube", "bad")}


def test_columns_of_one_name_are_refused(store: Store) -> None:
    with pytest.raises(BadTable, match="two columns are called a: name them with AS"):
        candidate_catalogue.query(store, "SELECT 1 AS a, 2 AS a")


def test_a_file_of_an_earlier_version_is_read_with_what_it_lacks_empty(tmp_path: Path) -> None:
    store = Store(tmp_path)
    candidate_catalogue.append(store, [row("old", stability_score=3.0)])
    (key,) = store.list(candidate_catalogue.FOLDER)
    table = pq.read_table(io.BytesIO(store.read(key)))
    sink = io.BytesIO()
    pq.write_table(table.drop_columns(["score_per_second"]), sink)
    store.put(key, sink.getvalue())
    candidate_catalogue.append(store, [row("new", score_per_second=1.5)])
    found = {r["video_id"]: r["score_per_second"] for r in candidate_catalogue.records(store)}
    assert sorted(found.values(), key=str) == [1.5, None]
    assert candidate_catalogue.compact(store, 2)
    assert len(candidate_catalogue.records(store)) == 2
