"""A folder has one holder, and nothing is left when it is let go."""

import time
from pathlib import Path
from threading import Thread

import pytest

from robojackson.errors import StoreError
from robojackson.pipeline.folder_lock import FOR_EVER, locked


def test_a_second_holder_is_reported_in_one_line(tmp_path: Path) -> None:
    held = pytest.raises(StoreError, match="another training is running there")
    with locked(tmp_path), held, locked(tmp_path):
        raise AssertionError("two hold it")


def test_the_message_names_what_holds_the_folder(tmp_path: Path) -> None:
    held = pytest.raises(StoreError, match=f"^{tmp_path}: another download is running there; wait")
    with locked(tmp_path), held, locked(tmp_path, holder="another download"):
        raise AssertionError("two hold it")


def test_a_refused_holder_does_not_let_a_third_one_in(tmp_path: Path) -> None:
    with locked(tmp_path):
        for _ in range(2):
            with pytest.raises(StoreError), locked(tmp_path):
                raise AssertionError("two hold it")


def test_a_folder_that_is_let_go_is_as_it_was(tmp_path: Path) -> None:
    with locked(tmp_path):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_a_dead_process_left_holds_nothing(tmp_path: Path) -> None:
    (tmp_path / "lock").write_text("")
    with locked(tmp_path):
        assert (tmp_path / "lock").exists()


def test_a_patient_process_gets_the_lock_after_its_holder(tmp_path: Path) -> None:
    order = []

    def wait() -> None:
        with locked(tmp_path, patience_s=FOR_EVER):
            order.append("patient")

    waiting = Thread(target=wait)
    with locked(tmp_path):
        waiting.start()
        time.sleep(0.2)
        order.append("first")
    waiting.join(10)
    assert order == ["first", "patient"]
    assert list(tmp_path.iterdir()) == []
