"""The arithmetic of `make bench-learning`, on numbers whose answers are known."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.learning import learning_suite, policies, races, tracker_rows, training_rows
from benchmarks.learning.error_line import errors_in_one_line
from benchmarks.learning.policies import MOVES, Folders, source_of
from benchmarks.learning.rows.row_bars import LIMBS, bars
from benchmarks.learning.summary import cluster_interval, counted_rollouts, line, summary
from benchmarks.learning.training_curve import area, first_at
from tests.fixtures.row_rollouts import rollouts


def test_the_area_of_a_straight_rise_is_its_mean() -> None:
    assert area([(0.0, 0, 0.0), (10.0, 100, 4.0)], 10.0) == pytest.approx(2.0, rel=1e-3)


def test_nothing_survives_before_the_first_episode_ends() -> None:
    assert area([(5.0, 1, 2.0), (10.0, 2, 2.0)], 10.0) == pytest.approx(1.0, rel=2e-3)


def test_a_level_is_reached_once() -> None:
    points = [(1.0, 1, 0.5), (2.0, 2, 1.5), (3.0, 3, 1.0)]
    assert first_at(points, 1.0) == 2.0
    assert first_at(points, 9.0) is None


def test_a_walker_that_halves_the_time_saves_the_other_half() -> None:
    slow = [(float(t), t, 0.1 * t) for t in range(101)]
    quick = [(0.5 * t, t, 0.1 * t) for t in range(101)]
    found = races.compared(slow, quick, 100.0)
    assert found["saved_cpu_s"] == pytest.approx(0.5 * 95, abs=1.5)
    assert found["pretrain_s"] > found["scratch_s"]


def test_a_walker_pays_after_its_cost_over_what_it_saves() -> None:
    pairs = [{"seed": 0, "scratch_s": 1.0, "pretrain_s": 2.0, "level_s": 2.0, "saved_cpu_s": 50.0}]
    result = races.concluded(pairs, minutes=5, cost_s=400.0)
    assert result["pays_after_dances"] == pytest.approx(8)
    assert result["gain_95"] == [1.0, 1.0]


def test_a_line_shows_the_mean_and_the_worst_seed() -> None:
    result = line("hip_shake", MOVES["hip_shake"], 10.0, [rollouts(1.0, 1.0), rollouts(0.9, 1.0)])
    assert result["strict_success"] == pytest.approx(0.95)
    assert result["worst_seed"] == pytest.approx(0.9)
    assert result["holds"]
    assert result["beside"]["statue"]["survived_s"] == 10.0


def test_steps_are_reported_only_where_every_seed_has_them() -> None:
    first, second = rollouts(1.0, 1.0), rollouts(1.0, 1.0)
    first[0]["step"], second[0]["step"] = 1000, None
    assert line("walk", MOVES["walk"], 10.0, [first])["steps"] == 1000
    assert line("walk", MOVES["walk"], 10.0, [first, second])["steps"] is None


def test_a_limb_that_flails_misses_its_own_bar_alone() -> None:
    rows = rollouts(1.0, 1.0)
    rows[0]["limb_gain_left_hand"] = 2.0
    result = line("hip_shake", MOVES["hip_shake"], 10.0, [rows])
    assert [bar for bar, held in result["bars"].items() if not held] == ["gain left_hand 0.8-1.2"]


def test_of_the_authors_walk_on_the_humanoid_limbs_are_reported_and_have_no_bar() -> None:
    result = line("authors_walk", MOVES["authors_walk"], 10.0, [rollouts(1.0, 3.0)])
    assert not any("gain" in bar for bar in result["bars"])
    assert result["limb_gain"]["head"] == 3.0


@pytest.mark.parametrize("name", ["dance_b", "authors_apt1"])
def test_the_humanoid_s_feet_have_a_bar_of_their_own(name: str) -> None:
    rows = rollouts(1.0, 1.0)
    rows[0] |= {"limb_gain_left_foot": 0.76, "limb_r2_left_foot": 0.41}
    rows[0] |= {"limb_gain_right_foot": 0.74, "limb_r2_right_foot": 0.39}
    found = line(name, MOVES[name], 10.0, [rows])["bars"]
    feet = {bar: held for bar, held in found.items() if "foot" in bar and "excess" not in bar}
    assert feet == {
        "gain left_foot 0.75-1.2": True,
        "R2 left_foot >= 0.4": True,
        "gain right_foot 0.75-1.2": False,
        "R2 right_foot >= 0.4": False,
    }


def test_the_authors_clips_on_the_g1_have_every_bar_of_its_rows() -> None:
    rows = rollouts(1.0, 0.78)
    rows[0] |= {"mpjpe_l_m": 0.05, "acceleration_ratio": 2.17}
    row = line("g1_authors_apt1_onboard", MOVES["g1_authors_apt1_onboard"], 10.0, [rows])
    missed = [bar for bar, held in row["bars"].items() if not held]
    gains = [f"gain {limb} 0.8-1.2" for limb in LIMBS if limb != "head"]
    assert missed == ["mpjpe_l <= 22 mm", "acceleration <= 1.5", *gains]
    assert "worst seed >= 0.75" in row["bars"]
    assert not any("head" in bar for bar in row["bars"])


def test_a_mean_over_survivors_says_so() -> None:
    whole = [{"mpjpe_l_m": 0.01}, {"mpjpe_l_m": 0.05}]
    survivors = [{"mpjpe_l_m": 0.01}, {"mpjpe_l_m": None}, {"mpjpe_l_m": float("nan")}]
    assert counted_rollouts(whole) == "all 2 rollouts"
    assert counted_rollouts(survivors) == "1 of 3 rollouts, fallen robots left out"
    assert counted_rollouts([{}]) is None
    rows = [{**rollouts(1.0, 1.0)[0], "mpjpe_l_m": value} for value in (0.01, None)]
    row = line("dance_b", MOVES["dance_b"], 10.0, [rows])
    assert (row["mpjpe_l_m"], row["mpjpe_rollouts"]) == (
        0.01,
        "1 of 2 rollouts, fallen robots left out",
    )


def test_accelerations_that_were_not_recorded_have_no_bar() -> None:
    row = line("g1_walk", MOVES["g1_walk"], 10.0, [rollouts(1.0, 1.0)])
    assert not any("acceleration" in bar for bar in bars(row, "g1_walk", MOVES["g1_walk"]))


def test_the_interval_of_equal_seeds_is_a_point() -> None:
    np.testing.assert_allclose(cluster_interval([0.9, 0.9, 0.9]), (0.9, 0.9))


def test_without_the_authors_files_their_rows_are_left_out(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv(policies.PAPER, raising=False)
    training_rows.policies(["authors_apt1"], [0], None, 1, Folders.at(tmp_path))
    assert source_of(MOVES["authors_apt1"]) is None
    assert list(tmp_path.iterdir()) == []


def test_the_row_of_a_robot_s_own_sensors_has_the_same_motion_and_twice_the_time(
    tmp_path: Path,
) -> None:
    own, onboard = MOVES["g1_walk"], MOVES["g1_walk_onboard"]
    assert (onboard.cpu_minutes, onboard.success, onboard.worst) == (2 * own.cpu_minutes, 0.9, 0.75)
    assert (onboard.skill, onboard.mpjpe_mm) == (pytest.approx(own.skill - 0.1), 33)
    made = policies.reference_of("g1_walk_onboard", Folders.at(tmp_path))
    frozen = (policies.FROZEN / "g1_walk.parquet").read_bytes()
    assert made.read_bytes() == frozen
    made.unlink()  # its gate.json stays
    assert policies.reference_of("g1_walk_onboard", Folders.at(tmp_path)).read_bytes() == frozen


@pytest.fixture
def began(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the words of the first command of a row, which is stopped there."""
    found: list[str] = []

    def stop(*words: object, core: int | None = None) -> None:
        found.extend(map(str, words))
        raise SystemExit

    monkeypatch.setattr(training_rows, "must", stop)
    return found


