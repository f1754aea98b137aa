"""Parameters of sbx's networks, which are trees of flax, as named numpy arrays."""

from collections.abc import Mapping
from typing import Any

import jax
import numpy as np

from robojackson.rl.tqc.dense_networks import dense_count
from robojackson.rl.tqc.network_arrays import Tensors
from robojackson.rl.tqc.trainer import Layers


def dense_layers(params: Any) -> Layers:
    """Return dense layers in order as numpy arrays; an actor's last two are mean and log std."""
    tree = jax.device_get(params)["params"]
    names = [f"Dense_{i}" for i in range(dense_count(params))]
    return tuple((np.asarray(tree[n]["kernel"]), np.asarray(tree[n]["bias"])) for n in names)


def _places(params: Any, part: str) -> dict[str, tuple[str, str]]:
    """Return module and leaf of flax's tree for each of our tensors of a part."""
    dense = dense_count(params)
    heads = {dense - 2: "mean", dense - 1: "log_std"} if part == "actor" else {}
    places: dict[str, tuple[str, str]] = {}
    for i in range(dense):
        name, module = heads.get(i, f"{part}.{i}"), f"Dense_{i}"
        places |= {f"{name}.weight": (module, "kernel"), f"{name}.bias": (module, "bias")}
    for i in range(len(params["params"]) - dense):
        name, module = f"{part}.norm.{i}", f"LayerNorm_{i}"
        places |= {f"{name}.scale": (module, "scale"), f"{name}.offset": (module, "bias")}
    return places


def tensors_of(params: Any, part: str) -> Tensors:
    """Return the parameters of a part by our names."""
    tree = jax.device_get(params)["params"]
    places = _places(params, part).items()
    return {name: np.array(tree[module][leaf]) for name, (module, leaf) in places}


def filled(params: Any, tensors: Mapping[str, np.ndarray], part: str) -> Any:
    """Return the parameters with named arrays in their places."""
    tree = jax.tree_util.tree_map(lambda leaf: leaf, params)
    for name, (module, leaf) in _places(params, part).items():
        if name in tensors:
            tree["params"][module][leaf] = jax.numpy.asarray(tensors[name], jax.numpy.float32)
    return tree
