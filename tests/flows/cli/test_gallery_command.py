"""The gallery of a store: every run that was evaluated, and pictures that are made once."""

import io
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from storage.run_catalogue import Run, record
from storage.store import Store
from tests.fixtures.commands import in_process


def publish(store: Store, run_id: str, move: str, brightness: int) -> None:
    encoded = io.BytesIO()
    Image.fromarray(np.full((300, 900, 3), brightness, np.uint8)).save(encoded, "PNG")
    made = {
        "still": store.save("still", "still.png", encoded.getvalue()),
        "evaluation": store.save("evaluate", "evaluation.json", b"{}"),
        "page": store.put(f"dances/{run_id}/index.html", b"page"),
    }
    record(store, Run(
        run_id=run_id, move=move, robot="humanoid", setup="scratch", seed=0,
        finished_at=datetime(2026, 11, 23, tzinfo=UTC), artifacts=made, summary={"skill": 0.5},
    ))  # fmt: skip


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Store:
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path))
    return Store(tmp_path)


def test_gallery_shows_every_run_and_makes_a_picture_once(store: Store, tmp_path: Path) -> None:
    publish(store, "one", "hip_shake", 10)
    assert in_process("gallery", "--json").answer["runs"] == 1
    (first,) = (tmp_path / "gallery").iterdir()
    with Image.open(first) as picture:
        assert picture.width == 360
    made_at = first.stat().st_mtime_ns
    publish(store, "two", "walk", 200)
    assert in_process("gallery", "--json").answer["runs"] == 2
    assert first.stat().st_mtime_ns == made_at
    assert len(list((tmp_path / "gallery").iterdir())) == 2
    page = (tmp_path / "gallery.html").read_text()
    assert page.count('href="dances/') == page.count('src="data:image/jpeg') == 2
    assert in_process("gallery", "--dance", "walk", "--json").answer["runs"] == 1


def test_a_run_that_was_not_evaluated_is_left_out(store: Store) -> None:
    publish(store, "one", "hip_shake", 10)
    unfinished = Run(
        run_id="three", move="walk", robot="g1", setup="x", seed=1,
        finished_at=datetime(2026, 11, 23, tzinfo=UTC),
    )  # fmt: skip
    record(store, unfinished)
    assert in_process("gallery", "--json").answer["runs"] == 1


@pytest.mark.parametrize("name", ["hip_shake", "Hip shake", "HIP-SHAKE"])
def test_a_dance_is_found_by_the_name_that_a_person_gives_it(store: Store, name: str) -> None:
    publish(store, "one", "hip_shake", 10)
    assert in_process("gallery", "--dance", name, "--json").answer["runs"] == 1


def test_a_dance_that_was_never_danced_leaves_the_page_as_it_is(
    store: Store, tmp_path: Path
) -> None:
    publish(store, "one", "hip_shake", 10)
    in_process("gallery")
    before = (tmp_path / "gallery.html").read_bytes()
    refused = in_process("gallery", "--dance", "moonwalk")
    assert refused.code == 1
    assert "unknown dance 'moonwalk'" in refused.err
    assert "Known: hip_shake" in refused.err
    assert (tmp_path / "gallery.html").read_bytes() == before
