"""The networks that a training may start from: our walkers, our dancer, a run or policy of ours, or
any SB3 zip of TQC.

An SB3 zip holds pickled objects beside its weights. Only `policy.pth` is read, by torch's
weights-only reader, and the JSON beside it as text; nothing is unpickled.
"""

import io
import json
import logging
import pickle
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from robojackson.errors import BadPolicy, MissingDependency
from robojackson.rl.policy import holds_policy, load_policy
from robojackson.rl.tqc.network_arrays import (
    CRITICS,
    TARGETS,
    Networks,
    Tensors,
    load_networks,
    require_complete,
)
from robojackson.rl.walkers import SCRATCH, shipped_dancer, shipped_walker, walker_file
from robojackson.robot.description import RobotDescription

log = logging.getLogger(__name__)

MIN_LAYERS = 2
"""Layers of an actor: a hidden one and the mean of the actions."""

HUB = re.compile(r"^[\w.-]+/[\w.-]+(?<!\.safetensors)(?<!\.zip)$")


def pretrained(start: str, mode: str, robot: RobotDescription | None = None) -> Networks | None:
    """Return the networks that a start names; None for `scratch`.

    Args:
        robot: Robot of the `walker`; None for the one that ships.
    Raises:
        BadPolicy: an unknown name, no walker for the robot, or a file that does not hold an actor
            of TQC.
        MissingDependency: the hub cannot be reached or its client is not installed.
    """
    path = start_file(start, mode, robot)
    if path is None:
        return None
    if zipfile.is_zipfile(path):
        return from_sb3_zip(path)
    return from_policy(path) if holds_policy(path) else load_networks(path)


def start_file(start: str, mode: str, robot: RobotDescription | None = None) -> Path | None:
    """Return the file of a start, downloaded if it is on the hub; None for `scratch`."""
    if start == SCRATCH:
        return None
    if start == "walker":
        return shipped_walker(mode) if robot is None else walker_file(robot, mode)
    if start == "dancer":
        return shipped_dancer(robot, mode)
    path = Path(start)
    if path.is_file():
        return path
    if path.is_dir():
        raise BadPolicy(
            f"start {start!r} is a folder; name policy.safetensors or networks.safetensors in it"
        )
    if not HUB.match(start):
        raise BadPolicy(
            f"start {start!r}: no such file; use scratch, walker, dancer, a networks.safetensors, "
            "a policy.safetensors, an SB3 zip, or owner/name of the hub"
        )
    return from_hub(start)


def from_hub(repository: str) -> Path:
    """Return the zip of a repository of the hub, from its cache or the network.

    Raises:
        MissingDependency: no client, no network, or no such repository.
    """
    try:
        from huggingface_sb3 import load_from_hub
    except ImportError as error:
        raise MissingDependency(
            f"start {repository!r} needs the hub's client: pip install huggingface_sb3"
        ) from error
    name = repository.split("/")[1]
    try:
        return Path(load_from_hub(repository, f"{name[:1].lower()}{name[1:]}.zip"))
    except Exception as error:  # the client raises its HTTP library's errors
        raise MissingDependency(
            f"start {repository!r} cannot be fetched from the hub ({type(error).__name__}); "
            "download its zip elsewhere and give its path"
        ) from error


def from_policy(path: Path) -> Networks:
    """Return the actor of a policy file of ours, which has no critics.

    Raises:
        BadPolicy: the file is damaged, or its network has no hidden layer.
    """
    policy = load_policy(path)
    if len(policy.layers) < MIN_LAYERS:
        raise BadPolicy(f"{path}: a policy without a hidden layer, from which no training starts")
    names = [*(f"actor.{i}" for i in range(len(policy.layers) - 1)), "mean"]
    tensors: Tensors = {}
    for name, (weight, bias) in zip(names, policy.layers, strict=True):
        tensors |= {f"{name}.weight": weight, f"{name}.bias": bias}
    return require_complete(Networks(tensors, policy.facts), path)


