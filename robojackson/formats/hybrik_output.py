"""Outputs of the official HybrIK (`res.pk`) and of NIKI's demo (joblib `.pt`), nothing executed.

Joints in units of 2.2 m, camera axes (x right, y down, z forward), relative to the pelvis;
`pred_uvd` in widths of the expanded box; a frame without a person is missing, and `img_path` has
its number. `pred_thetas` are 24 rotation MATRICES (216 numbers), not axis-angle.
"""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from robojackson.errors import BadTable
from robojackson.formats.containers import safe_pickle
from robojackson.formats.foreign_motion import HybrikMotion, betas_of, rows, same_length
from robojackson.formats.format import Importer

METRE = 2.2
"""Metres a unit of the file."""
WHERE = "HybrIK file"
STRETCH = 0.5
"""Largest stretch of a rotation matrix in a file."""
SURE_SIGMA = 0.1
"""Sigma of a joint that has no weight (HybrIK's weight is 1 - 10 sigma)."""


def read(data: bytes) -> HybrikMotion:
    """Return the motion of a `res.pk` or of a file of `joblib.dump`.

    Raises:
        BadTable: not such a file, or it holds anything but arrays.
    """
    return _motion(safe_pickle.load_joblib(data, WHERE))


def _motion(content: Mapping[str, Any]) -> HybrikMotion:
    xyz = rows(content, "pred_xyz_29", 87, WHERE)
    uvd = rows(content, "pred_uvd", 87, WHERE)
    twist = rows(content, "pred_phi", 46, WHERE)
    box = rows(content, "bbox", 4, WHERE)
    size = [rows(content, name, 1, WHERE) for name in ("width", "height")]
    same_length(WHERE, pred_xyz_29=xyz, pred_uvd=uvd, pred_phi=twist, bbox=box, width=size[0])
    width, height = (int(np.median(values)) for values in size)
    side = box[:, 2] - box[:, 0]
    if width < 1 or height < 1 or side.min() <= 0.0:
        raise BadTable(f"{WHERE}: an image of {width}x{height} or a box without width")
    points = xyz.reshape(-1, 29, 3)
    centre = (box[:, :2] + box[:, 2:]) / 2.0
    return HybrikMotion(
        points=(points - points[:, :1]) * METRE,
        pixels=uvd.reshape(-1, 29, 3)[..., :2] * side[:, None, None] + centre[:, None],
        twist=twist.reshape(-1, 23, 2),
        rotations=_rotations(content, len(xyz)),
        confidence=_confidence(content, len(xyz)),
        frame=_frames(content, len(xyz)),
        betas=betas_of({"betas": content.get("pred_betas", np.zeros(10))}),
        width=width,
        height=height,
    )


def _rotations(content: Mapping[str, Any], count: int) -> np.ndarray | None:
    """Return the nearest rotations to `pred_thetas`."""
    if "pred_thetas" not in content:
        return None
    thetas = rows(content, "pred_thetas", 216, WHERE)
    same_length(WHERE, pred_xyz_29=np.empty(count), pred_thetas=thetas)
    left, size, right = np.linalg.svd(thetas.reshape(-1, 24, 3, 3))
    turned = left @ right
    if (np.linalg.det(turned) < 0.0).any() or (np.abs(size - 1.0) > STRETCH).any():
        raise BadTable(f"{WHERE}: 'pred_thetas' holds matrices that are not rotations")
    return np.asarray(turned)


def _confidence(content: Mapping[str, Any], count: int) -> np.ndarray:
    """Return 1 - 10 sigma, HybrIK's weight of joints; else the heat map's relative peaks."""
    if "pred_sigma" in content:
        sigma = rows(content, "pred_sigma", 29, WHERE)
        found = 1.0 - sigma / SURE_SIGMA
    elif "pred_scores" in content:
        scores = rows(content, "pred_scores", 29, WHERE)
        with np.errstate(all="ignore"):
            found = scores / max(float(np.quantile(scores, 0.9)), 1e-9)
    else:
        found = np.ones((count, 29))
    same_length(WHERE, pred_xyz_29=np.empty(count), confidence=found)
    return np.clip(found, 0.0, 1.0)


def _frames(content: Mapping[str, Any], count: int) -> np.ndarray:
    """Return the frame of each row from the last number in its picture's name, else its row."""
    names = content.get("img_path", [])
    if isinstance(names, np.ndarray):
        names = names.ravel().tolist()
    found = [re.findall(r"\d+", str(name)) for name in names] if isinstance(names, list) else []
    if len(found) == count and all(found):
        numbers = np.array([int(digits[-1][-9:]) for digits in found])
        numbers -= numbers[0]
        if (np.diff(numbers) > 0).all() and numbers[-1] < 10 * count:
            return numbers
    return np.arange(count)


IMPORT = Importer("hybrik", read, lambda file: "pred_xyz_29" in file.pickled, fps=30.0)
"""The frame rate of most videos; the file does not contain one."""
