"""A dance that a tracker does not hold is tried slower; what it holds best is kept."""

import json
from pathlib import Path

import pytest

from flows.video_pass.slower_dance import Artifacts, slower_where_it_falls
from robojackson.retarget.scorecard_gate import BARS
from storage.store import Store

TEMPOS = (0.93, 0.87, 0.8)


class Clip:
    """A clip whose tracker holds a share of the starts at each tempo."""

    def __init__(self, store: Store, held: dict[float, float], refused: float = 0.0) -> None:
        self._store, self._held, self._refused = store, held, refused
        self.tried: list[float] = []

    def at(self, tempo: float, slowed: float = 1.0) -> Artifacts:
        """Return the clip at a tempo."""
        card = {**dict.fromkeys(BARS, 0.0), "tempo": tempo, "tempo_mean": slowed}
        card |= {"infeasible_share": float(tempo == self._refused)}
        saved = self._store.save("retarget", "scorecard.json", json.dumps(card).encode())
        return {"scorecard": saved}

    def tempo(self, moved: Artifacts) -> float:
        """Return the tempo that was given for a retargeted clip."""
        return float(json.loads(self._store.read(moved["scorecard"].key))["tempo"])

    def look(self, moved: Artifacts) -> float:
        """Return the share of starts that the tracker holds."""
        self.tried.append(self.tempo(moved))
        return self._held[self.tried[-1]]


def danced(clip: Clip, first: Artifacts, gate: bool = True) -> float:
    """Return the tempo at which the clip is danced."""
    return clip.tempo(slower_where_it_falls(first, TEMPOS, clip.at, clip.look, gate))


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Store:
    """Return an empty store."""
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path))
    return Store.from_environment()


def test_what_holds_keeps_its_tempo_and_nothing_else_is_tried(store: Store) -> None:
    clip = Clip(store, {1.0: 0.5})
    assert danced(clip, clip.at(1.0)) == 1.0
    assert clip.tried == [1.0]


def test_the_fastest_tempo_that_holds_is_danced(store: Store) -> None:
    clip = Clip(store, {1.0: 0.0, 0.93: 0.88, 0.87: 1.0})
    assert danced(clip, clip.at(1.0)) == 0.93
    assert clip.tried == [1.0, 0.93]


@pytest.mark.parametrize(
    ("held", "tempo"),
    [((0.1, 0.15, 0.3, 0.35), 0.87), ((0.2, 0.0, 0.0, 0.25), 1.0)],
)
def test_where_none_holds_it_is_the_one_that_is_clearly_best(
    store: Store, held: tuple[float, ...], tempo: float
) -> None:
    clip = Clip(store, dict(zip((1.0, *TEMPOS), held, strict=True)))
    assert danced(clip, clip.at(1.0)) == tempo


def test_no_faster_tempo_than_the_certificate_allows_is_tried(store: Store) -> None:
    clip = Clip(store, {1.0: 0.0, 0.8: 1.0})
    assert danced(clip, clip.at(1.0, slowed=0.85)) == 0.8
    assert clip.tried == [1.0, 0.8]


def test_a_tempo_at_which_the_certificate_fails_is_passed_over(store: Store) -> None:
    clip = Clip(store, {1.0: 0.0, 0.93: 1.0, 0.87: 0.9}, refused=0.93)
    assert danced(clip, clip.at(1.0)) == 0.87
    again = Clip(store, {1.0: 0.0, 0.93: 1.0, 0.87: 0.9}, refused=0.93)
    assert danced(again, again.at(1.0), gate=False) == 0.93
