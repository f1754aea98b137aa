"""Actor and critics of sbx as plain functions of their parameters, gradients laid out for a CPU.

Equal to flax's results except for rounding. XLA takes longer over a product whose left side is
transposed: three times as long if the other side is narrow, a third longer if the rows are a
multiple of the cache's sets apart. So the gradient of a narrow kernel is computed transposed, and
that of a wide one from a transposed copy. The actor's loss needs a critic's gradient by the action
alone: an observation is not an input of that product.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import tensorflow_probability.substrates.jax as tfp
from jaxtyping import Array, Float
from sbx.common.distributions import TanhTransformedDistribution

from robojackson.rl.config.tqc_config import NORM_EPSILON

NARROW = 128
"""Outputs of a kernel below which its gradient is computed transposed."""
LOG_STD_RANGE = (-20.0, 2.0)
Parameters = Any


@jax.custom_vjp
def dense(
    x: Float[Array, "B I"], kernel: Float[Array, "I O"], bias: Float[Array, " O"]
) -> Float[Array, "B O"]:
    """Return the output of a layer without its activation."""
    return x @ kernel + bias


def _forward(x: Array, kernel: Array, bias: Array) -> tuple[Array, tuple[Array, Array]]:
    return dense(x, kernel, bias), (x, kernel)


def _backward(kept: tuple[Array, Array], slope: Array) -> tuple[Array, Array, Array]:
    x, kernel = kept
    # Otherwise XLA transposes the product again.
    as_it_stands: Callable[[Array], Array] = jax.lax.optimization_barrier
    if slope.shape[1] < NARROW:
        by_kernel = as_it_stands(slope.T @ x).T
    elif x.shape[1] % NARROW == 0:
        by_kernel = as_it_stands(x.T) @ slope
    else:
        by_kernel = x.T @ slope
    return slope @ kernel.T, by_kernel, slope.sum(0)


dense.defvjp(_forward, _backward)


def quantiles(
    params: Parameters, observations: Float[Array, "B O"], actions: Float[Array, "B A"]
) -> Float[Array, "B Q"]:
    """Return a critic's quantiles."""
    return _rest(params, dense(jnp.concatenate([observations, actions], 1), *_layer(params, 0)))


def quantiles_of_actions(
    params: Parameters, observations: Float[Array, "B O"], actions: Float[Array, "B A"]
) -> Float[Array, "B Q"]:
    """Return a critic's quantiles where only the gradient by the action is needed."""
    kernel, bias = _layer(params, 0)
    seen = observations @ kernel[: observations.shape[1]]
    return _rest(params, seen + dense(actions, kernel[observations.shape[1] :], bias))


def actions_of(
    params: Parameters, observations: Float[Array, "B O"], seen: int | None = None
) -> Any:
    """Return the actor's distribution over actions: a Gaussian squashed by tanh.

    Args:
        seen: Number of first inputs that the actor sees; all of them when None.
    """
    hidden, last = observations[:, :seen], len(params["params"]) - 2
    for i in range(last):
        kernel, bias = _layer(params, i)
        hidden = jax.nn.relu(dense(hidden, kernel[: hidden.shape[1]], bias))
    heads = (_layer(params, last), _layer(params, last + 1))
    kernel, bias = (jnp.concatenate(pair, -1) for pair in zip(*heads, strict=True))
    mean, log_std = jnp.split(dense(hidden, kernel, bias), 2, 1)
    spread = jnp.exp(jnp.clip(log_std, *LOG_STD_RANGE))
    return TanhTransformedDistribution(
        tfp.distributions.MultivariateNormalDiag(loc=mean, scale_diag=spread)
    )


def dense_count(params: Parameters) -> int:
    """Return the number of dense layers among a network's layers."""
    return sum(name.startswith("Dense_") for name in params["params"])


def _layer(params: Parameters, i: int) -> tuple[Array, Array]:
    layer = params["params"][f"Dense_{i}"]
    return layer["kernel"], layer["bias"]


def _rest(params: Parameters, first: Array) -> Array:
    """Return the output of the layers after a critic's first."""
    value, normal = first, "LayerNorm_0" in params["params"]
    for i in range(1, dense_count(params)):
        value = _normal(params, i - 1, value) if normal else value
        value = dense(jax.nn.relu(value), *_layer(params, i))
    return value


def _normal(params: Parameters, i: int, value: Array) -> Array:
    """Return a value after layer normalisation (Ba et al. 2016)."""
    layer = params["params"][f"LayerNorm_{i}"]
    centred = value - value.mean(1, keepdims=True)
    spread = jnp.square(centred).mean(1, keepdims=True)
    result: Array = centred * jax.lax.rsqrt(spread + NORM_EPSILON) * layer["scale"] + layer["bias"]
    return result
