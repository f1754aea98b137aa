"""A store writes whole files or none, on a disk, in an object store, and where writing fails."""

import errno
import os
import resource
import shutil
from collections.abc import Iterator
from pathlib import Path

import fsspec
import pytest
from fsspec.implementations.memory import MemoryFileSystem
from moto.server import ThreadedMotoServer

from robojackson.errors import StoreError
from robojackson.files.places import PART
from storage.artifact import Artifact
from storage.store import Store


class FullDisk(MemoryFileSystem):
    """Writes half of what it gets, then the disk is full."""

    protocol = "fulldisk"
    store: dict[str, object] = {}  # noqa: RUF012
    pseudo_dirs = [""]  # noqa: RUF012

    def pipe_file(self, path: str, value: bytes, mode: str = "overwrite", **kwargs: object) -> None:
        super().pipe_file(path, value[: len(value) // 2], mode)
        raise OSError(errno.ENOSPC, "No space left on device")

    def put_file(self, lpath: str, rpath: str, **kwargs: object) -> None:
        self.pipe_file(rpath, Path(lpath).read_bytes())


fsspec.register_implementation("fulldisk", FullDisk, clobber=True)


@pytest.fixture(scope="session")
def s3_url() -> Iterator[str]:
    """Yield a bucket of a local S3 server."""
    server = ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AWS_ACCESS_KEY_ID", "test")
        patch.setenv("AWS_SECRET_ACCESS_KEY", "test")
        patch.setenv("AWS_DEFAULT_REGION", "us-east-1")
        patch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
        fsspec.filesystem("s3").mkdir("dances")
        yield "s3://dances/store"
    server.stop()


@pytest.fixture(params=["folder", "s3", "memory"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Store:
    if request.param == "s3":
        return Store(request.getfixturevalue("s3_url") + f"/{tmp_path.name}")
    if request.param == "memory":
        return Store(f"memory://{tmp_path.name}")
    return Store(tmp_path / "store")


def files_under(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.rglob("*") if p.is_file())


def test_what_was_put_is_read(store: Store) -> None:
    store.put("mocap/a.bin", b"pose")
    assert store.read("mocap/a.bin") == b"pose"


def test_a_local_file_is_put_like_bytes(store: Store, tmp_path: Path) -> None:
    (tmp_path / "clip.mp4").write_bytes(b"frames")
    artifact = store.save("video", "clip.mp4", tmp_path / "clip.mp4")
    assert artifact == store.save("video", "clip.mp4", b"frames")


@pytest.mark.medium
def test_a_large_file_goes_to_an_object_store_in_parts(
    s3_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A restore puts eight at a time: whole ones would fill the memory of its container."""
    store, path = Store(f"{s3_url}/{tmp_path.name}"), tmp_path / "video.mp4"
    with path.open("wb") as file:
        file.truncate(5 * PART // 2)
    sent: list[int] = []
    call = store.place._system._call_s3

    async def noted(method: str, *args: object, **given: object) -> object:
        sent.append(len(given.get("Body", b"")))
        return await call(method, *args, **given)

    monkeypatch.setattr(store.place._system, "_call_s3", noted)
    monkeypatch.setattr(Path, "read_bytes", lambda path: pytest.fail("it was read whole"))
    artifact = store.put("video.mp4", path)
    assert [size for size in sent if size] == [PART, PART, PART // 2]
    assert store.sha256("video.mp4") == artifact.sha256


def test_a_file_that_is_cut_off_on_its_way_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"12345678")
    store = Store("fulldisk://dances")
    with pytest.raises(StoreError, match="No space left"):
        store.put("a/x", tmp_path / "a")
    assert FullDisk.store == {}


def test_a_second_put_replaces_the_first(store: Store) -> None:
    store.put("a", b"old")
    store.put("a", b"new")
    assert store.read("a") == b"new"


def test_list_returns_the_keys_under_a_folder(store: Store) -> None:
    for key in ("runs/b.json", "runs/a.json", "other/c.json"):
        store.put(key, b"{}")
    assert store.list("runs") == ["runs/a.json", "runs/b.json"]


def test_exists_only_what_was_put(store: Store) -> None:
    store.put("a", b"x")
    assert (store.exists("a"), store.exists("b")) == (True, False)


def test_a_store_that_does_not_answer_is_no_absence(monkeypatch: pytest.MonkeyPatch) -> None:
    store = Store("memory://dances")

    def refuse(path: str) -> dict[str, str]:
        raise PermissionError("403")

    monkeypatch.setattr(store.place._system, "info", refuse)
    with pytest.raises(StoreError, match="cannot look at memory://dances/a"):
        store.exists("a")


def test_an_unaltered_artifact_verifies(store: Store) -> None:
    artifact = store.put("a", b"x")
    assert store.verify(artifact) is artifact


def test_an_altered_artifact_does_not_verify(store: Store) -> None:
    artifact = store.put("a", b"x")
    store.put("a", b"y")
    with pytest.raises(StoreError, match="was altered"):
        store.verify(artifact)


def test_a_missing_artifact_does_not_verify(store: Store) -> None:
    with pytest.raises(StoreError, match="cannot read"):
        store.verify(Artifact(key="gone", sha256="0" * 64))


def test_different_content_is_kept_under_different_keys(store: Store) -> None:
    assert store.save("s", "x", b"1").key != store.save("s", "x", b"2").key


def test_local_gives_a_file_with_the_content(store: Store) -> None:
    with store.local(store.put("a/clip.mp4", b"frames")) as path:
        assert (path.name, path.read_bytes()) == ("clip.mp4", b"frames")


def test_a_writable_store_is_left_as_it_was(store: Store) -> None:
    store.require_writable()
    assert store.list() == []


def test_a_failed_write_keeps_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.put("a/x", b"old")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(StoreError) as caught:
            store.put("a/x", b"n" * 5000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert "\n" not in str(caught.value)
    assert (store.read("a/x"), files_under(tmp_path)) == (b"old", ["x"])


def test_a_full_remote_disk_is_one_line_and_leaves_nothing() -> None:
    store = Store("fulldisk://dances")
    with pytest.raises(StoreError, match=r"^cannot write fulldisk://dances/a/x: No space left"):
        store.put("a/x", b"12345678")
    assert FullDisk.store == {}


def test_a_full_store_is_reported_before_any_work() -> None:
    with pytest.raises(StoreError, match=r"^cannot write the store fulldisk://dances: No space"):
        Store("fulldisk://dances").require_writable()


def test_a_disk_with_too_little_room_is_reported_with_both_figures(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    usage = shutil.disk_usage(tmp_path)._replace(free=12_300_000)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage)
    with pytest.raises(StoreError, match=r"has 12\.3 MB free, 200 MB are needed"):
        Store(tmp_path / "store").require_writable(room_mb=200)
    assert files_under(tmp_path) == []


def test_an_unwritable_root_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(StoreError, match="Not a directory"):
        Store(tmp_path / "file" / "store").require_writable()


def test_a_root_that_no_one_can_open_is_one_line() -> None:
    with pytest.raises(StoreError, match="cannot open the store nonsense://x"):
        Store("nonsense://x")


def test_the_environment_names_the_store(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "elsewhere"))
    assert Store.from_environment().root == str(tmp_path / "elsewhere")


def test_a_file_for_a_store_is_reported_at_once(tmp_path: Path) -> None:
    (tmp_path / "clip.mp4").write_text("a video")
    with pytest.raises(StoreError, match="a file; expected a folder"):
        Store(tmp_path / "clip.mp4")


def test_what_is_no_regular_file_is_never_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    with pytest.raises(StoreError, match="a device or a pipe"):
        Store(tmp_path).put("pipe", b"x")
    with pytest.raises(StoreError, match="a folder; name a file in it"):
        Store(tmp_path).put("folder", b"x")
    assert (tmp_path / "pipe").is_fifo()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder", "pipe"]


def test_a_link_stays_one_and_a_file_keeps_its_mode(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    file, link = tmp_path / "far" / "notes.csv", tmp_path / "link.csv"
    file.write_bytes(b"old")
    file.chmod(0o600)
    link.symlink_to(file)
    Store(tmp_path).put("link.csv", b"new")
    assert (link.is_symlink(), file.read_bytes(), file.stat().st_mode & 0o777) == (
        True,
        b"new",
        0o600,
    )


def test_a_name_that_no_one_can_read_is_refused_before_it_is_written(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="no UTF-8"):
        Store(tmp_path).put(os.fsdecode(b"b\xff.csv"), b"x")
    assert files_under(tmp_path) == []
