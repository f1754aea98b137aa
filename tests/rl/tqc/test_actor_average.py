from pathlib import Path

import numpy as np

from robojackson.rl.tqc.actor_average import ActorAverage
from robojackson.rl.tqc.trainer import Layers

SEEN = 0
"""Updates of an actor that no mean takes in any more."""


def layers(seed: int) -> Layers:
    rng = np.random.default_rng(seed)
    return ((rng.normal(size=(3, 2)).astype(np.float32), rng.normal(size=2).astype(np.float32)),)


def test_a_young_mean_weighs_all_rounds_alike() -> None:
    average = ActorAverage(0.99)
    for i in range(5):
        average.add(layers(i), i + 1)
    expected = np.mean([layers(i)[0][0] for i in range(5)], 0)
    np.testing.assert_allclose(average.layers(layers(9), SEEN)[0][0], expected, rtol=1e-5)


def test_an_old_mean_forgets_at_its_rate() -> None:
    average = ActorAverage(0.5)
    for i in range(9):
        average.add(layers(i), i + 1)
    weights = np.array([0.5**8, *(0.5 ** (9 - i) for i in range(1, 9))])
    expected = np.tensordot(weights, [layers(i)[0][1] for i in range(9)], 1)
    np.testing.assert_allclose(average.layers(layers(9), SEEN)[0][1], expected, rtol=1e-5)


def test_a_round_counts_once() -> None:
    average = ActorAverage(0.5)
    average.add(layers(0), 1)
    average.add(layers(1), 1)
    np.testing.assert_array_equal(average.layers(layers(9), SEEN)[0][0], layers(0)[0][0])


def test_without_a_past_the_newest_actor_is_the_policy() -> None:
    average = ActorAverage(0.0)
    average.add(layers(0), 1)
    np.testing.assert_array_equal(average.layers(layers(9), SEEN)[0][0], layers(9)[0][0])


def test_the_newest_actor_is_in_the_policy_and_not_in_the_mean_that_goes_on() -> None:
    average = ActorAverage(0.5)
    average.add(layers(0), 1)
    for _ in range(2):
        mean = (layers(0)[0][0] + layers(9)[0][0]) / 2
        np.testing.assert_allclose(average.layers(layers(9), 2)[0][0], mean, rtol=1e-5)


def test_before_any_update_the_newest_actor_is_the_policy() -> None:
    average = ActorAverage(0.5)
    average.add(layers(0), 0)
    np.testing.assert_array_equal(average.layers(layers(9), 0)[0][0], layers(9)[0][0])


def test_a_saved_mean_goes_on_as_one_that_was_not(tmp_path: Path) -> None:
    whole, first, second = (ActorAverage(0.8) for _ in range(3))
    for i in range(6):
        whole.add(layers(i), i + 1)
        (first if i < 3 else second).add(layers(i), i + 1)
        if i == 2:
            first.save(tmp_path)
            second.load(tmp_path)
    np.testing.assert_array_equal(second.layers((), SEEN)[0][0], whole.layers((), SEEN)[0][0])
