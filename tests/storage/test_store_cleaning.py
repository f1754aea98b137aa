"""What `robojackson clean` finds in a store, and what it leaves there."""

import json
import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from robojackson.errors import StoreError
from robojackson.pipeline.folder_lock import locked
from robojackson.rl.feedback import cached_feedback
from storage import stage_records, store_cleaning
from storage.artifact import Artifact
from storage.store import Store
from storage.store_cleaning import USUAL, plan, remove, users_of
from storage.store_inventory import KINDS, OF_VIDEOS, inventory
from tasks import assess_video, download_video, probe_video

DAY_S = 86_400.0
ALL = ("work", "unused", "videos", "cache", "runs")


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "store").create()


def recorded(store: Store, name: str, result: object, stage: str = "recover_motion") -> str:
    """Return a record as Prefect writes it: the result is JSON inside JSON."""
    key = stage_records.address(f"{stage}/{name}")
    store.put(key, json.dumps({"result": stage_records.encode(result).decode()}).encode())
    return key


def aged(store: Store, days: float) -> None:
    """Make everything in the store so old."""
    when = time.time() - days * DAY_S
    for path in Path(store.root).rglob("*"):
        os.utime(path, (when, when))


def keys(store: Store) -> set[str]:
    return set(store.list())


def kind_of(store: Store, artifact: Artifact) -> str:
    folder = artifact.key.rpartition("/")[0]
    return next(item.kind for item in inventory(store) if item.key == folder)


def test_a_result_that_nothing_names_is_unused_and_goes(store: Store) -> None:
    store.save("mocap", "smpl.parquet", b"nobody's")
    assert [item.kind for item in remove(store, plan(store, USUAL, 0.0)).gone] == ["unused"]
    assert keys(store) == set()


def test_a_pipe_in_the_store_is_not_waited_for(store: Store) -> None:
    for folder in ("records", "runs"):
        (Path(store.root) / folder).mkdir()
        os.mkfifo(Path(store.root) / folder / "a.json")
    assert plan(store, USUAL, 0.0).old == []


def test_a_result_that_a_record_names_stays_unless_the_cache_is_named(store: Store) -> None:
    made = store.save("mocap", "smpl.parquet", b"a motion")
    record = recorded(store, "a.json", {"smpl": [made]})
    assert kind_of(store, made) == "cache"
    assert remove(store, plan(store, USUAL, 0.0)).gone == []
    remove(store, plan(store, ["cache"], 0.0))
    assert not store.exists(made.key)
    assert not store.exists(record)


def test_an_old_result_of_a_young_record_stays(store: Store) -> None:
    made = store.save("mocap", "smpl.parquet", b"a motion")
    old = recorded(store, "old.json", made)
    aged(store, 60)
    young = recorded(store, "young.json", made)
    remove(store, plan(store, ALL, 30 * DAY_S))
    assert keys(store) == {made.key, young}
    assert not store.exists(old)


def test_what_is_younger_than_requested_stays(store: Store) -> None:
    store.save("mocap", "smpl.parquet", b"young")
    store.work("train-1").joinpath("checkpoint.zip").write_bytes(b"young")
    assert plan(store, USUAL, DAY_S).going == []
    aged(store, 2)
    assert {item.kind for item in plan(store, USUAL, DAY_S).going} == {"work", "unused"}


def test_tables_studies_walkers_and_robots_are_never_removed(store: Store) -> None:
    never = [
        store.put("metrics/episodes/study=a/x.parquet", b"rows").key,
        store.put("studies/paper/index.html", b"page").key,
        store.put("robots/g1/g1.xml", b"model").key,
        store.save("pretrain", "walker_track.safetensors", b"walker").key,
        store.put("prefect/prefect.db", b"database").key,
    ]
    remove(store, plan(store, ALL, 0.0))
    assert keys(store) == set(never)


def test_gains_of_feedback_are_a_cache(store: Store) -> None:
    gains = store.put(f"{cached_feedback.FOLDER}/0123456789abcdef.npz", b"gains").key
    assert [(item.kind, item.key) for item in inventory(store)] == [("cache", gains)]
    assert not plan(store, USUAL, 0.0).going
    assert [item.key for item in remove(store, plan(store, ("cache",), 0.0)).gone] == [gains]
    assert keys(store) == set()


