"""A trained policy: a small network as numpy arrays, kept in one safetensors file.

The file holds the layers of the actor (ReLU between them, tanh at the end) and, as JSON in its
header, the facts of the training. Reading it executes nothing and needs neither jax nor torch.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
from jaxtyping import Float
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from robojackson.errors import BadPolicy
from robojackson.files.file_tree import FileTree
from robojackson.files.foreign_file import parse_json, require_file

FORMAT = "robojackson-policy-1"
PARQUET = b"PAR1"
LARGEST = 1e6
"""Largest magnitude of a weight."""


@dataclass(frozen=True, repr=False)
class Policy:
    """A deterministic policy.

    Attributes:
        layers: (weight (in, out), bias (out,)) from the observation to the action.
        facts: Facts of the training: robot, control law, trainer, seed, steps.
    """

    layers: tuple[tuple[np.ndarray, np.ndarray], ...]
    facts: Mapping[str, object]

    def __repr__(self) -> str:
        sizes = " -> ".join(str(size) for size in (self.observation_size, *self._widths))
        return f"Policy({sizes}, robot={self.facts.get('robot', '?')!r}, setup={self.setup!r})"

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the policy's file (safetensors).

        Returns:
            The path.

        Raises:
            StoreError: the file cannot be written.
        """
        file = Path(path)
        FileTree(file.parent).write(file.name, self.to_bytes())
        return file

    def act(self, observation: Float[np.ndarray, "N D"]) -> Float[np.ndarray, "N nu"]:
        """Return the mean action, -1..1, of each observation."""
        hidden = np.asarray(observation, np.float32)
        for weight, bias in self.layers[:-1]:
            hidden = np.maximum(hidden @ weight + bias, 0.0)
        weight, bias = self.layers[-1]
        result: np.ndarray = np.tanh(hidden @ weight + bias)
        return result

    def with_first(self, change: Callable[[np.ndarray], np.ndarray]) -> "Policy":
        """Return the policy with other weights from its observation on."""
        (weight, bias), *rest = self.layers
        return replace(self, layers=((change(weight), bias), *rest))

    @property
    def _widths(self) -> list[int]:
        return [weight.shape[1] for weight, _ in self.layers]

    @property
    def observation_size(self) -> int:
        """Return the length of the observation."""
        result: int = self.layers[0][0].shape[0]
        return result

    @property
    def action_size(self) -> int:
        """Return the length of the action."""
        result: int = self.layers[-1][0].shape[1]
        return result

    @property
    def training(self) -> dict[str, int | None]:
        """Return seed and control steps of the training, by their names in tables."""
        seed, steps = (_count(self.facts.get(name)) for name in ("seed", "steps"))
        return {"seed": seed or 0, "step": steps}

    @property
    def updates(self) -> int | None:
        """Return the gradient updates of the training; None where the file has no number."""
        return _count(self.facts.get("updates"))

    @property
    def setup(self) -> str:
        """Return the name of the training's configuration; empty where the file has none."""
        name = self.facts.get("setup")
        return name if isinstance(name, str) else ""

    def to_bytes(self) -> bytes:
        """Return the content of the policy's file."""
        tensors: dict[str, np.ndarray] = {}
        for i, (weight, bias) in enumerate(self.layers):
            tensors[f"layer{i}.weight"] = np.ascontiguousarray(weight, np.float32)
            tensors[f"layer{i}.bias"] = np.ascontiguousarray(bias, np.float32)
        return save(tensors, {FORMAT: json.dumps(dict(self.facts), sort_keys=True)})


def _count(value: object) -> int | None:
    """Return a number that fits a table's column; None for any other value."""
    return value if isinstance(value, int) and 0 <= value < 2**31 else None


def holds_policy(path: Path) -> bool:
    """Return whether a file is a policy of ours, by its header alone."""
    try:
        with safe_open(path, framework="np") as file:
            return FORMAT in (file.metadata() or {})
    except (OSError, SafetensorError):
        return False


def load_policy(path: Path) -> Policy:
    """Read a policy file.

    Raises:
        BadPolicy: the file is missing, foreign or has layers that do not fit each other.
    """
    require_file(path, BadPolicy, usual=("policy.safetensors",))
    try:
        with path.open("rb") as start:
            if start.read(len(PARQUET)) == PARQUET:
                raise BadPolicy(f"{path} is a table: give the policy.safetensors of a training")
        with safe_open(path, framework="np") as file:
            header = file.metadata() or {}
            names = set(file.keys())
            tensors = {name: file.get_tensor(name) for name in names}
    except (OSError, SafetensorError, TypeError, ValueError) as error:
        raise BadPolicy(f"{path} is not a policy file of ours ({error})") from error
    if FORMAT not in header:
        raise BadPolicy(f"{path} is not a {FORMAT} file; `robojackson train` writes them")
    return Policy(_layers(path, tensors), _facts(path, header[FORMAT]))


def _facts(path: Path, text: str) -> dict[str, object]:
    try:
        facts = parse_json(text, finite=True)
    except ValueError as error:
        raise BadPolicy(f"{path}: the facts of its training cannot be read ({error})") from error
    if not isinstance(facts, dict):
        raise BadPolicy(
            f"{path}: the facts of its training are a {type(facts).__name__}, not an object"
        )
    return facts


def _layers(
    path: Path, tensors: Mapping[str, np.ndarray]
) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    count = len(tensors) // 2
    try:
        layers = tuple(
            (tensors[f"layer{i}.weight"], tensors[f"layer{i}.bias"]) for i in range(count)
        )
    except KeyError as error:
        raise BadPolicy(f"{path} lacks tensor {error}") from error
    if len(tensors) > 2 * count:
        raise BadPolicy(f"{path} has a tensor that belongs to no layer: {_extra(tensors, count)!r}")
    if any(weight.ndim != 2 for weight, _ in layers):
        raise BadPolicy(f"{path} has a layer whose weight is not a matrix")
    if any(array.dtype.kind != "f" for layer in layers for array in layer):
        raise BadPolicy(f"{path} has weights that are not floating-point numbers")
    if not all((np.abs(array) < LARGEST).all() for layer in layers for array in layer):
        raise BadPolicy(f"{path} has weights that are not finite, or over {LARGEST:g}")
    widths = [weight.shape[1] for weight, _ in layers[:-1]]
    fits = all(w == nxt.shape[0] for w, (nxt, _) in zip(widths, layers[1:], strict=True))
    if not layers or not fits or any(w.shape[1:] != b.shape for w, b in layers):
        raise BadPolicy(f"{path} has layers that do not fit each other")
    return layers


def _extra(tensors: Mapping[str, np.ndarray], count: int) -> str:
    """Return a name that belongs to no layer."""
    known = {f"layer{i}.{part}" for i in range(count) for part in ("weight", "bias")}
    return min(set(tensors) - known)
