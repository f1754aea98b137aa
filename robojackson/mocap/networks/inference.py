"""Run a video through the networks: boxes -> crops -> HybrIK -> one fixed lens -> NIKI ->
keypoints.

The result is the input of the grounding: 29 keypoints before the camera in metres, the twist of
every bone, and the person's rest joints.
"""

import logging
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float

from robojackson.body.forward_kinematics import forward, split
from robojackson.body.skeleton import AIM_CHILD, JOINT_NAMES
from robojackson.errors import BadConfiguration
from robojackson.mocap.landmarks.blazepose import Landmarks
from robojackson.mocap.landmarks.pinhole_camera import Pinhole
from robojackson.mocap.networks import crop_to_camera, niki, person_crop
from robojackson.mocap.networks.hybrik_net import HybrikNet, hybrik_network
from robojackson.mocap.networks.network_config import NetworkConfig
from robojackson.mocap.networks.smpl_body import SmplBody, body_of, measured_rest
from robojackson.mocap.networks.weight_files import Weights, read_weights

Progress = Callable[[int, int], None]
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ClipPrediction:
    """Output of HybrIK's network for a clip, one row a frame; units of `hybrik_net.NetworkOutput`.

    Attributes:
        view: Positions of the crops in the image.
    """

    uvd: Float[np.ndarray, "T 29 3"]
    sigma: Float[np.ndarray, "T 29"]
    twist: Float[np.ndarray, "T 23 2"]
    betas: Float[np.ndarray, "T 10"]
    scale: Float[np.ndarray, " T"]
    view: crop_to_camera.View


@dataclass(frozen=True)
class Estimate:
    """The person before the camera.

    Attributes:
        keypoints: Positions, metres; x right, y down, z forward.
        twist: (cos, sin) of joints 1..23 about the bones of `rest`.
        rest: The person's rest joints, metres.
        betas: SMPL's shape coefficients, zero where `rest` is not SMPL's.
        confidence: Confidence of each keypoint, 0..1.
        notes: Networks that ran, for the user.
    """

    keypoints: Float[np.ndarray, "T 29 3"]
    twist: Float[np.ndarray, "T 23 2"]
    rest: Float[np.ndarray, "29 3"]
    betas: Float[np.ndarray, "10"]
    confidence: Float[np.ndarray, "T 29"]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Networks:
    """Networks of a configuration.

    Attributes:
        hybrik: HybrIK's network.
        niki: NIKI's, or None.
        body: SMPL, or None where no file has it.
        notes: Names of the files.
    """

    hybrik: HybrikNet
    niki: niki.OneStage | niki.TwistSwing | None
    body: SmplBody | None
    notes: tuple[str, ...]


def load_networks(config: NetworkConfig) -> Networks:
    """Return the networks of the user's files.

    Raises:
        BadWeights: a file cannot be used; the message has the reason.
    """
    device = device_of(config)
    first = read_weights(Path(str(config.hybrik)), "hybrik")
    hybrik = hybrik_network(first).to(device)
    second = read_weights(Path(config.niki), "niki") if config.niki else None
    refiner = niki.niki_network(second).to(device) if second else None
    body = body_of(first) or (body_of(second) if second else None)
    return Networks(hybrik, refiner, body, _notes(first, second, hybrik, body))


def device_of(config: NetworkConfig) -> torch.device:
    """Return the device of the networks.

    Raises:
        BadConfiguration: the configuration requires a GPU and there is none.
    """
    if config.device == "cuda" and not torch.cuda.is_available():
        raise BadConfiguration("network.device is cuda, but PyTorch sees no GPU: take auto or cpu")
    if config.device == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    return torch.device(config.device)


