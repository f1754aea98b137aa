"""What may be trained on: lists without overlap, and near-duplicates found by their movement."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from benchmarks.learning.motion_distance import contained_share, windows
from benchmarks.learning.policies import BLAS, FROZEN, MOVES, frozen_kernels, require_frozen
from benchmarks.learning.split import DUPLICATE_SHARE, load_split, shares
from robojackson.cli.learning import walker_training
from robojackson.geometry.rotations import quat_to_matrix
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from tests.fixtures.robots import human

SPLIT = load_split()


@pytest.fixture(scope="module")
def motion() -> SmplSequence:
    return human("dance_b")


def test_no_motion_stands_in_two_lists() -> None:
    lists = [SPLIT.held_out, SPLIT.train, tuple(SPLIT.excluded)]
    names = [name for names in lists for name in names]
    assert len(names) == len(set(names))


def test_the_three_evaluation_dances_are_evaluated() -> None:
    assert {"cmu_05_02", "cmu_05_09", "cmu_05_18"} <= set(SPLIT.held_out)


@pytest.mark.parametrize("path", sorted(FROZEN.glob("*.parquet")), ids=lambda path: path.stem)
def test_a_frozen_reference_is_the_one_that_rows_are_measured_on(path: Path) -> None:
    assert path.stem in MOVES
    assert ReferenceMotion.load(path).robot == MOVES[path.stem].robot
    require_frozen(path.stem, path)


def test_each_row_has_a_frozen_reference() -> None:
    """Without one, `require_frozen` lets any motion pass."""
    assert {move.same_as or name for name, move in MOVES.items()} <= set(SPLIT.references)


def test_another_reference_is_refused() -> None:
    """A row that is measured on other poses is another row."""
    with pytest.raises(SystemExit, match=r"g1_walk: .* measured on"):
        require_frozen("g1_walk", FROZEN / "walk.parquet")


def test_every_near_duplicate_is_one_of_a_evaluated_motion() -> None:
    for found in SPLIT.excluded.values():
        assert found["of"] in SPLIT.held_out
        assert found["share"] >= DUPLICATE_SHARE


def test_what_sees_a_motion_that_it_may_not_is_named_with_what_is_not_claimed() -> None:
    for found in SPLIT.exceptions.values():
        for name in found["sees"]:
            assert name in (*SPLIT.held_out, *SPLIT.excluded)
            assert SPLIT.excluded.get(name, {"of": name})["of"] in found["nothing_claimed_on"]
        assert set(found["nothing_claimed_on"]) <= set(SPLIT.held_out)


def test_the_walk_that_pretrain_imitates_is_a_named_exception() -> None:
    assert SPLIT.exceptions["pretrain"]["sees"] == [Path(walker_training.WALK).stem]


def test_a_evaluated_motion_is_refused_for_training() -> None:
    SPLIT.require_trainable(SPLIT.train)
    with pytest.raises(ValueError, match="not for training: cmu_05_09"):
        SPLIT.require_trainable([*SPLIT.train, "cmu_05_09"])


def test_a_motion_elsewhere_and_turned_is_the_same(motion: SmplSequence) -> None:
    turn = quat_to_matrix(np.array([[np.cos(0.6), 0.0, 0.0, np.sin(0.6)]]))[0]
    moved = dataclasses.replace(motion, joints=motion.joints @ turn.T + [1.0, 2.0, 0.0])
    np.testing.assert_allclose(windows(moved), windows(motion), atol=1e-5)
    assert contained_share(windows(motion), windows(moved)) == 1.0


def test_a_mirrored_copy_is_found(motion: SmplSequence) -> None:
    order = (0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20, 23, 22)
    copy = dataclasses.replace(motion, joints=motion.joints[:, order] * [1.0, -1.0, 1.0])
    rows = shares({"a": motion, "b": copy}, ["a"])
    assert rows == [{"held_out": "a", "motion": "b", "share": 1.0}]


def test_another_movement_is_none(motion: SmplSequence) -> None:
    still = dataclasses.replace(
        motion, joints=np.repeat(motion.joints[:1] * [1.0, 1.0, 0.4], len(motion.joints), 0)
    )
    assert contained_share(windows(motion), windows(still)) == 0.0


@pytest.mark.parametrize("flag", ["avx512f", "avx2"])
def test_references_are_made_with_the_kernels_of_the_frozen_ones_where_they_run(
    flag: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "is_file", lambda path: True)
    monkeypatch.setattr(Path, "read_text", lambda path: f"flags : fpu {flag} sse2")
    assert frozen_kernels() == (BLAS if flag == "avx512f" else None)
