"""The loss of TQC's critics (Kuznetsov et al., 2020, eq. 10-14) in JAX, laid out for a CPU: the
batch is the innermost axis and one target after the other is compared with all quantiles, so that
no array is larger than the cache; the lowest target quantiles are found by their rank, not by
sorting; the gradient of the Huber loss is explicit.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


def lowest(values: Float[Array, "T B"], count: int) -> Bool[Array, "T B"]:
    """Return which values of each column are among its lowest; of equal ones the first."""
    order = jnp.arange(len(values))[:, None]

    def passed(i: int, rank: Array) -> Array:
        other = values[i]
        return rank + ((other < values) | ((other == values) & (i < order)))

    rank = jax.lax.fori_loop(0, len(values), passed, jnp.zeros(values.shape, jnp.int32))
    result: Bool[Array, "T B"] = rank < count
    return result


def quantile_huber(
    current: Float[Array, "Q B"],
    targets: Float[Array, "T B"],
    kept: Bool[Array, "T B"],
    count: int,
) -> tuple[Float[Array, ""], Float[Array, "Q B"]]:
    """Return the quantile Huber loss over the `count` selected targets of each column, and its
    gradient by the current quantiles.
    """
    quantiles, batch = current.shape
    share = ((jnp.arange(quantiles, dtype=jnp.float32) + 0.5) / quantiles)[:, None]

    def added(i: int, sums: tuple[Array, Array]) -> tuple[Array, Array]:
        miss = targets[i] - current
        bent = jnp.clip(miss, -1, 1)
        push = jnp.where(miss < 0, 1 - share, share) * kept[i] * bent
        return sums[0] + push * (miss - 0.5 * bent), sums[1] + push

    nothing = jnp.zeros_like(current)
    loss, push = jax.lax.fori_loop(0, len(targets), added, (nothing, nothing))
    pairs = quantiles * count * batch
    return jnp.sum(loss) / pairs, -push / pairs
