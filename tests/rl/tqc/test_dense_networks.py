"""Our layers beside flax's: the same values and the same gradients."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from sbx.common.policies import ContinuousCritic, SquashedGaussianActor

from robojackson.rl.tqc import dense_networks

BATCH, SEEN, ACTS, QUANTILES = 7, 12, 3, 5


UNITS = {"narrow": [16, 24], "wide": [128, 128]}


@pytest.fixture(params=UNITS)
def units(request: pytest.FixtureRequest) -> list[int]:
    """Return the units of the hidden layers."""
    return UNITS[request.param]


@pytest.fixture(params=[False, True], ids=["plain", "normalised"])
def made(request: pytest.FixtureRequest, units: list[int]) -> SimpleNamespace:
    """Return networks of sbx, their parameters, and inputs."""
    keys = iter(jax.random.split(jax.random.PRNGKey(0), 4))
    seen = jax.random.normal(next(keys), (BATCH, SEEN))
    acts = jax.random.normal(next(keys), (BATCH, ACTS))
    critic = ContinuousCritic(units, use_layer_norm=request.param, output_dim=QUANTILES)
    actor = SquashedGaussianActor(net_arch=units, action_dim=ACTS)
    return SimpleNamespace(
        seen=seen,
        acts=acts,
        critic=critic,
        actor=actor,
        of_critic=critic.init(next(keys), seen, acts),
        of_actor=actor.init(next(keys), seen),
    )


def same(ours: object, theirs: object) -> None:
    for mine, other in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
        np.testing.assert_allclose(mine, other, rtol=2e-4, atol=1e-5)


@pytest.mark.slow
def test_a_critic_and_its_slope_by_parameters_are_flaxs(made: SimpleNamespace) -> None:
    def squared(apply: object) -> object:
        return jax.value_and_grad(lambda p: jnp.sum(apply(p, made.seen, made.acts) ** 2))  # type: ignore[operator]

    same(
        squared(dense_networks.quantiles)(made.of_critic),
        squared(made.critic.apply)(made.of_critic),
    )  # type: ignore[operator]


@pytest.mark.medium
def test_a_critics_slope_by_actions_is_flaxs(made: SimpleNamespace) -> None:
    def squared(apply: object) -> object:
        return jax.value_and_grad(
            lambda acts: jnp.sum(apply(made.of_critic, made.seen, acts) ** 2)  # type: ignore[operator]
        )

    same(
        squared(dense_networks.quantiles_of_actions)(made.acts),
        squared(made.critic.apply)(made.acts),
    )  # type: ignore[operator]


@pytest.mark.medium
def test_an_actor_and_its_slope_are_flaxs(made: SimpleNamespace) -> None:
    def compiled(apply: object) -> object:
        def value(params: object) -> jax.Array:
            chosen = apply(params, made.seen)  # type: ignore[operator]
            actions = chosen.sample(seed=jax.random.PRNGKey(1))
            return jnp.sum(actions) + jnp.mean(chosen.log_prob(actions))

        return jax.value_and_grad(value)

    same(
        compiled(dense_networks.actions_of)(made.of_actor),
        compiled(made.actor.apply)(made.of_actor),
    )  # type: ignore[operator]
