"""A restored store is the one that was backed up; else nothing is written and one line has why."""

import json
import os
import shutil
import sqlite3
import threading
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import fsspec
import pytest

from robojackson.errors import BackupFailed, RoboJacksonError
from robojackson.files.local_folder import sha256_of
from robojackson.pipeline.folder_lock import locked
from storage import store_backup, store_listing
from storage.backup import HELD, Backups
from storage.backup_progress import Progress
from storage.sqlite_database import SQLite
from storage.store import Store
from storage.store_backup import BackupResult, back_up
from storage.store_restore import Restored, restore

FILES = {
    "motion/0a/reference.parquet": b"PAR1" * 1000,
    "motion/0b/reference.parquet": b"PAR1" * 1000,
    "tables/part 0 ä.parquet": b"",
    "prefect/records/key": b"{}",
}
CONTENTS = len({sha256_of(content) for content in FILES.values()})


@pytest.fixture(params=["folder", "memory"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Store]:
    """Yield a store with files in it."""
    root = tmp_path / "store" if request.param == "folder" else f"memory://{tmp_path.name}/store"
    made = filled(Store(root))
    yield made
    fsspec.filesystem("memory").store.clear()


@pytest.fixture
def local(tmp_path: Path) -> Store:
    return filled(Store(tmp_path / "store"))


@pytest.fixture
def backups(tmp_path: Path) -> Backups:
    return Backups(tmp_path / "backups")


@pytest.fixture
def target(tmp_path: Path) -> Store:
    return Store(tmp_path / "target")


def filled(store: Store) -> Store:
    for key, content in FILES.items():
        store.put(key, content)
    return store


def database(store: Store) -> SQLite:
    """Return Prefect's database beside a store on a disk."""
    return SQLite(store.here / "prefect" / "prefect.db")


def backed_up(store: Store, backups: Backups, keep: int = 7) -> BackupResult:
    return back_up(store, database(store), backups, keep, lambda progress: None)


def restored(target: Store, backups: Backups, **options: object) -> Restored:
    return restore(target, database(target), backups, lambda progress: None, **options)  # type: ignore[arg-type]


def content(store: Store) -> dict[str, bytes]:
    return {key: store.read(key) for key in store.list()}


def saved(backups: Backups) -> list[Path]:
    return sorted(path for path in (backups.root / "contents").rglob("*") if path.is_file())


def test_a_restored_store_is_the_same_to_the_byte(
    store: Store, target: Store, backups: Backups
) -> None:
    made = backed_up(store, backups)
    assert made.files == len(FILES)
    assert restored(target, backups).files == len(FILES)
    assert content(target) == FILES


def test_a_content_is_in_the_folder_once(store: Store, backups: Backups) -> None:
    backed_up(store, backups)
    backed_up(store, backups)
    assert len(saved(backups)) == CONTENTS


def test_a_second_backup_copies_only_what_is_new(store: Store, backups: Backups) -> None:
    backed_up(store, backups)
    store.put("video/new.mp4", b"new")
    assert backed_up(store, backups).copied == 1


def test_an_unchanged_file_is_not_read_again(
    local: Store, backups: Backups, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store_listing, "RECENT_S", 0.0)
    backed_up(local, backups)
    monkeypatch.setattr(store_backup.shutil, "copyfile", None)  # calling it is an error
    assert backed_up(local, backups).files == len(FILES)


def test_a_file_altered_under_its_old_size_and_time_is_copied(
    local: Store, backups: Backups, target: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store_listing, "RECENT_S", 0.0)
    path = Path(local.root) / "prefect/records/key"
    backed_up(local, backups)
    before = path.stat()
    path.write_bytes(b"[]")
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    backed_up(local, backups)
    restored(target, backups)
    assert target.read("prefect/records/key") == b"[]"


def test_a_content_that_lost_bytes_is_copied_again(
    local: Store, backups: Backups, target: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store_listing, "RECENT_S", 0.0)
    backed_up(local, backups)
    saved(backups)[0].write_bytes(b"cut")
    backed_up(local, backups)
    restored(target, backups)
    assert content(target) == FILES


def test_a_content_that_is_damaged_is_replaced_by_the_copy_at_hand(
    local: Store, backups: Backups, target: Store
) -> None:
    """Its size is right, so that only its digest shows it."""
    backed_up(local, backups)
    for path in saved(backups):
        path.write_bytes(path.read_bytes()[::-1])
    backed_up(local, backups)  # of files so young that all are read again
    restored(target, backups)
    assert content(target) == FILES


def test_a_removed_file_is_in_the_backups_before_and_not_after(
    store: Store, target: Store, backups: Backups
) -> None:
    first = backed_up(store, backups)
    store.remove("prefect/records/key")
    backed_up(store, backups)
    assert set(backups.read().files) == FILES.keys() - {"prefect/records/key"}
    restored(target, backups, name=first.name)
    assert content(target) == FILES


def test_what_belongs_to_processes_of_one_machine_is_left_out(
    local: Store, backups: Backups
) -> None:
    for name in ("work/train-1/checkpoint", "a/.part-1", "prefect/prefect.db-wal"):
        path = Path(local.root) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x")
    elsewhere = SQLite(backups.root.parent / "home" / "prefect.db")
    back_up(local, elsewhere, backups, 7, lambda progress: None)
    assert set(backups.read().files) == set(FILES)


def test_linked_folders_of_a_store_are_backed_up_as_others(
    local: Store, backups: Backups, target: Store, tmp_path: Path
) -> None:
    disk, root = tmp_path / "disk", Path(local.root)
    (disk / "0c").mkdir(parents=True)
    (disk / "0c" / "clip.mp4").write_bytes(b"frames")
    (root / "video").symlink_to(disk)
    backed_up(local, backups)
    restored(target, backups)
    assert content(target) == {**FILES, "video/0c/clip.mp4": b"frames"}


def test_links_that_lead_back_or_to_the_backups_end_no_backup(
    local: Store, backups: Backups, tmp_path: Path
) -> None:
    disk, root = tmp_path / "disk", Path(local.root)
    disk.mkdir()
    (root / "self").symlink_to(root)
    (root / "disk").symlink_to(disk)
    (disk / "back").symlink_to(root)
    (root / "backups").symlink_to(backups.root)
    (root / "gone").symlink_to(tmp_path / "nowhere")
    for _ in range(2):
        assert backed_up(local, backups).files == len(FILES)


def test_a_database_in_the_store_is_dumped_and_not_copied(local: Store, backups: Backups) -> None:
    inside = SQLite(Path(local.root) / "mine" / "runs.db")
    with closing(made_database(inside.path, 1)):
        back_up(local, inside, backups, 7, lambda progress: None)
    made = backups.read()
    assert set(made.files) == set(FILES)
    assert made.database is not None


def test_the_oldest_backups_and_their_contents_go(local: Store, backups: Backups) -> None:
    local.put("old", b"of the first backup alone")
    backed_up(local, backups)
    local.remove("old")
    for _ in range(2):
        made = backed_up(local, backups, keep=2)
    assert len(backups.names()) == 2
    assert made.freed_mb == len(b"of the first backup alone") / 1e6
    assert len(saved(backups)) == CONTENTS


def test_nothing_goes_while_a_manifest_is_damaged(local: Store, backups: Backups) -> None:
    local.put("old", b"of the first backup alone")
    first = backed_up(local, backups)
    manifest(backups, first.name).write_text("{")
    local.remove("old")
    backed_up(local, backups, keep=2)
    assert len(saved(backups)) == CONTENTS + 1


def test_a_clock_that_was_set_back_does_not_hide_the_newest(local: Store, backups: Backups) -> None:
    first = manifest(backups, backed_up(local, backups).name)
    first.rename(first.with_stem("2999"))
    local.put("new", b"new")
    backed_up(local, backups)
    assert "new" in backups.read().files


def test_an_interrupted_backup_harms_none_before_and_is_resumed(
    local: Store, backups: Backups, target: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    backed_up(local, backups)
    for number in range(20):
        local.put(f"new/{number}", str(number).encode())
    copyfile, count = shutil.copyfile, iter(range(100))

    def interrupted(source: Path, path: Path) -> None:
        if next(count) == 12:
            path.write_bytes(b"half")
            raise KeyboardInterrupt
        copyfile(source, path)

    with monkeypatch.context() as patch:
        patch.setattr(store_backup.shutil, "copyfile", interrupted)
        with pytest.raises(KeyboardInterrupt):
            backed_up(local, backups)
    assert len(backups.names()) == 1
    assert set(backups.read().files) == set(FILES)
    assert not [path for path in saved(backups) if ".part-" in path.name]
    there = len(saved(backups))
    assert there > CONTENTS
    backed_up(local, backups)
    assert len(saved(backups)) == CONTENTS + 20
    restored(target, backups)
    assert content(target) == content(local)


def test_what_a_killed_backup_left_half_written_is_removed(local: Store, backups: Backups) -> None:
    left = backups.root / "contents" / ".part-x"
    left.parent.mkdir(parents=True)
    left.write_bytes(b"half")
    backed_up(local, backups)
    assert not left.exists()


def test_a_file_that_goes_away_while_it_is_copied_is_left_out(
    local: Store, backups: Backups, monkeypatch: pytest.MonkeyPatch
) -> None:
    copyfile = shutil.copyfile

    def gone(source: Path, path: Path) -> None:
        if source.name == "key":
            source.unlink()
        copyfile(source, path)

    monkeypatch.setattr(store_backup.shutil, "copyfile", gone)
    backed_up(local, backups)
    assert set(backups.read().files) == FILES.keys() - {"prefect/records/key"}


def test_two_backups_at_once_are_one(local: Store, backups: Backups) -> None:
    backups.root.mkdir()
    with locked(backups.root, HELD), pytest.raises(BackupFailed, match="another backup"):
        backed_up(local, backups)


def manifest(backups: Backups, name: str | None = None) -> Path:
    return backups.root / "backups" / f"{name or backups.names()[-1]}.json"


def altered(backups: Backups, change: Callable[[dict[str, object]], None], sign: bool) -> None:
    """Change the newest manifest; with a new digest, if `sign`."""
    path = manifest(backups)
    whole = json.loads(path.read_text())
    change(whole["backup"])
    if sign:
        whole["sha256"] = sha256_of(json.dumps(whole["backup"], sort_keys=True).encode())
    path.write_text(json.dumps(whole))


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1])


