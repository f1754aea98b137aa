"""Make the stated spread of each joint true: 68 % of the errors within one spread."""

import numpy as np
import torch

from robojackson.mocap.landmarks.blazepose import BODY
from robojackson.mocap.temporal import features
from robojackson.mocap.temporal.temporal_lift import corrected
from robojackson.mocap.temporal.temporal_network import SD_PER_ERROR
from tools.temporal.examples import Example
from tools.temporal.net import JOINTS, Lifter, found_in

WITHIN = 68.27
"""Percentile of the error over its spread that is one, for a Gauss distribution."""


def factors(net: Lifter, examples: list[Example]) -> np.ndarray:
    """Return the factors (12, 2) on the spreads across the image and in depth; both sides alike."""
    net.eval()
    ratios = []
    for example in examples:
        sight, good = example.sight, example.good
        found = found_in(net, sight)
        spread = SD_PER_ERROR * np.exp(found.log_spread.numpy())[good]
        body = example.truth[:, BODY].astype(float)
        off = np.abs(corrected(sight, found.correction.numpy()) - body)[good]
        ratios.append(off / spread[..., [0, 0, 1]])
    net.train()
    ratio = np.concatenate(ratios)
    ratio = np.concatenate([ratio, features.mirror_body(ratio)])
    across = np.percentile(ratio[..., :2].transpose(1, 0, 2).reshape(JOINTS, -1), WITHIN, axis=1)
    return np.stack([across, np.percentile(ratio[..., 2], WITHIN, axis=0)], -1)


def apply(net: Lifter, factor: np.ndarray) -> None:
    """Multiply the spreads of a lifter."""
    with torch.no_grad():
        bias = net.leave.bias.view(JOINTS, 5)
        bias[:, 3:] += torch.from_numpy(np.log(factor)).float()