def estimate(
    images: Iterable[np.ndarray],
    landmarks: Landmarks,
    to_first: Float[np.ndarray, "T 3 3"] | None,
    camera: Pinhole,
    fps: float,
    depth_cutoff_hz: float,
    networks: Networks,
    config: NetworkConfig,
    progress: Progress | None = None,
) -> Estimate:
    """Return the person of a clip.

    Args:
        images: RGB frames, as many as there are landmarks.
        landmarks: Landmarks of the person in each frame's own image.
        to_first: Maps pixels of each frame to those of the first, for a camera that moved.
        camera: The fixed lens.
        fps: Frames a second.
        depth_cutoff_hz: Low-pass of the person's distance, hertz.
        networks: Networks of the configuration.
        config: Settings of the networks.
        progress: Called with (frames done, frames in all).
    """
    view = crop_to_camera.View(
        person_crop.person_boxes(landmarks.image), camera.width, camera.height
    )
    seen = run_hybrik(images, view, networks.hybrik, config, progress)
    if to_first is not None:
        boxes = person_crop.moved(seen.view.boxes, to_first[: len(seen.uvd)])
        seen = replace(seen, view=replace(seen.view, boxes=boxes))
    view = seen.view
    rest = _rest_joints(seen, networks.body)
    scale = seen.scale
    if config.update_scale:
        scale = crop_to_camera.refine_scale(
            seen.uvd, scale, seen.sigma, seen.twist, rest[None], view
        )
    points = crop_to_camera.lift(seen.uvd, scale, view)
    points = crop_to_camera.refocus(points, view, camera, fps, depth_cutoff_hz)
    found = Estimate(
        points,
        seen.twist,
        rest,
        seen.betas.mean(0) if networks.body else np.zeros(10),
        1.0 - seen.sigma,
        networks.notes,
    )
    return found if networks.niki is None else refined(found, seen, networks.niki, config)


def run_hybrik(
    images: Iterable[np.ndarray],
    view: crop_to_camera.View,
    network: HybrikNet,
    config: NetworkConfig,
    progress: Progress | None = None,
) -> ClipPrediction:
    """Return the output of HybrIK's network for every frame."""
    total, done = len(view.boxes), 0
    rows: list[tuple[np.ndarray, ...]] = []
    device = device_of(config)
    for crops in _crops(images, view.boxes, config.batch):
        batch = torch.from_numpy(person_crop.normalise(crops)).to(device)
        with torch.inference_mode():
            seen = network(batch, config.flip_test)
        parts = (seen.uvd, seen.sigma, seen.twist, seen.betas, seen.scale)
        rows.append(tuple(part.double().cpu().numpy() for part in parts))
        done += len(crops)
        if progress:
            progress(done, total)
    uvd, sigma, twist, betas, scale = (np.concatenate(column) for column in zip(*rows, strict=True))
    shown = crop_to_camera.View(view.boxes[: len(uvd)], view.width, view.height)
    return ClipPrediction(uvd, sigma, twist, betas, scale, shown)


def refined(
    found: Estimate,
    seen: ClipPrediction,
    network: niki.OneStage | niki.TwistSwing,
    config: NetworkConfig,
) -> Estimate:
    """Return the person with NIKI's rotations on his own bones, at HybrIK's pelvis."""
    count = len(found.keypoints)
    idle = niki.idle_inputs(count, config.noise, np.random.default_rng(config.seed))
    betas = np.broadcast_to(seen.betas.mean(0), (count, 10))
    out = niki.refine(network, found.keypoints, seen.sigma, found.twist, betas, idle)
    pose = forward(out.rotations, found.rest[None], found.keypoints[:, 0])
    bones = np.stack([found.rest[AIM_CHILD[j]] - found.rest[j] for j in range(1, len(JOINT_NAMES))])
    _, twist = split(out.rotations[:, 1:], np.broadcast_to(bones, (count, *bones.shape)))
    return Estimate(pose.points, twist, found.rest, found.betas, found.confidence, found.notes)


def _crops(images: Iterable[np.ndarray], boxes: np.ndarray, batch: int) -> Iterator[np.ndarray]:
    pairs = zip(images, boxes, strict=False)
    while group := [person_crop.cut(image, box) for image, box in islice(pairs, batch)]:
        yield np.stack(group)


def _rest_joints(seen: ClipPrediction, body: SmplBody | None) -> Float[np.ndarray, "29 3"]:
    """Return SMPL's rest joints of the clip's mean shape, or our own with the network's bone
    lengths."""
    if body is not None:
        return body.rest_joints(seen.betas.mean(0))
    raw = crop_to_camera.lift(seen.uvd, seen.scale, seen.view)
    return measured_rest(raw)


def _notes(
    first: Weights, second: Weights | None, network: HybrikNet, body: SmplBody | None
) -> tuple[str, ...]:
    notes = [f"pose by the network {first.kind} ({first.path.name})"]
    if second is not None:
        notes[0] += f", refined by {second.kind} ({second.path.name})"
    if not network.knows_doubt:
        notes.append("these weights have no scores of keypoints: equal weights")
    if body is None:
        notes.append("the weights hold no SMPL body: our own skeleton with measured bones")
    return tuple(notes)
