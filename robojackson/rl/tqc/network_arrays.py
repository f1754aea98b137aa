"""Actor and critics of a TQC run as named arrays, with equal names for every trainer, in
safetensors.

`actor.0.weight` (in, out), `actor.0.bias`, ..., `mean.*`, `log_std.*`, `critic1.0.weight`, ...,
`target1.0.weight`, ..., `log_alpha`; with layer normalisation
`critic1.norm.0.scale`, `critic1.norm.0.offset`, ... as well. Reading a file executes nothing.
"""

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import count, pairwise, takewhile
from pathlib import Path

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from robojackson.errors import BadPolicy
from robojackson.files.foreign_file import parse_json, require_file
from robojackson.rl.config.tqc_config import TqcConfig

FORMAT = "robojackson-networks-1"
CRITICS = ("critic1", "critic2")
TARGETS = ("target1", "target2")
Tensors = dict[str, np.ndarray]


@dataclass(frozen=True)
class Networks:
    """Weights to start from.

    Attributes:
        tensors: Arrays by name; critics and log_std may be missing.
        facts: Facts about their source.
    """

    tensors: Mapping[str, np.ndarray]
    facts: Mapping[str, object]

    @property
    def observation_size(self) -> int:
        """Return the length of the observation that the actor takes."""
        return int(self.tensors[self._first].shape[0])

    @property
    def _first(self) -> str:
        """Return the name of the actor's first weights."""
        return "actor.0.weight" if "actor.0.weight" in self.tensors else "mean.weight"

    @property
    def action_size(self) -> int:
        """Return the length of the action."""
        return int(self.tensors["mean.weight"].shape[1])

    @property
    def has_critics(self) -> bool:
        """Return whether both critics exist."""
        return all(f"{critic}.0.weight" in self.tensors for critic in CRITICS)

    @property
    def is_policy(self) -> bool:
        """Return whether they are a policy file's: an actor without critics and noise."""
        return not self.has_critics and "log_std.weight" not in self.tensors

    def widths(self, part: str) -> tuple[int, ...]:
        """Return the units of every layer of a part."""
        names = (f"{part}.{i}.weight" for i in count())
        return tuple(self.tensors[n].shape[1] for n in takewhile(self.tensors.__contains__, names))

    def without_unseen(self, seen: int) -> "Networks":
        """Return the networks with zeros where the actor's first weights are those of inputs that
        it does not see, which no update reaches: those after `seen`."""
        weight = self.tensors[self._first].copy()
        weight[seen:] = 0.0
        return replace(self, tensors={**self.tensors, self._first: weight})

    def with_first(self, change: Callable[[np.ndarray], np.ndarray]) -> "Networks":
        """Return the networks with other weights from their observation on."""
        first = {f"{part}.0.weight" for part in ("actor", *CRITICS, *TARGETS)}
        tensors = {name: change(t) if name in first else t for name, t in self.tensors.items()}
        return replace(self, tensors=tensors)

    @property
    def layer_norm(self) -> bool:
        """Return whether the critics' layers are normalised."""
        return f"{CRITICS[0]}.norm.0.scale" in self.tensors

    def to_bytes(self) -> bytes:
        """Return the content of the file."""
        arrays = {n: np.array(t, np.float32, order="C") for n, t in self.tensors.items()}
        return save(arrays, {FORMAT: json.dumps(dict(self.facts), sort_keys=True)})


def load_networks(path: Path) -> Networks:
    """Read a networks file.

    Raises:
        BadPolicy: the file is missing, foreign or not whole.
    """
    require_file(path, BadPolicy)
    try:
        with safe_open(path, framework="np") as file:
            header = file.metadata() or {}
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        facts = parse_json(header.get(FORMAT, "{}"))
    except (OSError, SafetensorError, TypeError, ValueError) as error:
        raise BadPolicy(f"{path} is no networks or policy file of ours ({error})") from error
    if FORMAT not in header:
        raise BadPolicy(
            f"{path} is not a {FORMAT} file; `robojackson train` writes networks.safetensors and "
            "policy.safetensors"
        )
    return require_complete(Networks(tensors, facts), path)


def require_complete(networks: Networks, path: Path) -> Networks:
    """Return the networks if all arrays exist, fit each other and are finite.

    Raises:
        BadPolicy: the message has the first wrong array.
    """
    tensors = networks.tensors
    weights = {"mean.weight", *(name for name in tensors if name.endswith(".weight"))}
    if flat := sorted(n for n in weights if n not in tensors or tensors[n].ndim != 2):
        raise BadPolicy(f"{path} is not whole: {flat[0]} is missing or not a matrix")
    needed = _shapes(networks)
    if missing := sorted(needed.keys() - tensors.keys()):
        raise BadPolicy(f"{path} is not whole: {missing[0]} is missing")
    if foreign := sorted(tensors.keys() - needed.keys()):
        raise BadPolicy(f"{path} holds {foreign[0]}, which belongs to no layer")
    for name, array in tensors.items():
        if array.shape != needed[name]:
            raise BadPolicy(
                f"{path}: {name} has the shape {array.shape}, its layers need {needed[name]}"
            )
        if not np.isfinite(array).all():
            raise BadPolicy(f"{path}: {name} holds values that are not finite")
    return networks


