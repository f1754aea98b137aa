"""Meshes of a drawn robot with no more triangles than a picture shows.

Vertices of one cell of a grid become one (Rossignac and Borrel, 1993), and triangles without an
area are removed. Software renderers, which draw where there is no screen, spend most of their time
on triangles smaller than a pixel: the Unitree G1 has 393,000. Metres, in a mesh's own frame.
"""

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.geometry.surface import cells, one_number


def simplify(model: mujoco.MjModel, cell_m: float) -> None:
    """Merge the vertices of a model's meshes, in place; for drawing only.

    Args:
        cell_m: Edge of a cell of the grid.
    """
    for mesh in range(model.nmesh):
        faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        merged = _merged(model.mesh_vert[first : first + count], cell_m)
        corners = merged[model.mesh_face[faces]]
        shown = _distinct(corners)
        for values in (model.mesh_facenormal, model.mesh_facetexcoord):
            values[faces][: len(shown)] = values[faces][shown]
        model.mesh_face[faces][: len(shown)] = corners[shown]
        model.mesh_facenum[mesh] = len(shown)


def _merged(vertices: Float[np.ndarray, "V 3"], cell_m: float) -> Int[np.ndarray, " V"]:
    """Return, for each vertex, the one that stands for its cell: the nearest to the cell's mean."""
    cell = cells(vertices, cell_m)
    count = np.bincount(cell)[:, None]
    mean = np.stack([np.bincount(cell, column) for column in vertices.T], 1) / count
    off = np.linalg.norm(vertices - mean[cell], axis=1)
    order = np.lexsort((off, cell))
    kept: np.ndarray = order[np.searchsorted(cell[order], np.arange(len(count)))][cell]
    return kept


def _distinct(corners: Int[np.ndarray, "F 3"]) -> Int[np.ndarray, " K"]:
    """Return the triangles with an area, each once."""
    a, b, c = corners.T
    solid = np.flatnonzero((a != b) & (b != c) & (c != a))
    _, once = np.unique(one_number(np.sort(corners[solid], axis=1)), return_index=True)
    return np.sort(solid[once])