def test_a_result_that_a_study_names_stays(store: Store) -> None:
    made = store.save("train", "policy.safetensors", b"weights")
    store.put("metrics/runs/one.json", f'{{"policy": "{made.key}"}}'.encode())
    assert kind_of(store, made) == "kept"


def test_a_dance_goes_with_its_run_and_what_only_it_names(store: Store) -> None:
    made = store.save("video", "clip.mp4", b"frames")
    store.put("runs/one.json", f'{{"video": "{made.key}"}}'.encode())
    store.put("dances/walk-0123abcd/index.html", b"page")
    assert remove(store, plan(store, ["unused", "cache"], 0.0)).gone == []
    remove(store, plan(store, ["runs"], 0.0))
    assert keys(store) == set()


def test_the_page_of_a_run_that_stays_stays(store: Store) -> None:
    pages = [store.put(f"dances/{name}/index.html", b"page").key for name in ("räv-1", "old-2")]
    store.put("runs/old.json", json.dumps({"page": pages[1]}).encode())
    aged(store, 60)
    run = store.put("runs/young.json", json.dumps({"page": pages[0]}).encode())
    remove(store, plan(store, ["runs"], 30 * DAY_S))
    assert keys(store) == {pages[0], run.key}


def unreadable(monkeypatch: pytest.MonkeyPatch, name: str, locked: str) -> None:
    """Let a method of `Path` fail for a name as for a person without access; root has all."""
    method = getattr(Path, name)

    def refused(self: Path) -> object:
        if self.name == locked:
            raise PermissionError(13, "Permission denied", str(self))
        return method(self)

    monkeypatch.setattr(Path, name, refused)


