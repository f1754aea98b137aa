"""Laws of the flow: it can be inverted, and its samples follow its prior."""

import numpy as np
import pytest

from robojackson.mocap.temporal import error_flow

WIDTH = 24


@pytest.fixture(scope="module")
def weights() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(5)
    made = {
        "flow.memory": np.full(error_flow.SIZE, 2.0),
        "flow.read.weight": rng.normal(size=(error_flow.CONDITION, WIDTH)),
        "flow.read.bias": rng.normal(size=error_flow.CONDITION),
    }
    for layer in range(error_flow.LAYERS):
        name = f"flow.couplings.{layer}"
        made[f"{name}.0.weight"] = 0.2 * rng.normal(
            size=(error_flow.HIDDEN, error_flow.SIZE + error_flow.CONDITION)
        )
        made[f"{name}.0.bias"] = rng.normal(size=error_flow.HIDDEN)
        made[f"{name}.2.weight"] = 0.05 * rng.normal(size=(2 * error_flow.SIZE, error_flow.HIDDEN))
        made[f"{name}.2.bias"] = 0.1 * rng.normal(size=2 * error_flow.SIZE)
    return made


def test_back_and_forth_is_the_identity(weights: dict[str, np.ndarray]) -> None:
    rng = np.random.default_rng(1)
    error, features = rng.normal(size=(50, error_flow.SIZE)), rng.normal(size=(50, WIDTH))
    z = error_flow.to_embedding(error, features, weights)
    assert np.abs(error_flow.to_error(z, features, weights) - error).max() < 1e-5


def test_the_flow_is_not_the_identity(weights: dict[str, np.ndarray]) -> None:
    rng = np.random.default_rng(2)
    error, features = rng.normal(size=(50, error_flow.SIZE)), rng.normal(size=(50, WIDTH))
    assert np.abs(error_flow.to_embedding(error, features, weights) - error).mean() > 0.1


def test_the_embedding_depends_on_what_was_seen(weights: dict[str, np.ndarray]) -> None:
    rng = np.random.default_rng(3)
    error = rng.normal(size=(5, error_flow.SIZE))
    one, other = (
        error_flow.to_embedding(error, rng.normal(size=(5, WIDTH)), weights) for _ in range(2)
    )
    assert np.abs(one - other).max() > 0.1


def test_every_coordinate_is_changed_by_some_layer() -> None:
    assert (sum(1.0 - error_flow.mask_of(layer) for layer in range(error_flow.LAYERS)) > 0).all()


def test_samples_are_a_stationary_ar1_of_unit_variance(weights: dict[str, np.ndarray]) -> None:
    z = error_flow.sample(20_000, weights, np.random.default_rng(4))
    memory = 1.0 / (1.0 + np.exp(-2.0))
    assert abs(z.std() - 1.0) < 0.02
    assert abs((z[1:] * z[:-1]).mean() - memory) < 0.02
