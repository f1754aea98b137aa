"""SMPL's rest joints from the tables inside an official checkpoint (Loper et al. 2015).

Shaped template: v = v_template + shapedirs beta; joints = J_regressor v; the five leaf points are
single vertices. No mesh is posed and no table is stored or written. Metres.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from robojackson.body.skeleton import KEYPOINT_NAMES, PARENTS, REST_OFFSETS, assemble
from robojackson.errors import BadWeights
from robojackson.mocap.landmarks.blazepose import mirror_of
from robojackson.mocap.networks.weight_files import Weights

LEAF_VERTICES: Mapping[str, int] = {
    "head_top": 411,
    "left_middle": 2445,
    "right_middle": 5905,
    "left_big_toe": 3216,
    "right_big_toe": 6617,
}
SHAPES: Mapping[str, tuple[int, ...]] = {
    "v_template": (6890, 3),
    "shapedirs": (6890, 3, 10),
    "J_regressor": (24, 6890),
}
"""Tables that are used; the others may be absent."""


@dataclass(frozen=True)
class SmplBody:
    """SMPL's rest joints as a function of shape: linear, so two small tables suffice.

    Attributes:
        mean: Rest joints of beta = 0.
        slope: Derivative by each beta.
    """

    mean: Float[np.ndarray, "29 3"]
    slope: Float[np.ndarray, "29 3 10"]

    def rest_joints(self, betas: Float[np.ndarray, "*T 10"]) -> Float[np.ndarray, "*T 29 3"]:
        """Return the rest joints of shapes."""
        result: np.ndarray = self.mean + np.einsum("jcb,...b->...jc", self.slope, betas)
        return result


def body_of(weights: Weights) -> SmplBody | None:
    """Return the body inside a checkpoint; None where there is none.

    Raises:
        BadWeights: its shapes differ from SMPL's.
    """
    if not weights.body:
        return None
    tables: dict[str, Any] = {}
    for name, shape in SHAPES.items():
        table = weights.body.get(name)
        if table is None or tuple(table.shape) != shape:
            found = "missing" if table is None else f"{tuple(table.shape)}"
            raise BadWeights(
                f"{weights.path}: its SMPL table {name!r} is {found}, expected {shape}; "
                "download the file again or strip its smpl.* keys"
            )
        tables[name] = table.double().numpy()
    leaves = [LEAF_VERTICES[name] for name in KEYPOINT_NAMES[24:]]
    regressor, template, shapes = (tables[n] for n in ("J_regressor", "v_template", "shapedirs"))
    mean = np.concatenate([regressor @ template, template[leaves]])
    slope = np.concatenate([np.einsum("jv,vcb->jcb", regressor, shapes), shapes[leaves]])
    return SmplBody(mean, slope)


def measured_rest(points: Float[np.ndarray, "T 29 3"]) -> Float[np.ndarray, "29 3"]:
    """Return our own T-pose with the bone lengths of a person: medians over the clip, equal for
    both sides."""
    parents = list(PARENTS[1:])
    lengths = np.median(np.linalg.norm(points[:, 1:] - points[:, parents], axis=-1), 0)
    names = list(KEYPOINT_NAMES[1:])
    other = [names.index(mirror_of(name)) for name in names]
    lengths = (lengths + lengths[other]) / 2.0
    ratio = lengths / np.linalg.norm(REST_OFFSETS[1:], axis=-1)
    return assemble(np.concatenate([REST_OFFSETS[:1], REST_OFFSETS[1:] * ratio[:, None]]))
