"""Triangle surfaces as a viewer draws them: corners with normals, sharp edges kept sharp.

Right-handed: a face's corners run counter-clockwise seen from outside. Metres.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

CREASE_DEG = 40.0
"""Faces that meet at a larger angle have an edge between them."""
ROUND_STEPS, CAP_STEPS = 24, 6
"""Corners around a round part, and from the pole of a half ball to its rim."""
NORMAL_STEPS = 32
"""Steps a unit to which normals are rounded; equal ones are one."""
WAYS = 6
"""Steps a unit to which faces' normals are rounded; equal ones at one place are one direction."""
CORNERS_AT_ONCE = 20_000
"""Corners whose neighbours are compared in one array."""
TOWARDS_MEAN = 0.02
"""How far the corner of a cell is drawn to the mean of its corners, of its planes' weight."""


@dataclass(frozen=True)
class Surface:
    """Triangles.

    Attributes:
        vertices: Places of the corners.
        normals: Normals of length one, out of the solid.
        faces: Three corners each.
    """

    vertices: Float[np.ndarray, "V 3"]
    normals: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "F 3"]


def shaded(
    vertices: Float[np.ndarray, "V 3"],
    faces: Int[np.ndarray, "F 3"],
    cell_m: float = 0.0,
    crease_deg: float = CREASE_DEG,
) -> Surface:
    """Return triangles with normals that are smooth except across creases.

    Args:
        cell_m: Corners in one cube of this edge become one, where their faces' planes meet best
            (Lindstrom, 2000); 0 keeps all.
        crease_deg: Faces that meet at a larger angle have an edge between them.
    """
    vertices, faces = np.asarray(vertices, float), np.asarray(faces, np.int64)
    across = _across(vertices, faces)
    area = np.linalg.norm(across, axis=1)
    faces, across = faces[area > 0], across[area > 0]
    group = np.arange(len(vertices))
    shown = np.ones(len(faces), bool)
    if cell_m:
        group = cells(vertices, cell_m)
        vertices = _meeting_points(vertices, faces, across, group, cell_m)
        corners = group[faces]
        shown = (np.diff(corners[:, [0, 1, 2, 0]], axis=1) != 0).all(1)
    corner = group[faces]
    normals = _corner_normals(corner, across, shown, np.cos(np.radians(crease_deg)))
    at = corner[shown].ravel()
    steps = one_number(np.round((1 + normals) * NORMAL_STEPS))
    _, kind = np.unique(steps, return_inverse=True)
    _, first, index = np.unique(
        at * (kind.max(initial=0) + 1) + kind, return_index=True, return_inverse=True
    )
    at = at[first]
    return Surface(vertices[at], normals[first], index.reshape(-1, 3))


def ball(size: Float[np.ndarray, "3"]) -> Surface:
    """Return an ellipsoid by its half axes."""
    return _stretched(_capsule(1.0, 0.0), size)


def capsule(radius: float, half_length: float) -> Surface:
    """Return a capsule along z: a cylinder of that half length between two half balls."""
    return _capsule(radius, half_length)


def cylinder(radius: float, half_length: float) -> Surface:
    """Return a cylinder along z."""
    z = half_length
    return _revolved(np.array([[0.0, -z], [radius, -z], [radius, z], [0.0, z]]))


def box(size: Float[np.ndarray, "3"]) -> Surface:
    """Return a box by its half edges."""
    vertices = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1], indexing="ij"), -1).reshape(-1, 3)
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [[a, b, c] for a, b, c, _ in sides] + [[a, c, d] for a, _, c, d in sides]
    return shaded(vertices * np.asarray(size), np.array(faces))


def _capsule(radius: float, half_length: float) -> Surface:
    turn = np.linspace(-np.pi / 2, np.pi / 2, 2 * CAP_STEPS + 1)
    turn = np.insert(turn, CAP_STEPS, 0.0) if half_length else turn
    lift = np.where(np.arange(len(turn)) > CAP_STEPS, half_length, -half_length)
    profile = np.column_stack([radius * np.cos(turn), radius * np.sin(turn) + lift])
    profile[[0, -1], 0] = 0.0
    return _revolved(profile)


