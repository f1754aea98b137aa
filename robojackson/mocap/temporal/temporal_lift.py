"""Step 3 of the default pipeline: the temporal network corrects the detector's body.

Runs with numpy alone (torch only trains). The clip is resampled to 30 Hz, processed plain and
mirrored, and the mean of both results is resampled to the clip's own frames.
"""

from dataclasses import dataclass as plain_dataclass
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.mocap.landmarks.blazepose import BODY
from robojackson.mocap.landmarks.refinement import carry_along
from robojackson.mocap.temporal import error_flow, features
from robojackson.mocap.temporal.features import ClipView
from robojackson.mocap.temporal.ground_evidence import GroundEvidence, ground_evidence
from robojackson.mocap.temporal.temporal_network import (
    SD_PER_ERROR,
    SHARE,
    Output,
    load,
    networks,
    run,
)

WEIGHTS = Path(__file__).parents[2] / "assets" / "temporal.safetensors"
HIDDEN_BELOW = 0.35
"""Visibility of landmarks below which their limb counts as hidden."""


@config_dataclass
class TemporalConfig:
    """Settings of the temporal network.

    Attributes:
        enabled: Whether to correct the detector at all.
        weights: Weights file; None is the shipped one.
        detector_m: Spread of the detector's own depth, metres: the less sure the network is, the
            nearer visible joints stay to the detector; hidden joints follow the network alone; 0
            leaves all visible joints to the detector.
        blind_share: Share of the answer that the network gives without the detector's depth: on
            real people, whose depth the detector misjudges in other ways than that of rendered
            ones, that answer is the better one.
        depth_floor_m: Least spread of a corrected depth, metres.
        hypothesis: 0 is the most probable motion; n > 0 the n-th sample of poses of hidden limbs.
        seed: Seed of the samples.
    """

    enabled: bool = True
    weights: str | None = None
    detector_m: float = Field(default=0.22, ge=0)
    blind_share: float = Field(default=0.35, ge=0, le=1)
    depth_floor_m: float = 0.02
    hypothesis: int = 0
    seed: int = 0

    @property
    def file(self) -> Path:
        """Return the path of the weights."""
        return Path(self.weights) if self.weights else WEIGHTS


@plain_dataclass(frozen=True)
class Lifted:
    """Result of the network for a clip.

    Attributes:
        points: All landmarks before the camera, metres.
        spread: Spread of the twelve across the image and in depth, metres: mean absolute error.
        ground: What the network finds of gravity.
    """

    points: Float[np.ndarray, "T 33 3"]
    spread: Float[np.ndarray, "T 12 2"]
    ground: GroundEvidence

    def depth_sd(self, least_m: float) -> Float[np.ndarray, "T 12"]:
        """Return the standard deviation of the depths, metres."""
        return depth_sd(self.spread, least_m)


def lift(
    placed: Float[np.ndarray, "T 33 3"],
    local: Float[np.ndarray, "T 33 3"],
    visibility: Float[np.ndarray, "T 33"],
    fps: float,
    config: TemporalConfig,
    up: Float[np.ndarray, "3"] | None = None,
) -> Lifted:
    """Return the landmarks with the body corrected; face, hands and feet follow their carriers.

    Args:
        placed: Landmarks before the camera (`pinhole_camera.place`), metres.
        local: The detector's own landmarks, metres.
        visibility: Visibility of the landmarks, 0..1.
        fps: Frames a second.
        config: Settings of the network.
        up: Direction against gravity in the camera's axes, where the scene shows it.
    Raises:
        BadWeights: the weights file is not of this network.
    """
    weights = load(config.file)
    sight = features.view_clip(placed, local, visibility, up)
    places = features.time_grid(len(placed), fps)
    coarse = at(sight, places)
    found = blended(coarse, weights, config.blind_share)
    change, spread = found.correction, found.spread
    if config.hypothesis:
        rng = np.random.default_rng([config.seed, config.hypothesis])
        change = change + imagine(found.features, spread, coarse.visibility, weights, rng)
    back = np.clip(np.arange(len(placed)) * features.FPS / fps, 0.0, len(places) - 1.0)
    spread, change = features.resample(spread, back), features.resample(change, back)
    hidden_share = unseen(visibility)
    share = hidden_share + (1.0 - hidden_share) * believed(spread, config)
    points = features.to_camera(sight, corrected(sight, share[..., None] * change))
    return Lifted(carry_along(placed, points), spread, ground_evidence(found, sight, places))


def believed(
    spread: Float[np.ndarray, "T 12 2"], config: TemporalConfig
) -> Float[np.ndarray, "T 12"]:
    """Return the share of the correction: the weight of the network's depth against the
    detector's."""
    detector = config.detector_m**2
    network = depth_sd(spread, config.depth_floor_m) ** 2
    return np.asarray(detector / (detector + network))


