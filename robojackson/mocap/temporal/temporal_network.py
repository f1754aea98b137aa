"""The temporal network: dilated convolutions over 81 frames at 30 Hz.

It returns for each of the twelve joints a correction of the detector's position (metres along the
ray axes) and its spread across the image and in depth, and for each frame the direction of up with
its spread. Numpy; `tools/temporal/net.py` is its equivalent in torch, for training.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float

from robojackson.errors import BadWeights
from robojackson.mocap.landmarks.blazepose import BODY
from robojackson.mocap.temporal import error_flow, features
from robojackson.mocap.temporal.error_flow import Weights
from robojackson.mocap.temporal.features import ClipView

DILATIONS = (1, 3, 9, 27)
"""Frames between the taps of the first blocks; further blocks repeat them."""
LOG_SPREAD, SPREAD_RANGE = -3.0, 3.0
"""Middle of the logarithm of the spread, metres, and its largest change in either direction."""
SD_PER_ERROR = 1.25
"""Standard deviation over mean absolute error of a Gaussian."""
GROUND = 5
"""Length of the head for the ground: up, and its log error in roll and pitch."""
UPRIGHT = (0.0, -1.0, 0.0)
LOG_TILT = -2.0
"""Up without evidence, and the middle of the logarithm of its error, radians."""
ALSO, SHARE = "also.", "share"
"""Beginning of the names of a file's further networks, and the name of a network's weight in the
mean of their answers."""
NAMED = 4
"""Arrays that are missing which an error names."""


@dataclass(frozen=True)
class Output:
    """What the network finds in each frame of a clip, in the axes of the rays.

    Attributes:
        correction: Correction of the detector's positions, metres.
        spread: Mean absolute error across the image and in depth, metres.
        features: What the flow reads.
        up: Direction against gravity; not of unit length.
        tilt: Mean absolute error of its roll and its pitch, radians.
    """

    correction: Float[np.ndarray, "T 12 3"]
    spread: Float[np.ndarray, "T 12 2"]
    features: Float[np.ndarray, "T C"]
    up: Float[np.ndarray, "T 3"]
    tilt: Float[np.ndarray, "T 2"]


def run(sight: ClipView, weights: Weights) -> Output:
    """Run one pass over a clip."""
    x = (features.numbers(sight) - weights["mean"]) * weights["scale"]
    h = x @ weights["enter.weight"].T + weights["enter.bias"]
    for block in range(block_count(weights)):
        h = h + _block(h, f"blocks.{block}", dilation_of(block), weights)
    out = h @ weights["leave.weight"].T + weights["leave.bias"]
    out = out.reshape(len(out), len(BODY), 5)
    ground = h @ weights["ground.weight"].T + weights["ground.bias"]
    return Output(
        correction=out[..., :3],
        spread=_spread(out[..., 3:], LOG_SPREAD),
        features=h,
        up=ground[:, :3] + np.array(UPRIGHT),
        tilt=_spread(ground[:, 3:], LOG_TILT),
    )


def dilation_of(block: int) -> int:
    """Return the frames between the taps of a block."""
    return DILATIONS[block % len(DILATIONS)]


def block_count(weights: Mapping[str, object]) -> int:
    """Return the number of residual blocks of a weights file."""
    return sum(name.startswith("blocks.") and name.endswith(".mix.weight") for name in weights)


def networks(weights: Weights) -> list[Weights]:
    """Return the arrays of each network of a file: its answer is the mean of theirs, weighted by
    their `SHARE`.

    Those of the first, which the flow reads, have plain names; of further ones `also.1.enter.bias`.
    """
    found: list[Weights] = [{n: v for n, v in weights.items() if not n.startswith(ALSO)}]
    while own := {
        name.removeprefix(start): value
        for start in [f"{ALSO}{len(found)}."]
        for name, value in weights.items()
        if name.startswith(start)
    }:
        found.append(own)
    return found


def load(path: Path) -> Weights:
    """Return the arrays of a weights file, in single precision; kept until the file changes.

    Raises:
        BadWeights: not safetensors, or arrays that are missing, of other shapes or not finite.
    """
    try:
        found = path.stat()
    except OSError as error:
        raise BadWeights(f"{path}: not a weights file of the temporal network ({error})") from None
    return _loaded(path, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=4)
def _loaded(path: Path, mtime_ns: int, size: int) -> Weights:
    from safetensors import SafetensorError
    from safetensors.numpy import load_file

    try:
        arrays = {name: value.astype(np.float32) for name, value in load_file(path).items()}
    except (SafetensorError, OSError) as error:
        raise BadWeights(f"{path}: not a weights file of the temporal network ({error})") from None
    for number, own in enumerate(networks(arrays)):
        _require_complete(path, own, f"{ALSO}{number}." if number else "")
    return arrays


def _require_complete(path: Path, arrays: Weights, start: str) -> None:
    """Refuse a network that lacks arrays, is of another version or is damaged; `start` begins its
    names in the file."""
    again = "train it again: python -m tools.temporal.train_temporal"
    shapes = _shapes(arrays, not start)
    if missing := [name for name in shapes if name not in arrays]:
        shown = ", ".join(start + name for name in missing[:NAMED])
        more = f" and {len(missing) - NAMED} more" if len(missing) > NAMED else ""
        raise BadWeights(
            f"{path}: not a weights file of the temporal network: {shown}{more} missing; "
            f"leave temporal.weights empty for the shipped one, or {again}"
        )
    if arrays["mean"].shape != (features.COUNT,):
        raise BadWeights(
            f"{path}: reads {arrays['mean'].size} numbers a frame, this version gives "
            f"{features.COUNT}; {again}"
        )
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise BadWeights(
                f"{path}: {start}{name} has the shape {arrays[name].shape}, this version "
                f"reads {shape}; {again}"
            )
        if not np.isfinite(arrays[name]).all():
            raise BadWeights(f"{path}: {start}{name} holds NaN or infinity; {again}")


def _shapes(arrays: Weights, first: bool) -> dict[str, tuple[int, ...]]:
    """Return the shape of every array of a network as wide and deep as this one; the flow's are
    those of a file's first network alone."""
    width = arrays["enter.bias"].size if "enter.bias" in arrays else 1
    layers = {
        "enter": (width, features.COUNT),
        "leave": (5 * len(BODY), width),
        "ground": (GROUND, width),
    }
    shapes: dict[str, tuple[int, ...]] = dict.fromkeys(("mean", "scale"), (features.COUNT,))
    for block in range(max(block_count(arrays), len(DILATIONS))):
        layers[f"blocks.{block}.spread"] = (width, 3 * width)
        layers[f"blocks.{block}.mix"] = (width, width)
        shapes |= dict.fromkeys((f"blocks.{block}.norm.{n}" for n in ("weight", "bias")), (width,))
    if first:
        shapes["flow.memory"] = (error_flow.SIZE,)
        layers["flow.read"] = (error_flow.CONDITION, width)
        for layer in range(error_flow.LAYERS):
            name, hidden = f"flow.couplings.{layer}", error_flow.HIDDEN
            layers[f"{name}.0"] = (hidden, error_flow.SIZE + error_flow.CONDITION)
            layers[f"{name}.2"] = (2 * error_flow.SIZE, hidden)
    for name, shape in layers.items():
        shapes |= {f"{name}.weight": shape, f"{name}.bias": shape[:1]}
    return shapes


def _spread(out: np.ndarray, middle: float) -> np.ndarray:
    return np.asarray(np.exp(np.clip(out, -SPREAD_RANGE, SPREAD_RANGE) + middle))


def _block(h: np.ndarray, name: str, dilation: int, weights: Weights) -> np.ndarray:
    """Normalise, convolve three frames at the dilation, mix; the ends are held."""
    centred = h - h.mean(-1, keepdims=True)
    normal = centred / np.sqrt((centred**2).mean(-1, keepdims=True) + 1e-5)
    normal = normal * weights[f"{name}.norm.weight"] + weights[f"{name}.norm.bias"]
    held = np.pad(normal, ((dilation, dilation), (0, 0)), mode="edge")
    taps = [held[tap * dilation : tap * dilation + len(h)] for tap in range(3)]
    inner = np.concatenate(taps, -1) @ weights[f"{name}.spread.weight"].T
    inner = np.maximum(inner + weights[f"{name}.spread.bias"], 0.0)
    return np.asarray(inner @ weights[f"{name}.mix.weight"].T + weights[f"{name}.mix.bias"])
