"""The league: a row of every dancer on every motion, from the results in the repository."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from benchmarks.learning import league, league_rows, tracker_rows
from benchmarks.learning.policies import FROZEN, MOVES, Folders

FOLDERS = Folders.at(None)
ROWS = list(league_rows.kept_rows(FOLDERS))


def one(who: str, motion: str) -> dict[str, Any]:
    (found,) = [row for row in ROWS if (row["who"], row["motion"]) == (who, motion)]
    return found


def test_every_motion_has_one_row_of_every_dancer() -> None:
    counts = Counter((row["motion"], row["who"]) for row in ROWS)
    assert set(counts.values()) == {1}
    for motion in league_rows.MOVES:
        trained = league_rows.ORDINARY if motion == "g1_walk" else league_rows.TRAINED
        scratch = motion in league_rows.WITHOUT_ESTIMATE
        onboard = league_rows.ONBOARD if scratch else league_rows.TRAINED_ONBOARD
        assert {who for found, who in counts if found == motion} == {
            *(league_rows.INSTANT, league_rows.INSTANT_ONBOARD, league_rows.TWIST2),
            *(league_rows.DANCER, league_rows.REPLAY, trained),
            *(league_rows.SCRATCH, onboard, league_rows.POLISHED),
        }


def test_no_motion_that_trackers_are_measured_on_is_left_out() -> None:
    measured = {row["move"] for row in tracker_rows.held_in(FOLDERS)}
    assert measured == set(league_rows.MOVES)


def test_a_row_has_its_figures_or_a_reason() -> None:
    for row in ROWS:
        shown = [row[name] for name in (*league_rows.FIGURES, "starts", "cpu_s", "data")]
        assert bool(row["why"]) == (shown == [None] * len(shown)), row
        if not row["why"]:
            assert row["strict_success"] is not None, row
            lacking = row["velocity_score"] is None or row["feet_excess_m_s"] is None
            assert not lacking or "velocity and feet" in row["note"], row


def test_figures_of_a_training_are_means_over_all_its_seeds() -> None:
    row = one(league_rows.TRAINED, "g1_dance_b")
    tables = [pd.read_parquet(FOLDERS.row("g1_dance_b", s, 10.0)) for s in range(100, 105)]
    every = pd.concat(table[table["policy"] == "trained"] for table in tables)
    assert (row["seeds"], row["starts"]) == (5, len(every) / 5)
    assert row["strict_success"] == pytest.approx(every["strict_success"].mean())
    assert one(league_rows.ONBOARD, "g1_authors_apt1")["seeds"] == 5


def test_the_regulator_beside_a_training_holds_as_many_starts_as_its_own_row() -> None:
    motion = "g1_dance_a"
    kept = pd.read_parquet(FOLDERS.row(motion, 100, 10.0))
    own = kept[kept["policy"] == "regulator"]["strict_success"].mean()
    assert one(league_rows.INSTANT, motion)["strict_success"] == pytest.approx(own, abs=0.05)
    assert one(league_rows.INSTANT, motion)["velocity_score"] is not None
    assert motion not in league_rows.NOTES


def test_the_replay_falls_as_the_bare_reference_beside_a_training_did() -> None:
    measured = {row["move"]: row for row in tracker_rows.held_in(FOLDERS)
                if row["tracker"] == tracker_rows.REPLAY}  # fmt: skip
    for motion in ("g1_walk_onboard", "g1_dance_b", "g1_authors_apt1"):
        kept = pd.read_parquet(FOLDERS.row(motion, 101 if "walk" in motion else 100, 10.0))
        bare = kept[kept["policy"] == "zero_residual"]["survived_s"].mean()
        move = motion.removesuffix("_onboard")
        assert measured[move]["survived_s"] == pytest.approx(bare, abs=0.15)
        assert one(league_rows.REPLAY, move)["strict_success"] == 0.0


def test_what_was_computed_for_the_motion_itself_has_seen_it() -> None:
    seen = {row["who"] for row in ROWS if row["in_training"] == "seen"}
    assert league_rows.INSTANT in seen
    assert {one("twist2", motion)["in_training"] for motion in ("g1_cmu_05_02",)} == {"likely"}


def test_rows_of_holosoma_s_motion_are_held_and_the_missing_ones_give_a_reason() -> None:
    held = league.held_in(FOLDERS.results / "league.json")
    rows = {row["who"]: row for row in league.on_holosomas(held, wheel=None)}
    networks = {"holosoma ppo", "holosoma fastsac", "twist2", league_rows.DANCER}
    assert networks | {league_rows.REPLAY} == set(held)
    assert all(rows[who]["why"] for who in rows if who not in held)
    assert {league_rows.SCRATCH, league_rows.TRAINED} <= set(rows)
    assert {row["starts"] for row in held.values()} == {25}


def test_the_kept_table_is_the_one_that_the_kept_rows_give(tmp_path: Path) -> None:
    path = FOLDERS.results / "league.json"
    rows = [*ROWS, *league.on_holosomas(league.held_in(path), wheel=None)]
    league.save(rows, tmp_path / "league.json")
    assert json.loads((tmp_path / "league.json").read_text()) == json.loads(path.read_text())
    assert (tmp_path / "league.md").read_text() == path.with_suffix(".md").read_text()


def test_trackers_are_measured_on_the_moves_whose_files_are_here(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ("ROBOJACKSON_PAPER", "ROBOJACKSON_CMU"):
        monkeypatch.delenv(name, raising=False)
    frozen = {path.stem for path in FROZEN.glob("*.parquet")}
    assert set(tracker_rows.moves_here()) == frozen
    (tmp_path / "05_02.bvh").touch()
    monkeypatch.setenv("ROBOJACKSON_CMU", str(tmp_path))
    assert set(tracker_rows.moves_here()) - frozen == {"g1_cmu_05_02"}
    assert "g1_walk_onboard" in MOVES  # the same motion as g1_walk: measured once


def test_a_row_without_a_figure_is_measured_again(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    full = dict.fromkeys(tracker_rows.WHOLE, 0.0)
    monkeypatch.setattr(tracker_rows, "evaluated", lambda *given: {**full, "cpu_s": 1.0})
    words = (["g1_hip_shake"], [tracker_rows.REPLAY], [1.0])
    (first,) = tracker_rows.measured(*words, [], Folders.at(tmp_path))
    assert list(tracker_rows.measured(*words, [first], Folders.at(tmp_path))) == []
    del first["velocity_score"]
    assert len(list(tracker_rows.measured(*words, [first], Folders.at(tmp_path)))) == 1