def depth_sd(spread: Float[np.ndarray, "T 12 2"], least_m: float) -> Float[np.ndarray, "T 12"]:
    """Return the standard deviation of the depths, metres, from a mean absolute error
    (Gauss)."""
    return np.maximum(SD_PER_ERROR * spread[..., 1], least_m)


def corrected(sight: ClipView, change: Float[np.ndarray, "T 12 3"]) -> Float[np.ndarray, "T 12 3"]:
    """Return the body along the rays: depth of detector plus correction, the image at that
    depth."""
    depth = sight.local[:, BODY, 2] + change[..., 2]
    across = features.at_depth(sight, depth) + change[..., :2]
    return np.concatenate([across, depth[..., None]], -1)


def correct(sight: ClipView, weights: error_flow.Weights) -> Output:
    """Return the weighted mean of all networks' answers to the plain and the mirrored view.

    The features are those of the first to the plain one.

    Where the answers to both views differ, the clip is unlike the training data: their distance is
    added to the spread.
    """
    mirror, each = features.mirror(sight), networks(weights)
    shares = [float(own.get(SHARE, 1.0)) for own in each]
    plain = mean_of([run(sight, own) for own in each], shares)
    again = mean_of([mirrored(run(mirror, own)) for own in each], shares)
    both = mean_of([plain, again], [0.5, 0.5])
    apart = np.abs(plain.correction - again.correction) / 2.0
    apart = np.stack([apart[..., :2].mean(-1), apart[..., 2]], -1)
    return replace(both, spread=np.hypot(both.spread, apart))


def mean_of(found: list[Output], shares: list[float]) -> Output:
    """Return the weighted mean of outputs, of spreads the geometric one; the features of the
    first."""

    def mean(values: list[np.ndarray]) -> np.ndarray:
        return np.asarray(np.average(values, axis=0, weights=shares))

    return Output(
        correction=mean([one.correction for one in found]),
        spread=np.exp(mean([np.log(one.spread) for one in found])),
        features=found[0].features,
        up=mean([one.up for one in found]),
        tilt=np.exp(mean([np.log(one.tilt) for one in found])),
    )


def mirrored(found: Output) -> Output:
    """Return what was found in the mirrored clip as of the plain one; the features stay."""
    flip = np.array([-1.0, 1.0, 1.0])
    return replace(
        found,
        correction=features.mirror_body(found.correction) * flip,
        spread=features.mirror_body(found.spread),
        up=found.up * flip,
    )


def blended(sight: ClipView, weights: error_flow.Weights, blind_share: float) -> Output:
    """Return the correction, partly that of the same clip without the detector's depth."""
    found = correct(sight, weights)
    if blind_share == 0.0:
        return found
    blind = correct(replace(sight, local=sight.local * [1.0, 1.0, 0.0]), weights)
    other = blind.correction - sight.local[:, BODY] * [0.0, 0.0, 1.0]
    return replace(
        found,
        correction=(1.0 - blind_share) * found.correction + blind_share * other,
        up=(1.0 - blind_share) * found.up + blind_share * blind.up,
    )


def imagine(
    hidden: np.ndarray,
    spread: np.ndarray,
    visibility: np.ndarray,
    weights: error_flow.Weights,
    rng: np.random.Generator,
) -> Float[np.ndarray, "T 12 3"]:
    """Return another sample of the joints that are not visible, from a sampled embedding."""
    z = error_flow.sample(len(hidden), weights, rng)
    error = error_flow.to_error(z, hidden, weights) - error_flow.to_error(
        np.zeros_like(z), hidden, weights
    )
    metres = error.reshape(len(hidden), -1, 3) * spread[..., [0, 0, 1]]
    return np.asarray(metres * np.sqrt(unseen(visibility))[..., None])


def unseen(visibility: Float[np.ndarray, "T 33"]) -> Float[np.ndarray, "T 12"]:
    """Return 1 for an invisible joint, 0 from `HIDDEN_BELOW` on."""
    return np.clip((HIDDEN_BELOW - visibility[:, BODY]) / HIDDEN_BELOW, 0.0, 1.0)


def at(sight: ClipView, places: Float[np.ndarray, " S"]) -> ClipView:
    """Return the view at other moments; the axes are not interpolated, since they are not used
    there."""
    nearest = np.round(places).astype(int)
    return replace(
        sight,
        flat=features.resample(sight.flat, places),
        local=features.resample(sight.local, places),
        visibility=features.resample(sight.visibility, places),
        root=features.resample(sight.root, places),
        axes=sight.axes[nearest],
        up=sight.up[nearest],
    )
