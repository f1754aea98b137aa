"""Intervals, paired effects, curves and claims of an ablation, against values known otherwise."""

import itertools

import numpy as np
import pytest

from robojackson.metrics import ablation_statistics, learning_curve, seed_statistics

RNG = np.random.default_rng


def test_the_interval_of_a_mean_is_close_to_that_of_the_normal_law() -> None:
    samples = RNG(1).normal(5.0, 2.0, 60)
    found = seed_statistics.estimate(list(samples), RNG(2))
    half = 1.96 * samples.std(ddof=1) / np.sqrt(60)
    assert found.mean == pytest.approx(samples.mean())
    assert [found.low, found.high] == pytest.approx([found.mean - half, found.mean + half], abs=0.1)


def test_one_sample_has_no_interval() -> None:
    found = seed_statistics.estimate([3.0], RNG(0))
    assert (found.mean, found.count) == (3.0, 1)
    assert np.isnan(found.low)


def test_equal_samples_are_certain() -> None:
    assert seed_statistics.estimate([2.0, 2.0, 2.0], RNG(0)) == seed_statistics.Estimate(
        2.0, 2.0, 2.0, 3
    )


def test_the_p_of_pairs_is_that_of_all_sign_flips() -> None:
    treated, control = [3.0, 4.0, 6.0, 5.0], [1.0, 4.5, 3.0, 2.0]
    gaps = np.subtract(treated, control)
    means = [np.mean(gaps * signs) for signs in itertools.product((1, -1), repeat=4)]
    expected = np.mean(np.abs(means) >= abs(gaps.mean()) - 1e-12)
    assert seed_statistics.effect(treated, control, RNG(0)).p == pytest.approx(expected)


def test_three_pairs_cannot_give_a_smaller_p_than_a_quarter() -> None:
    found = seed_statistics.effect([9.0, 8.0, 7.0], [1.0, 1.5, 2.0], RNG(0))
    assert found.p == pytest.approx(0.25) == found.smallest_p


def test_the_p_of_many_pairs_is_as_small_as_it_can_be() -> None:
    pairs = 14
    found = seed_statistics.effect(list(range(1, pairs + 1)), [0.0] * pairs, RNG(0))
    assert found.p == pytest.approx(2.0 ** (1 - pairs)) == found.smallest_p


def test_samples_that_are_no_pairs_are_refused() -> None:
    with pytest.raises(ValueError, match="2 treated and 1 control"):
        seed_statistics.effect([1.0, 2.0], [1.0], RNG(0))


def test_the_probability_of_improvement_counts_pairs_and_halves_ties() -> None:
    first, second = np.array([1.0, 3.0]), np.array([1.0, 2.0, 4.0])
    wins = [(x > y) + 0.5 * (x == y) for x in first for y in second]
    found = seed_statistics.probability_of_improvement(first, second)
    assert found == pytest.approx(np.mean(wins))


def test_a_curve_is_the_mean_of_the_episodes_of_each_interval() -> None:
    steps, values = np.array([5.0, 10.0, 25.0]), np.array([1.0, 3.0, 8.0])
    found = learning_curve.curve(steps, values, np.array([0.0, 10.0, 20.0, 30.0]))
    assert found.tolist() == [2.0, 2.0, 8.0]


def test_before_the_first_episode_a_curve_has_no_value() -> None:
    found = learning_curve.curve(np.array([15.0]), np.array([4.0]), np.array([0.0, 10.0, 20.0]))
    assert np.isnan(found[0])
    assert found[1] == 4.0


def test_steps_to_a_threshold_count_until_it_is_kept() -> None:
    grid, values = np.array([0.0, 10, 20, 30, 40]), np.array([1.0, 9.0, 2.0, 9.0])
    assert learning_curve.steps_to(grid, values, 5.0) == 40.0
    assert learning_curve.steps_to(grid, values, 1.0) == 10.0
    assert learning_curve.steps_to(grid, values, 9.5) == np.inf


def figures(**setups: float) -> dict[tuple[str, str], dict[int, float]]:
    """Return five seeds of two moves, each setup a little better than nothing by a constant."""
    noise = RNG(4).normal(0.0, 0.05, 5)
    return {
        (move, setup.replace("_", "-")): {seed: value + noise[seed] for seed in range(5)}
        for move in ("shake", "walk")
        for setup, value in setups.items()
    }


WALKING = {"shake": False, "walk": True}


def verdicts(**setups: float) -> dict[str, str]:
    found = ablation_statistics.claims(figures(**setups), WALKING, RNG(0))
    return {claim.text: claim.verdict for claim in found}


def test_claims_hold_where_the_effect_has_the_sign_that_they_say() -> None:
    found = verdicts(scratch=0.1, pretrain=0.4, curiosity=0.2)
    assert found["Pretraining helps"] == "holds"
    assert found["Curiosity helps on dances"] == "reversed"
    assert found["Curiosity hurts on walking"] == "holds"


def test_an_effect_of_nothing_does_not_hold() -> None:
    assert verdicts(scratch=0.3, pretrain=0.3)["Pretraining helps"] == "not shown"


def test_an_effect_whose_interval_spans_zero_is_not_shown() -> None:
    """Four seeds of five gain, the fifth loses more than two of them: a mean alone would hold."""
    scratch = dict.fromkeys(range(5), 0.0)
    pretrain = dict(enumerate([0.2, 0.1, 0.15, 0.1, -0.4]))
    found = ablation_statistics.claims(
        {("walk", "scratch"): scratch, ("walk", "pretrain"): pretrain}, {"walk": True}, RNG(0)
    )
    claim = next(claim for claim in found if claim.text == "Pretraining helps")
    assert claim.effect is not None
    assert claim.effect.difference.mean > 0
    assert claim.verdict == "not shown"


def test_a_start_from_many_motions_is_a_claim_where_it_was_trained() -> None:
    many = "Pretraining on many motions helps"
    assert verdicts(scratch=0.1, pretrained_dancer=0.4)[many] == "holds"
    assert many not in verdicts(scratch=0.1, pretrain=0.4)
    for setups, pairs in (({"pretrained_dancer": 0.4}, 5), ({"pretrain": 0.4}, 4)):
        found = ablation_statistics.comparisons(figures(scratch=0.1, **setups), ["walk"], RNG(0))
        assert len(found) == pairs


def test_a_setup_that_was_not_trained_is_not_measured() -> None:
    assert verdicts(scratch=0.1, pretrain=0.4)["Curiosity helps on dances"] == "not measured"


@pytest.mark.parametrize("odd", [float("nan"), float("inf"), float("-inf")])
def test_a_seed_without_a_figure_does_not_make_an_effect(odd: float) -> None:
    treated, control = [0.71, 0.70, 0.69, 0.72, odd], [0.70, 0.72, 0.70, 0.71, 0.71]
    found = seed_statistics.effect(treated, control, RNG(0))
    without = seed_statistics.effect(treated[:-1], control[:-1], RNG(0))
    assert (found.p, found.smallest_p) == (without.p, without.smallest_p)
    assert found.improvement == without.improvement
    assert found.p > 0.1
