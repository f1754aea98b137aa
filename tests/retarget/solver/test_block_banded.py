"""A Newton step on the band is the step of the dense normal equations."""

import numpy as np
import pytest

from robojackson.retarget.solver.block_banded import Chain, Normal


def _random_system(frames: int, ring: bool, rng: np.random.Generator):
    """Return random residuals over three successive frames, in blocks and as one dense matrix."""
    unknowns, normal = 4, Normal.empty(frames, 4)
    first = np.arange(frames if ring else frames - 2)
    rows = tuple(rng.normal(size=(len(first), 6, unknowns)) for _ in range(3))
    residual = rng.normal(size=(len(first), 6))
    normal.add_chained(residual, lambda: rows, first)
    dense = np.zeros((len(first), 6, frames, unknowns))
    for k, row in enumerate(rows):
        for t in first:
            dense[t, :, (t + k) % frames] += row[t]
    return normal, dense.reshape(-1, frames * unknowns), residual.ravel()


@pytest.mark.parametrize("ring", [False, True])
@pytest.mark.parametrize("frames", [7, 8, 21])
def test_the_step_solves_the_dense_normal_equations(ring: bool, frames: int, rng):
    normal, dense, residual = _random_system(frames, ring, rng)
    step = Chain(frames, 4, ring).step(normal, np.ones((frames, 4), bool), 0.0)
    expected = -np.linalg.lstsq(dense, residual, rcond=None)[0]
    np.testing.assert_allclose(step.ravel(), expected, atol=1e-6)


@pytest.mark.parametrize("ring", [False, True])
def test_held_unknowns_stay_and_the_others_are_optimal(ring: bool, rng):
    normal, dense, residual = _random_system(9, ring, rng)
    free = rng.random((9, 4)) < 0.7
    step = Chain(9, 4, ring).step(normal, free, 0.0)
    expected = np.zeros(36)
    chosen = free.ravel()
    expected[chosen] = -np.linalg.lstsq(dense[:, chosen], residual, rcond=None)[0]
    np.testing.assert_allclose(step.ravel(), expected, atol=1e-6)


def test_the_cost_is_half_the_sum_of_squares(rng):
    normal, _, residual = _random_system(9, True, rng)
    assert normal.cost == pytest.approx(0.5 * residual @ residual)


def test_derivatives_wait_until_they_are_read(rng):
    normal, computed = Normal.empty(3, 4), []

    def jacobian():
        computed.append("rows")
        return np.ones((3, 2, 4))

    normal.add_rows(np.ones((3, 2)), jacobian)
    normal.later(lambda: computed.append("later"))
    assert normal.cost == 3.0
    assert not computed
    np.testing.assert_array_equal(normal.gradient, 2.0)
    np.testing.assert_array_equal(normal.blocks[0], 2.0)
    assert computed == ["rows", "later"]