def _revolved(profile: Float[np.ndarray, "N 2"]) -> Surface:
    """Return the surface of a profile (radius, z), from below to above, turned about z."""
    around = np.linspace(0, 2 * np.pi, ROUND_STEPS, endpoint=False)
    ring = np.column_stack([np.cos(around), np.sin(around)])
    vertices = np.concatenate(
        [np.column_stack([radius * ring, np.full(ROUND_STEPS, z)]) for radius, z in profile]
    )
    here = np.arange(ROUND_STEPS)
    there, faces = np.roll(here, -1), []
    for row in range(len(profile) - 1):
        low, high = row * ROUND_STEPS, (row + 1) * ROUND_STEPS
        faces += [np.column_stack([low + here, low + there, high + there])]
        faces += [np.column_stack([low + here, high + there, high + here])]
    _, once, merged = np.unique(vertices.round(12), axis=0, return_index=True, return_inverse=True)
    found = merged[np.concatenate(faces)]
    return shaded(vertices[once], found[(np.diff(found[:, [0, 1, 2, 0]], axis=1) != 0).all(1)])


def _stretched(surface: Surface, size: np.ndarray) -> Surface:
    normals = surface.normals / np.asarray(size)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Surface(surface.vertices * size, normals, surface.faces)


def _across(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the normals of faces, as long as twice their area."""
    a, b, c = (vertices[column] for column in faces.T)
    result: np.ndarray = np.cross(b - a, c - a)
    return result


def cells(vertices: Float[np.ndarray, "V 3"], cell_m: float) -> Int[np.ndarray, " V"]:
    """Return the number of the cube of that edge in which each vertex lies."""
    places = np.floor(vertices / cell_m)
    number: np.ndarray = np.unique(one_number(places - places.min(0)), return_inverse=True)[1]
    return number


def one_number(numbers: np.ndarray) -> Int[np.ndarray, " N"]:
    """Return one number for each three; up to 2^21 values of each are distinguished."""
    x, y, z = numbers.astype(np.int64).T
    keys: np.ndarray = (x << 42) + (y << 21) + z
    return keys


def _meeting_points(
    vertices: np.ndarray, faces: np.ndarray, across: np.ndarray, group: np.ndarray, cell_m: float
) -> np.ndarray:
    """Return a place a cell: nearest to the planes of all faces that touch it."""
    count = group.max() + 1
    mean = _summed(group, vertices, count) / np.bincount(group, minlength=count)[:, None]
    place, planes = group[faces].ravel(), np.repeat(across, 3, axis=0)
    off = np.einsum("ci,ci->c", planes, vertices[faces.ravel()] - mean[place])
    target = _summed(place, planes * off[:, None], count)
    matrix = np.stack([_summed(place, planes * side[:, None], count) for side in planes.T], 1)
    weight = TOWARDS_MEAN * np.trace(matrix, axis1=1, axis2=2) + 1e-30
    shift = np.linalg.solve(matrix + weight[:, None, None] * np.eye(3), target[..., None])[..., 0]
    moved: np.ndarray = mean + np.clip(shift, -cell_m / 2, cell_m / 2)
    return moved


def _corner_normals(
    corner: np.ndarray, across: np.ndarray, shown: np.ndarray, least: float
) -> np.ndarray:
    """Return a normal for each corner of the faces that are shown.

    It is the sum of the normals of all faces at the same place that lie within the crease's angle;
    those of nearly one direction are compared together.
    """
    unit = across / np.linalg.norm(across, axis=1, keepdims=True)
    place, face = corner.ravel(), np.repeat(np.arange(len(corner)), 3)
    way = np.unique(one_number(np.round((1 + unit) * WAYS)), return_inverse=True)[1]
    keys, kind = np.unique(place * (way.max(initial=0) + 1) + way[face], return_inverse=True)
    sums = _summed(kind, across[face], len(keys))
    ways = sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-30)
    starts = np.searchsorted(keys // (way.max(initial=0) + 1), np.arange(place.max(initial=0) + 2))
    own = np.flatnonzero(np.repeat(shown, 3))
    result = np.zeros((len(own), 3))
    for begin in range(0, len(own), CORNERS_AT_ONCE):
        some = own[begin : begin + CORNERS_AT_ONCE]
        first = starts[place[some]]
        count = starts[place[some] + 1] - first
        mine = np.repeat(np.arange(len(some)), count)
        theirs = np.arange(len(mine)) + np.repeat(first - np.cumsum(count) + count, count)
        near = np.einsum("ij,ij->i", unit[face[some[mine]]], ways[theirs]) >= least
        result[begin : begin + len(some)] = _summed(mine[near], sums[theirs[near]], len(some))
    length = np.linalg.norm(result, axis=1, keepdims=True)
    found: np.ndarray = np.where(length > 0, result / np.maximum(length, 1e-30), unit[face[own]])
    return found


def _summed(group: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    return np.stack([np.bincount(group, column, minlength=count) for column in values.T], 1)