def from_sb3_zip(path: Path) -> Networks:
    """Return the actor and critics of TQC in an SB3 zip.

    Raises:
        BadPolicy: not a zip of SB3, or not of TQC with ReLU layers.
    """
    import torch

    try:
        with zipfile.ZipFile(path) as archive:
            header = json.loads(archive.read("data"))
            raw = torch.load(
                io.BytesIO(archive.read("policy.pth")), weights_only=True, map_location="cpu"
            )
            state = {name: np.asarray(value.float()) for name, value in raw.items()}
            alpha = _alpha(archive, torch)
    except pickle.UnpicklingError as error:  # its text advises to load the file without checks
        raise BadPolicy(
            f"{path} cannot be read safely as an SB3 zip: its weights hold more than tensors and "
            "could run code; save the model again with SB3 (model.save)"
        ) from error
    except Exception as error:  # a damaged file fails in any way
        cause = str(error).partition("\n")[0]
        cause = "damaged" if "weights_only" in str(error) else cause  # the same advice
        raise BadPolicy(f"{path} is not a readable SB3 zip ({cause})") from error
    _require_relu(path, header)
    try:
        tensors = _renamed(state)
    except (KeyError, ValueError) as error:
        raise BadPolicy(f"{path} does not hold an actor and critics of TQC ({error})") from error
    facts = {"from": path.name, "steps": header.get("num_timesteps")}
    return require_complete(Networks(tensors | alpha, facts), path)


def _alpha(archive: zipfile.ZipFile, torch: object) -> Tensors:
    if "pytorch_variables.pth" not in archive.namelist():
        return {}
    held = torch.load(  # type: ignore[attr-defined]
        io.BytesIO(archive.read("pytorch_variables.pth")), weights_only=True, map_location="cpu"
    )
    found = held.get("log_ent_coef") if isinstance(held, Mapping) else None
    return {} if found is None else {"log_alpha": found.detach().numpy().reshape(()).copy()}


def _require_relu(path: Path, header: Mapping[str, object]) -> None:
    """Raise for other activations: SB3 writes the policy's arguments as text beside the pickle."""
    arguments = header.get("policy_kwargs")
    activation = str(arguments.get("activation_fn", "ReLU")) if isinstance(arguments, dict) else ""
    if activation and not re.search(r"\bReLU\b", activation):
        raise BadPolicy(f"{path} has {activation} layers; only ReLU is supported")


def _renamed(state: Tensors) -> Tensors:
    """Return SB3's weights by our names, turned to (in, out)."""
    tensors = _chain(state, "actor.latent_pi", "actor")
    head = "actor.mu" if "actor.mu.weight" in state else "actor.mu.0"
    tensors |= _layer(state, head, "mean")
    if "actor.log_std.weight" in state:
        tensors |= _layer(state, "actor.log_std", "log_std")
    for i, (critic, target) in enumerate(zip(CRITICS, TARGETS, strict=True)):
        tensors |= _chain(state, f"critic.qf{i}", critic)
        tensors |= _chain(state, f"critic_target.qf{i}", target)
    outputs = Networks(tensors, {}).widths(CRITICS[0])
    if outputs and outputs[-1] == 1:
        raise ValueError("its critics give one value, as SAC's do")
    return tensors


def _chain(state: Tensors, prefix: str, ours: str) -> Tensors:
    found = [re.fullmatch(rf"{re.escape(prefix)}\.(\d+)\.weight", name) for name in state]
    numbers = sorted(int(match.group(1)) for match in found if match)
    tensors: Tensors = {}
    for i, number in enumerate(numbers):
        tensors |= _layer(state, f"{prefix}.{number}", f"{ours}.{i}")
    return tensors


def _layer(state: Tensors, theirs: str, ours: str) -> Tensors:
    weight, bias = state[f"{theirs}.weight"], state[f"{theirs}.bias"]
    return {f"{ours}.weight": weight.T.copy(), f"{ours}.bias": bias.copy()}
