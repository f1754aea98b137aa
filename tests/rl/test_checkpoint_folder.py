"""Laws of checkpoints on disk: whole or not at all."""

from pathlib import Path

import pytest

from robojackson.errors import StoreError
from robojackson.rl.checkpoint_folder import (
    OLD_CHECKPOINT,
    REPLAY,
    RESULTS,
    begin,
    newest_checkpoint,
    write_checkpoint,
)


def write(out: Path, text: str) -> None:
    def save(folder: Path) -> None:
        (folder / "run.json").write_text(text)

    write_checkpoint(out, save, dict.fromkeys(RESULTS, text.encode()))


def contents(out: Path) -> dict[str, str]:
    return {
        path.relative_to(out).as_posix(): path.read_text()
        for path in out.rglob("*")
        if path.is_file()
    }


def test_a_new_checkpoint_replaces_the_one_before(tmp_path: Path) -> None:
    for text in ("first", "second"):
        write(tmp_path, text)
    assert contents(tmp_path) == dict.fromkeys(("checkpoint/run.json", *RESULTS), "second")


def test_a_checkpoint_that_cannot_be_written_leaves_the_one_before(tmp_path: Path) -> None:
    write(tmp_path, "first")
    before = contents(tmp_path)

    def fail(folder: Path) -> None:
        (folder / "half").write_text("half")
        raise OSError("no space left")

    with pytest.raises(StoreError, match="the checkpoint cannot be written"):
        write_checkpoint(tmp_path, fail, {})
    assert contents(tmp_path) == before


def test_between_the_two_renames_the_one_before_counts(tmp_path: Path) -> None:
    write(tmp_path, "first")
    (tmp_path / "checkpoint").rename(tmp_path / OLD_CHECKPOINT)
    assert newest_checkpoint(tmp_path) == tmp_path / OLD_CHECKPOINT


def test_results_of_another_training_are_renamed(tmp_path: Path) -> None:
    assert newest_checkpoint(tmp_path) is None
    (tmp_path / RESULTS[0]).write_text("another")
    begin(tmp_path)
    assert contents(tmp_path) == {f"before-{RESULTS[0]}": "another"}


@pytest.mark.parametrize("file", ["checkpoint/epoch1.pt", "replay/game.npz"])
def test_files_of_something_else_stay(tmp_path: Path, file: str) -> None:
    (tmp_path / file).parent.mkdir()
    (tmp_path / file).write_text("another")
    with pytest.raises(StoreError, match=r"something else.*give another folder"):
        begin(tmp_path)
    assert contents(tmp_path) == {file: "another"}


def test_the_replay_of_a_training_without_a_checkpoint_goes(tmp_path: Path) -> None:
    (tmp_path / REPLAY).mkdir()
    (tmp_path / REPLAY / f"{0:012d}-{64:012d}.npz").write_bytes(b"old")
    begin(tmp_path)
    assert contents(tmp_path) == {}