def _shapes(networks: Networks) -> dict[str, tuple[int, ...]]:
    """Return name and shape of every array of networks with such layers."""
    tensors, seen, acts = networks.tensors, networks.observation_size, networks.action_size
    actor = (seen, *_units(tensors, "actor"))
    shapes = _chain("actor", actor) | _layer("mean", actor[-1], acts)
    if any(name.startswith("log_std.") for name in tensors):
        shapes |= _layer("log_std", actor[-1], acts)
    critic = max((_units(tensors, part) for part in (*CRITICS, *TARGETS)), key=len)
    normed = any(".norm." in name for name in tensors)
    for part in (*CRITICS, *TARGETS):
        shapes |= _chain(part, (seen + acts, *critic)) if critic else {}
        for i, units in enumerate(critic[:-1] if normed else ()):
            shapes |= {f"{part}.norm.{i}.{kind}": (units,) for kind in ("scale", "offset")}
    return shapes | ({"log_alpha": ()} if "log_alpha" in tensors else {})


def _units(tensors: Mapping[str, np.ndarray], part: str) -> tuple[int, ...]:
    """Return the units of every layer of a part."""
    found = {m[1] for name in tensors if (m := re.fullmatch(rf"{part}\.(\d+)\.\w+", name))}
    biases = (tensors.get(f"{part}.{i}.bias", np.empty(0)) for i in range(len(found)))
    return tuple(bias.size for bias in biases)


def _chain(part: str, sizes: tuple[int, ...]) -> dict[str, tuple[int, ...]]:
    shapes: dict[str, tuple[int, ...]] = {}
    for i, (taken, given) in enumerate(pairwise(sizes)):
        shapes |= _layer(f"{part}.{i}", taken, given)
    return shapes


def _layer(name: str, taken: int, given: int) -> dict[str, tuple[int, ...]]:
    return {f"{name}.weight": (taken, given), f"{name}.bias": (given,)}


def fitted(config: TqcConfig, networks: Networks, critics: bool) -> TqcConfig:
    """Return the configuration with the networks' layers.

    Raises:
        BadPolicy: the critics do not have more quantiles than are dropped.
    """
    shaped = replace(config, actor=networks.widths("actor"))
    if not (critics and networks.has_critics):
        return shaped
    *hidden, quantiles = networks.widths(CRITICS[0])
    if quantiles <= config.top_quantiles_to_drop:
        raise BadPolicy(
            f"the critics to start from have {quantiles} quantiles, of which "
            f"{config.top_quantiles_to_drop} are dropped; start_critics=false takes the actor alone"
        )
    return replace(
        shaped, critic=tuple(hidden), layer_norm=networks.layer_norm, quantiles=quantiles
    )


def chosen(networks: Networks, critics: bool) -> Networks:
    """Return the networks, or the actor alone."""
    if critics and networks.has_critics:
        return networks
    kept = {
        n: t for n, t in networks.tensors.items() if n.split(".")[0] in ("actor", "mean", "log_std")
    }
    return replace(networks, tensors=kept)


def with_exploration(networks: Networks, log_std: float) -> Networks:
    """Return the networks with a constant exploration noise, where the actor has none of its own.

    Args:
        log_std: Logarithm of its standard deviation, before tanh.
    """
    if "log_std.weight" in networks.tensors:
        return networks
    mean = networks.tensors["mean.weight"]
    head = {
        "log_std.weight": np.zeros_like(mean),
        "log_std.bias": np.full(mean.shape[1], log_std, np.float32),
    }
    return replace(networks, tensors={**networks.tensors, **head})


def widened(networks: Networks, observation_size: int) -> Networks:
    """Return the same networks for an observation that is longer; the new inputs have weight
    zero."""
    old = networks.observation_size
    gap = np.zeros((observation_size - old, 1), np.float32)
    tensors = dict(networks.tensors)
    for part in ("actor", *CRITICS, *TARGETS):
        first = tensors.get(f"{part}.0.weight")
        if first is not None:
            filling = np.repeat(gap, first.shape[1], 1)
            tensors[f"{part}.0.weight"] = np.concatenate([first[:old], filling, first[old:]])
    return replace(networks, tensors=tensors)
