"""Surfaces: closed, outward, smooth where they are round and sharp at their edges."""

import numpy as np
import pytest

from robojackson.geometry import surface
from robojackson.geometry.surface import Surface, shaded

SOLIDS = {
    "ball": (surface.ball(np.array([0.1, 0.2, 0.3])), 4 / 3 * np.pi * 0.006),
    "capsule": (surface.capsule(0.1, 0.2), np.pi * 0.01 * (0.4 + 0.4 / 3)),
    "cylinder": (surface.cylinder(0.1, 0.2), np.pi * 0.01 * 0.4),
    "box": (surface.box(np.array([0.1, 0.2, 0.3])), 0.048),
}


def grid(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a flat square of 1 m in triangles."""
    ticks = np.linspace(0, 1, count)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    first = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    faces = [[first, first + count, first + 1], [first + 1, first + count, first + count + 1]]
    corners = np.concatenate([np.stack(each, 1) for each in faces])
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(count**2)]), corners


def volume(solid: Surface) -> float:
    """Return the volume by the divergence theorem; negative for a solid inside out."""
    a, b, c = (solid.vertices[column] for column in solid.faces.T)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("name", SOLIDS)
def test_a_solid_is_closed_and_has_its_volume(name: str) -> None:
    solid, expected = SOLIDS[name]
    assert volume(solid) == pytest.approx(expected, rel=0.04)


@pytest.mark.parametrize("name", SOLIDS)
def test_normals_are_unit_and_outward(name: str) -> None:
    solid, _ = SOLIDS[name]
    assert np.linalg.norm(solid.normals, axis=1) == pytest.approx(1.0)
    assert (np.einsum("ij,ij->i", solid.normals, solid.vertices) > 0).all()


def test_a_ball_is_smooth_and_a_box_has_edges() -> None:
    ball, box = surface.ball(np.full(3, 0.2)), SOLIDS["box"][0]
    assert np.abs(ball.normals - ball.vertices / 0.2).max() < 0.05
    assert len(box.vertices) == 24
    assert np.sort(np.abs(box.normals), axis=1) == pytest.approx(np.tile([0.0, 0.0, 1.0], (24, 1)))


def test_fewer_triangles_of_a_plane_are_the_same_plane() -> None:
    vertices, faces = grid(41)
    fewer = shaded(vertices, faces, 0.1)
    assert len(fewer.faces) < len(faces) / 10
    assert np.abs(fewer.vertices[:, 2]).max() < 1e-12
    assert fewer.normals == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(fewer.normals), 1)))


def test_fewer_triangles_of_a_ball_stay_within_a_cell_of_it_and_smooth() -> None:
    ball = surface.ball(np.full(3, 0.2))
    fewer = shaded(ball.vertices, ball.faces, 0.07)
    radius = np.linalg.norm(fewer.vertices, axis=1)
    assert len(fewer.faces) < len(ball.faces) / 2
    assert np.abs(radius - 0.2).max() < 0.035
    assert np.einsum("ij,ij->i", fewer.normals, fewer.vertices / radius[:, None]).min() > 0.95


def test_a_triangle_without_an_area_is_left_out() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]])
    assert len(shaded(vertices, np.array([[0, 1, 2], [0, 1, 3]])).faces) == 1