@pytest.mark.parametrize(("method", "locked"), [("read_bytes", "a.json"), ("iterdir", "records")])
def test_what_an_unreadable_record_may_name_is_not_offered(
    method: str, locked: str, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorded(store, "a.json", store.save("mocap", "smpl.parquet", b"a motion"))
    unreadable(monkeypatch, method, locked)
    with pytest.raises(StoreError, match=rf"cannot .*{locked}"):
        plan(store, USUAL, 0.0)


def test_a_folder_of_the_disk_itself_is_left_alone(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    (Path(store.root) / "lost+found").mkdir()
    unreadable(monkeypatch, "iterdir", "lost+found")
    assert plan(store, ALL, 0.0).items == []
    assert store.list() == []


def test_what_cannot_be_removed_is_reported_and_the_rest_goes(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = store.save("mocap", "smpl.parquet", b"kept").key.rpartition("/")[0]
    gone = store.save("mocap", "smpl.parquet", b"gone").key.rpartition("/")[0]
    rmtree = shutil.rmtree

    def refused(path: Path) -> None:
        if path.name in kept:
            raise PermissionError(13, "Permission denied", str(path))
        rmtree(path)

    monkeypatch.setattr(shutil, "rmtree", refused)
    done = remove(store, plan(store, USUAL, 0.0))
    assert [item.key for item in done.gone] == [gone]
    assert done.failed == {kept: "Permission denied"}


def test_a_download_that_only_its_note_names_is_a_video(store: Store) -> None:
    made = store.save("video", "clip.mp4", b"frames")
    store.put("downloads/youtube/abc/best.json", f'{{"key": "{made.key}"}}'.encode())
    assert kind_of(store, made) == "videos"
    remove(store, plan(store, ["videos"], 0.0))
    assert keys(store) == {"downloads/youtube/abc/best.json"}


@pytest.mark.parametrize("stage", OF_VIDEOS)
def test_a_video_goes_with_the_records_of_its_download_and_assessment(
    stage: str, store: Store
) -> None:
    made = store.save("video", "clip.mp4", b"frames")
    store.put("downloads/youtube/abc/best.json", f'{{"key": "{made.key}"}}'.encode())
    recorded(store, "a.json", {"video": made}, stage)
    assert remove(store, plan(store, USUAL, 0.0)).gone == []
    remove(store, plan(store, ["videos"], 0.0))
    assert keys(store) == {"downloads/youtube/abc/best.json"}


@pytest.mark.parametrize("other", ["records/recover_motion/b.json", "runs/one.json"])
def test_a_video_that_more_than_its_download_names_stays_with_its_record(
    other: str, store: Store
) -> None:
    made = store.save("video", "clip.mp4", b"frames")
    record = recorded(store, "a.json", made, "download_video")
    store.put(other, f'{{"video": "{made.key}"}}'.encode())
    assert remove(store, plan(store, ["videos"], 0.0)).gone == []
    assert keys(store) == {made.key, record, other}


def test_stages_of_videos_are_stages() -> None:
    found = (download_video.download_video, download_video.take_file, probe_video.probe_video)
    assert tuple(stage.name for stage in (*found, assess_video.assess_video)) == OF_VIDEOS


@pytest.mark.parametrize("lock", ["task.lock", "lock", ".held"])
def test_work_that_a_process_holds_stays(lock: str, store: Store) -> None:
    folder = store.work("train-1")
    (folder / "checkpoint.zip").write_bytes(b"weights")
    before = plan(store, ["work"], 0.0)
    with locked(folder, lock):
        assert plan(store, ["work"], 0.0).going == []
        assert remove(store, before).gone == []  # it was taken up after the plan was made
        assert (folder / "checkpoint.zip").exists()
    assert [item.key for item in remove(store, before).gone] == ["work/train-1"]
    assert not folder.exists()


def test_while_a_process_uses_the_store_only_work_goes(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    store.save("mocap", "smpl.parquet", b"nobody's")
    store.work("train-1").joinpath("checkpoint.zip").write_bytes(b"weights")
    monkeypatch.setattr("storage.store_cleaning.users_of", lambda root: ["robojackson dance"])
    assert {item.kind for item in remove(store, plan(store, USUAL, 0.0)).gone} == {"work"}
    assert len(keys(store)) == 1


@pytest.mark.parametrize("url", ["", "file://"])
@pytest.mark.parametrize(("words", "used"), [("dance clip.mp4", True), ("server", False)])
def test_a_command_that_works_with_the_store_is_found(
    words: str, used: bool, url: str, store: Store
) -> None:
    environment = {**os.environ, "ROBOJACKSON_STORE": f"{url}{store.root}"}
    waits = "print(flush=True); input()"  # the first line: the process is what it was started as
    sleeps = [sys.executable, "-c", waits, "robojackson", *words.split()]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(sleeps, env=environment, **pipes) as process:  # type: ignore[call-overload]
        assert process.stdout is not None
        process.stdout.readline()
        found = users_of(Path(store.root))
        process.communicate(b"\n")
    assert found == ([f"robojackson dance (process {process.pid})"] if used else [])


@pytest.mark.parametrize(
    "module", ["prefect.engine", "prefect.flow_engine", "prefect.runner._workspace_supervisor"]
)
def test_a_run_of_a_worker_is_a_user(module: str) -> None:
    assert store_cleaning._command([sys.executable, "-m", module]) == "a run of a worker"


def test_a_store_without_users_has_none(store: Store) -> None:
    assert users_of(Path(store.root)) == []


def test_a_bucket_is_refused_with_what_to_do() -> None:
    with pytest.raises(StoreError, match="no folder of this machine"):
        inventory(Store("memory://bucket/clean"))


def test_a_store_that_is_not_there_is_not_made(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="there is no store"):
        inventory(Store(tmp_path / "none"))
    assert not (tmp_path / "none").exists()


def test_a_store_that_another_process_works_on_has_an_inventory(store: Store) -> None:
    """Its folders of work come and go while they are listed."""
    stop = threading.Event()

    def work() -> None:
        while not stop.is_set():
            with store.scratch() as folder:
                for name in "abcdef":
                    (folder / name).mkdir()
                    (folder / name / "x").write_text("")

    for number in range(30):
        recorded(store, f"{number}.json", "nothing")
    worker = threading.Thread(target=work)
    worker.start()
    try:
        for _ in range(30):
            assert sum(item.kind == "cache" for item in inventory(store)) == 30
    finally:
        stop.set()
        worker.join()


def test_what_a_linked_folder_refers_to_is_no_unused_result(store: Store, tmp_path: Path) -> None:
    made = store.save("train", "policy.safetensors", b"weights")
    (tmp_path / "disk").mkdir()
    (tmp_path / "disk" / "one.json").write_text(f'{{"policy": "{made.key}"}}')
    (Path(store.root) / "metrics").symlink_to(tmp_path / "disk")
    assert kind_of(store, made) == "kept"


def test_every_kind_is_explained(store: Store) -> None:
    store.save("mocap", "smpl.parquet", b"x")
    assert {item.kind for item in inventory(store)} <= set(KINDS)
