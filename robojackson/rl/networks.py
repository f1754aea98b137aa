"""Actor and critics of a TQC run as named arrays, the same names for every trainer, in safetensors.

`actor.0.weight` (in, out), `actor.0.bias`, ..., `mean.*`, `log_std.*`, `critic1.0.weight`, ...,
`target1.0.weight`, ..., `log_alpha`; with layer normalisation
`critic1.norm.0.scale`, `critic1.norm.0.offset`, ... as well. Reading a file executes nothing.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from robojackson.errors import BadPolicy
from robojackson.rl.tqc_config import TqcConfig

FORMAT = "robojackson-networks-1"
CRITICS = ("critic1", "critic2")
TARGETS = ("target1", "target2")
Tensors = dict[str, np.ndarray]


@dataclass(frozen=True)
class Networks:
    """Weights to start from.

    Attributes:
        tensors: By name; critics and log_std may be missing.
        facts: Where they come from.
    """

    tensors: Mapping[str, np.ndarray]
    facts: Mapping[str, object]

    @property
    def observation_size(self) -> int:
        """Length of the observation that the actor takes."""
        first = "actor.0.weight" if "actor.0.weight" in self.tensors else "mean.weight"
        return int(self.tensors[first].shape[0])

    @property
    def action_size(self) -> int:
        """Length of the action."""
        return int(self.tensors["mean.weight"].shape[1])

    @property
    def has_critics(self) -> bool:
        """Whether both critics are there."""
        return all(f"{critic}.0.weight" in self.tensors for critic in CRITICS)

    def widths(self, part: str) -> tuple[int, ...]:
        """Units of every layer of a part."""
        count = sum(
            name.startswith(f"{part}.") and name.endswith("weight") for name in self.tensors
        )
        return tuple(int(self.tensors[f"{part}.{i}.weight"].shape[1]) for i in range(count))

    @property
    def layer_norm(self) -> bool:
        """Whether the critics' layers are normalised."""
        return f"{CRITICS[0]}.norm.0.scale" in self.tensors

    def to_bytes(self) -> bytes:
        """The content of the file."""
        arrays = {n: np.array(t, np.float32, order="C") for n, t in self.tensors.items()}
        return save(arrays, {FORMAT: json.dumps(dict(self.facts), sort_keys=True)})


def load_networks(path: Path) -> Networks:
    """Read a networks file.

    Raises:
        BadPolicy: the file is missing or foreign.
    """
    try:
        with safe_open(path, framework="np") as file:
            header = file.metadata() or {}
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except (OSError, SafetensorError) as error:
        raise BadPolicy(f"{path} is not a networks file of ours ({error})") from error
    if FORMAT not in header:
        raise BadPolicy(
            f"{path} is not a {FORMAT} file; `robojackson train` writes networks.safetensors"
        )
    return Networks(tensors, json.loads(header[FORMAT]))


def fitted(config: TqcConfig, networks: Networks, critics: bool) -> TqcConfig:
    """The configuration with the layers that the networks have.

    Raises:
        BadPolicy: the critics have no more quantiles than are dropped.
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
    """The networks, or the actor alone."""
    if critics and networks.has_critics:
        return networks
    kept = {
        n: t for n, t in networks.tensors.items() if n.split(".")[0] in ("actor", "mean", "log_std")
    }
    return replace(networks, tensors=kept)


def widened(networks: Networks, observation_size: int) -> Networks:
    """The same networks for a longer observation that begins with theirs: new inputs weigh zero."""
    old = networks.observation_size
    gap = np.zeros((observation_size - old, 1), np.float32)
    tensors = dict(networks.tensors)
    for part in ("actor", *CRITICS, *TARGETS):
        first = tensors.get(f"{part}.0.weight")
        if first is not None:
            filling = np.repeat(gap, first.shape[1], 1)
            tensors[f"{part}.0.weight"] = np.concatenate([first[:old], filling, first[old:]])
    return replace(networks, tensors=tensors)