@pytest.mark.parametrize(("name", "seen"), [("g1_walk", "full"), ("g1_walk_onboard", "onboard")])
def test_a_row_is_trained_on_its_own_inputs(
    name: str, seen: str, began: list[str], tmp_path: Path
) -> None:
    with pytest.raises(SystemExit):
        training_rows.train_and_judge(name, 0, None, Folders.at(tmp_path), 0)
    assert f"track.observation={seen}" in began


@pytest.mark.parametrize(
    ("by_steps", "expected"),
    [(False, ["cpu_minutes=5.0", "steps=250000"]), (True, ["steps=250000"])],
)
def test_a_slow_machine_trains_by_steps_alone(
    by_steps: bool, expected: list[str], began: list[str], tmp_path: Path
) -> None:
    with pytest.raises(SystemExit):
        training_rows.train_and_judge("g1_walk", 0, 5.0, Folders.at(tmp_path), 0, by_steps)
    assert [word for word in began if "steps=" in word or "cpu_minutes=" in word] == expected


def test_who_falls_after_ten_seconds_has_lasted_that_long() -> None:
    falls_late, falls_early = ({"fell": True, "survived_s": s} for s in (10.4, 9.9))
    assert tracker_rows.lasts(falls_late, 10.0)
    assert not tracker_rows.lasts(falls_early, 10.0)
    assert tracker_rows.lasts({"fell": False, "survived_s": 7.3}, 10.0)


def test_rows_of_another_budget_are_distinguished(tmp_path: Path) -> None:
    folders = Folders.at(tmp_path)
    own, brief = folders.row("walk", 0, 10.0), folders.row("walk", 0, 10.0, 1.0)
    assert (own.name, brief.name) == ("walk-s0.parquet", "walk-1min-s0.parquet")
    folders.rows.mkdir(parents=True)
    brief.write_bytes(b"read by no table")
    assert summary(folders) == []


def test_a_peer_that_does_not_arrive_took_all_of_its_time(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    curves = iter(
        [
            {"points": [(100.0, 1, 5.1)], "reached": True},
            {"points": [(998.0, 1, 2.2)], "reached": False},
        ]
    )
    monkeypatch.setattr(races, "curve_of", lambda *given: next(curves))
    monkeypatch.setattr(races, "reference_of", lambda *given: tmp_path)
    found = races.survival(Folders.at(tmp_path), 10)
    assert (found["ratio"], found["holds"]) == (pytest.approx(0.1), True)
    assert found["peer_is_lower_bound"]


def test_a_truncated_row_is_named_in_one_line_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = Folders.at(tmp_path).rows
    rows.mkdir(parents=True)
    whole = Folders.at(None).row("g1_walk", 104, 10.0).read_bytes()
    (rows / "g1_walk-s104.parquet").write_bytes(whole[: len(whole) // 2])
    monkeypatch.setattr("sys.argv", ["learning_suite", "table", "--folder", str(tmp_path)])
    with pytest.raises(SystemExit) as left, errors_in_one_line():
        learning_suite.main()
    assert "g1_walk-s104.parquet" in str(left.value)
    assert "\n" not in str(left.value)
    assert [path.name for path in rows.parent.iterdir()] == ["learning"]