def piped(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def flip(path: Path) -> None:
    data = path.read_bytes()
    path.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))


def largest(backups: Backups) -> Path:
    return max(saved(backups), key=lambda path: path.stat().st_size)


DAMAGES: dict[str, tuple[Callable[[Backups], object], str]] = {
    "a content is missing": (lambda b: largest(b).unlink(), "missing from the backup"),
    "a content is truncated": (lambda b: cut(largest(b)), "truncated or altered: 3,999 bytes"),
    "a bit of a content is flipped": (lambda b: flip(largest(b)), "is altered: its sha256"),
    "the manifest is truncated": (lambda b: cut(manifest(b)), "is damaged"),
    "the manifest is a pipe": (lambda b: piped(manifest(b)), "is damaged: a device or a pipe"),
    "the manifest is empty": (lambda b: manifest(b).write_text(""), "is damaged"),
    "the manifest is no object": (lambda b: manifest(b).write_text("[]"), "is damaged"),
    "the manifest names another digest": (
        lambda b: altered(b, lambda m: m.update(store="x"), sign=False),
        "does not have the digest",
    ),
    "the manifest is of another layout": (
        lambda b: altered(b, lambda m: m.update(version=2), sign=True),
        "version",
    ),
    "the manifest has an unknown field": (
        lambda b: altered(b, lambda m: m.update(more=2), sign=True),
        "more",
    ),
    "a key leaves the store": (
        lambda b: altered(
            b,
            lambda m: m["files"].update(  # type: ignore[attr-defined]
                {"../x": {"sha256": "0" * 64, "size": 0}}
            ),
            sign=True,
        ),
        "no key of a store",
    ),
    "a key is no name of a file": (
        lambda b: altered(
            b,
            lambda m: m["files"].update(  # type: ignore[attr-defined]
                {"a\0b": {"sha256": "0" * 64, "size": 0}}
            ),
            sign=True,
        ),
        "no key of a store",
    ),
    "all backups are gone": (lambda b: manifest(b).unlink(), "holds no backup"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_of_a_damaged_backup_nothing_is_written(
    damage: str, local: Store, backups: Backups, target: Store
) -> None:
    backed_up(local, backups)
    harm, reason = DAMAGES[damage]
    harm(backups)
    with pytest.raises(BackupFailed, match=reason):
        restored(target, backups)
    assert not Path(target.root).exists()


def test_an_unknown_backup_is_named_with_the_known_ones(
    local: Store, backups: Backups, target: Store
) -> None:
    known = backed_up(local, backups).name
    with pytest.raises(BackupFailed, match=rf"'x'. Backups: {known}"):
        restored(target, backups, name="x")


def test_a_store_that_is_not_empty_is_left_alone(
    local: Store, backups: Backups, target: Store
) -> None:
    backed_up(local, backups)
    target.put("mine", b"mine")
    with pytest.raises(BackupFailed, match=r"not empty \(it has mine\).*--force"):
        restored(target, backups)
    assert content(target) == {"mine": b"mine"}


def test_force_replaces_what_the_backup_has_and_leaves_the_rest(
    local: Store, backups: Backups, target: Store
) -> None:
    backed_up(local, backups)
    target.put("mine", b"mine")
    target.put("prefect/records/key", b"other")
    made = restored(target, backups, force=True)
    assert content(target) == {**FILES, "mine": b"mine"}
    assert made.others == 1


def test_a_folder_of_backups_is_not_in_the_store(local: Store) -> None:
    with pytest.raises(BackupFailed, match="is in the store"):
        backed_up(local, Backups(Path(local.root) / "backups"))
    with pytest.raises(BackupFailed, match="is in the store"):
        backed_up(local, Backups(Path(local.root) / ".." / Path(local.root).name / "backups"))


def test_a_store_that_does_not_exist_is_not_backed_up(backups: Backups, tmp_path: Path) -> None:
    with pytest.raises(BackupFailed, match=r"cannot list .*No such file"):
        backed_up(Store(tmp_path / "typo"), backups)
    assert backups.names() == []


def test_an_empty_store_without_a_database_is_not_backed_up(
    backups: Backups, tmp_path: Path
) -> None:
    with pytest.raises(BackupFailed, match="nothing to back up"):
        backed_up(Store(tmp_path / "empty").create(), backups)
    assert not backups.root.exists()


def test_progress_has_files_bytes_and_rate(local: Store, backups: Backups) -> None:
    seen: list[str] = []
    for number in range(2):
        local.put(f"large/{number}", bytes([number]) * 1_000_000)
    back_up(local, database(local), backups, 7, lambda progress: seen.append(str(progress)))
    count = len(FILES) + 2
    assert len(seen) == count
    assert seen[-1].startswith(f"copied {count} of {count} files, 2.0 MB, ")


def test_the_rate_is_bytes_over_seconds() -> None:
    made = Progress("copied", 5, done=2, copied=30_000_000)
    made.began -= 10.0
    assert str(made) == "copied 2 of 5 files, 30.0 MB, 3.0 MB/s"


def rows(path: Path) -> list[tuple[int]]:
    with closing(sqlite3.connect(path)) as found:
        return list(found.execute("SELECT n FROM runs ORDER BY n"))


def made_database(path: Path, *numbers: int) -> sqlite3.Connection:
    """Return an open database like Prefect's: its newest rows are in the journal beside it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    made = sqlite3.connect(path, check_same_thread=False)
    made.execute("PRAGMA journal_mode = WAL")
    made.execute("CREATE TABLE IF NOT EXISTS runs (n INTEGER)")
    made.executemany("INSERT INTO runs VALUES (?)", [(n,) for n in numbers])
    made.commit()
    return made


def test_the_database_is_back_with_rows_that_were_in_its_journal(
    local: Store, backups: Backups, target: Store
) -> None:
    with closing(made_database(database(local).path, 1, 2)):
        backed_up(local, backups)
    restored(target, backups)
    assert rows(database(target).path) == [(1,), (2,)]
    assert {path.name for path in saved(backups)} == set(backups.read().contents())


def test_a_database_is_copied_whole_while_a_server_writes(local: Store, backups: Backups) -> None:
    """Two rows a transaction: a copy with an odd number has half of one."""
    end = threading.Event()
    with closing(made_database(database(local).path)) as live:

        def write() -> None:
            while not end.is_set():
                live.executemany("INSERT INTO runs VALUES (?)", [(1,), (1,)])
                live.commit()

        writer = threading.Thread(target=write)
        writer.start()
        try:
            for _ in range(5):
                backed_up(local, backups)
        finally:
            end.set()
            writer.join()
    dumps = [backups.read(name).database for name in backups.names()]
    counts = [len(rows(backups.path(dump.content))) for dump in dumps if dump is not None]
    assert len(counts) == 5
    assert len(set(counts)) > 1  # it wrote meanwhile
    assert all(count % 2 == 0 for count in counts)


def test_a_database_that_is_not_empty_is_left_alone(
    local: Store, backups: Backups, target: Store
) -> None:
    made_database(database(local).path, 1).close()
    backed_up(local, backups)
    made_database(database(target).path, 7).close()
    with pytest.raises(BackupFailed, match=r"database .* is not empty"):
        restored(target, backups)
    assert rows(database(target).path) == [(7,)]
    restored(target, backups, force=True)
    assert rows(database(target).path) == [(1,)]


def garbage(path: Path) -> None:
    """Overwrite the third page."""
    data = path.read_bytes()
    path.write_bytes(data[:8192] + b"\xff" * 4096 + data[12288:])


def lost_index(path: Path) -> None:
    """Forget an index, whose pages then belong to nothing."""
    with closing(sqlite3.connect(path)) as made:
        made.execute("CREATE INDEX lost ON runs (n)")
        made.execute("PRAGMA writable_schema = ON")
        made.execute("DELETE FROM sqlite_master WHERE name = 'lost'")
        made.commit()


@pytest.mark.parametrize("harm", [garbage, lost_index])
def test_a_damaged_dump_is_found_before_anything_is_written(
    harm: Callable[[Path], None], local: Store, backups: Backups, target: Store
) -> None:
    """A dump whose digest is right, of a database that was damaged already."""
    path = database(local).path
    with closing(made_database(path, *range(5000))) as made:
        made.execute("PRAGMA journal_mode = DELETE")
    harm(path)
    backed_up(local, backups)
    with pytest.raises(BackupFailed):
        restored(target, backups)
    assert not Path(target.root).exists()


def test_a_database_that_is_locked_is_one_line(
    local: Store, backups: Backups, target: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("storage.sqlite_database.BUSY_S", 0.1)
    made_database(database(local).path, 1).close()
    backed_up(local, backups)
    with closing(made_database(database(target).path, 7)) as live:
        live.execute("BEGIN IMMEDIATE")
        with pytest.raises(RoboJacksonError, match="locked; stop the Prefect server"):
            restored(target, backups, force=True)
    left = [key for key in content(target) if not key.startswith("prefect/prefect.db")]
    assert not left  # so that the same command works once the server has stopped
