"""The critics' loss beside the formula of the paper, computed by sorting and by differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from robojackson.rl.tqc.quantile_loss import lowest, quantile_huber

QUANTILES, TARGETS, KEPT, BATCH = 5, 8, 6, 3


def drawn() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    return rng.normal(0, 2, (QUANTILES, BATCH)), rng.normal(0, 2, (TARGETS, BATCH))


def formula(current: np.ndarray, target_quantiles: np.ndarray) -> float:
    """Compute the loss of the lowest targets, pair by pair."""
    total = 0.0
    for b in range(BATCH):
        for target in np.sort(target_quantiles[:, b])[:KEPT]:
            for i, value in enumerate(current[:, b]):
                miss = target - value
                huber = 0.5 * miss**2 if abs(miss) <= 1 else abs(miss) - 0.5
                total += abs((i + 0.5) / QUANTILES - (miss < 0)) * huber
    return total / (BATCH * KEPT * QUANTILES)


def ours(current: np.ndarray, target_quantiles: np.ndarray) -> tuple[jax.Array, jax.Array]:
    aims = jnp.asarray(target_quantiles, jnp.float32)
    return quantile_huber(jnp.asarray(current, jnp.float32), aims, lowest(aims, KEPT), KEPT)


@pytest.mark.medium
def test_the_loss_is_the_papers() -> None:
    current, expected = drawn()
    np.testing.assert_allclose(ours(current, expected)[0], formula(current, expected), rtol=1e-5)


def test_the_slope_is_what_the_loss_changes_by() -> None:
    current, expected = drawn()
    slope = np.asarray(ours(current, expected)[1])
    for place in np.ndindex(current.shape):
        step = np.zeros_like(current)
        step[place] = 1e-5
        rise = formula(current + step, expected) - formula(current - step, expected)
        np.testing.assert_allclose(slope[place], rise / 2e-5, atol=1e-5)


def test_of_equal_values_the_first_are_the_lowest() -> None:
    kept = np.asarray(lowest(jnp.array([[2.0], [1.0], [2.0], [2.0]]), 2))
    assert kept[:, 0].tolist() == [True, True, False, False]
