"""Meshes of a drawn robot: fewer triangles, the same shape within a cell, nothing else touched."""

import mujoco
import numpy as np
import pytest

from robojackson.report.video.mesh_detail import simplify


@pytest.fixture
def ball() -> mujoco.MjModel:
    """Return a ball of 20 cm of many small triangles, and a small box mesh after it."""
    spec = mujoco.MjSpec()
    turn, rise = np.meshgrid(np.linspace(0, 2 * np.pi, 60), np.linspace(-1.5, 1.5, 40))
    points = 0.2 * np.stack(
        [np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)], -1
    )
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    for name, vertices in (("ball", points.reshape(-1, 3)), ("box", 0.3 * corners)):
        mesh = spec.add_mesh(name=name)
        mesh.uservert = vertices.ravel()
        body = spec.worldbody.add_body(name=name)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)
    return spec.compile()


def surface(model: mujoco.MjModel, mesh: int) -> np.ndarray:
    """Return the corners of the triangles of a mesh, metres."""
    first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return model.mesh_vert[model.mesh_vertadr[mesh] + model.mesh_face[first : first + count]]


def test_the_shape_stays_within_a_cell_with_fewer_triangles(ball: mujoco.MjModel) -> None:
    before, count = surface(ball, 0).reshape(-1, 3), int(ball.mesh_facenum[0])
    simplify(ball, 0.03)
    after = surface(ball, 0).reshape(-1, 3)
    assert ball.mesh_facenum[0] < 0.7 * count
    away = np.linalg.norm(before[:, None] - after[None], axis=-1).min(1)
    assert away.max() <= 0.03 * np.sqrt(3)


def test_every_triangle_has_an_area_and_is_there_once(ball: mujoco.MjModel) -> None:
    simplify(ball, 0.03)
    faces = np.sort(ball.mesh_face[: ball.mesh_facenum[0]], axis=1)
    assert (np.diff(faces, axis=1) > 0).all()
    assert len(np.unique(faces, axis=0)) == len(faces)


def test_a_mesh_that_is_coarse_already_stays_as_it_is(ball: mujoco.MjModel) -> None:
    before = surface(ball, 1).copy()
    simplify(ball, 0.03)
    np.testing.assert_array_equal(surface(ball, 1), before)
