"""Read files of weights without executing their content, and recognise them by their keys.

A file is a safetensors file or the output of `torch.save`: a state dict, bare or under `model` or
`state_dict`, with or without the prefix `module.`. Pickled objects other than tensors are refused.
"""

import hashlib
import pickle
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import torch
from torch import Tensor, nn

from robojackson.errors import BadWeights
from robojackson.files.foreign_file import require_file

Kind = Literal["hybrik_hrnet48", "hybrik_resnet34", "niki_one_stage", "niki_twist_swing"]
SIGNS: Mapping[Kind, tuple[str, ...]] = {
    "hybrik_hrnet48": ("preact.stage4.0.branches.3.0.conv1.weight", "decphi.weight"),
    "hybrik_resnet34": ("deconv_layers.0.weight", "preact.layer3.5.conv2.weight", "decphi.weight"),
    "niki_one_stage": ("regressor.flow.mask", "regressor.flow.t.0.0.weight"),
    "niki_twist_swing": ("regressor.flow_j2s.jts_masks", "regressor.flow_s2r.mask"),
}
"""Keys by which a file is recognised."""
BODY_PREFIXES = ("smpl.", "regressor.smpl_layer.")
"""Place of SMPL's tables in the official files."""
WRAPPERS = ("model", "state_dict", "model_state_dict", "net")
MAX_LISTED = 4
"""Number of keys that an error lists."""
LARGEST = 2**32
"""Largest size, bytes; HybrIK's largest file has 0.4 GB."""


@dataclass(frozen=True)
class Weights:
    """A recognised file of weights.

    Attributes:
        path: The file.
        kind: Name of the network.
        tensors: The network's own keys.
        body: SMPL's tables by their bare names; empty where the file has none.
    """

    path: Path
    kind: Kind
    tensors: Mapping[str, Tensor]
    body: Mapping[str, Tensor]


def read_weights(path: Path, family: Literal["hybrik", "niki"]) -> Weights:
    """Load a file and recognise it.

    Raises:
        BadWeights: missing, damaged, unsafe, of another network, or not finite.
    """
    state = _without_prefix(_state_dict(_content(path), path))
    kind = recognise(state, path)
    if not kind.startswith(family):
        raise BadWeights(f"{path}: holds {kind}, expected weights of {family} here")
    body: dict[str, Tensor] = {}
    tensors: dict[str, Tensor] = {}
    for key, value in state.items():
        prefix = next((p for p in BODY_PREFIXES if key.startswith(p)), "")
        (body if prefix else tensors)[key.removeprefix(prefix)] = value
    _require_finite(tensors, path)
    return Weights(path, kind, tensors, body)


def recognise(keys: Iterable[str], path: Path) -> Kind:
    """Return the network that a set of keys belongs to."""
    known = set(keys)
    for kind, signs in SIGNS.items():
        if known.issuperset(signs):
            return kind
    raise BadWeights(
        f"{path}: not weights of a known network ({', '.join(get_args(Kind))}); "
        f"its {len(known)} keys are {_listed(sorted(known)) or 'none'}"
    )


def install(network: nn.Module, weights: Weights) -> nn.Module:
    """Load weights into a network whose keys and shapes must match; set it to evaluation mode.

    Args:
        network: Network on any device, also on PyTorch's `meta` device: its tensors are replaced.
        weights: Weights of the same kind.
    Raises:
        BadWeights: keys are missing or unexpected, or a tensor has another shape.
    """
    expected = network.state_dict()
    missing = [k for k in expected if k not in weights.tensors]
    unexpected = [k for k in weights.tensors if k not in expected]
    wrong = [
        f"{key} is {tuple(value.shape)}, expected {tuple(expected[key].shape)}"
        for key, value in weights.tensors.items()
        if key in expected and value.shape != expected[key].shape
    ]
    problems = [
        f"{len(keys)} {word} ({_listed(keys)})"
        for word, keys in (("missing", missing), ("unexpected", unexpected), ("misshapen", wrong))
        if keys
    ]
    if problems:
        raise BadWeights(
            f"{weights.path}: looks like {weights.kind}, but of its {len(expected)} keys "
            f"{'; '.join(problems)}. Download the file again, or take the release that "
            "docs/official_weights.md names"
        )
    given = {k: _cast(v, expected[k].dtype) for k, v in weights.tensors.items()}
    network.load_state_dict(given, strict=True, assign=True)
    return network.eval().requires_grad_(False)


def sha256_of(path: Path) -> str:
    """Return the digest of a file's content, for cache keys and notes."""
    if not path.is_file():
        raise BadWeights(f"{path}: no such file of weights")
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _content(path: Path) -> Any:
    require_file(path, BadWeights, LARGEST)
    try:
        if path.suffix == ".safetensors":
            from safetensors.torch import load_file

            return load_file(path)
        with warnings.catch_warnings():  # of a pickle's protocol: errors are raised below
            warnings.simplefilter("ignore")
            return torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as cause:
        raise BadWeights(
            f"{path}: holds more than tensors, or is not a PyTorch file, and loading it could run "
            "code; save only its state dict (torch.save(model.state_dict(), PATH)) or safetensors"
        ) from cause
    except Exception as cause:  # a damaged file fails in any way
        if type(cause).__module__.startswith("safetensors"):
            raise BadWeights(f"{path}: damaged safetensors ({cause}); download it again") from cause
        raise BadWeights(
            f"{path}: cut off or damaged, or not a file of weights; download it again"
        ) from cause


def _state_dict(content: Any, path: Path) -> dict[str, Tensor]:
    """Return the tensors by key, without the wrappers of training programs."""
    while isinstance(content, Mapping):
        inner = next((content[w] for w in WRAPPERS if isinstance(content.get(w), Mapping)), None)
        if inner is None:
            break
        content = inner
    if not isinstance(content, Mapping):
        raise BadWeights(f"{path}: holds {type(content).__name__}, expected tensors by key")
    return {str(key): value for key, value in content.items() if isinstance(value, Tensor)}


def _without_prefix(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Return the keys without the prefix `module.` of parallel training."""
    return {key.removeprefix("module."): value for key, value in state.items()}


def _require_finite(tensors: Mapping[str, Tensor], path: Path) -> None:
    bad = [k for k, v in tensors.items() if v.is_floating_point() and not v.isfinite().all()]
    if bad:
        raise BadWeights(f"{path}: not finite in {_listed(bad)}; download the file again")


def _cast(value: Tensor, kind: torch.dtype) -> Tensor:
    return value.to(kind) if value.dtype != kind else value


def _listed(keys: list[str]) -> str:
    more = len(keys) - MAX_LISTED
    return ", ".join(keys[:MAX_LISTED]) + (f" and {more} more" if more > 0 else "")
