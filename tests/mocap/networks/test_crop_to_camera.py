"""Crops and their geometry: where a network's numbers are in the image and before the camera."""

from pathlib import Path

import numpy as np
import pytest
import torch

from robojackson.body.forward_kinematics import forward
from robojackson.body.skeleton import KEYPOINT_NAMES, REST_JOINTS
from robojackson.errors import BadWeights
from robojackson.mocap.landmarks.pinhole_camera import Pinhole
from robojackson.mocap.networks import crop_to_camera, person_crop
from robojackson.mocap.networks.smpl_body import LEAF_VERTICES, body_of, measured_rest
from robojackson.mocap.networks.weight_files import Weights

LENS = Pinhole(1100.0, 1280, 720)


def a_view(count: int = 6, seed: int = 0) -> crop_to_camera.View:
    generator = np.random.default_rng(seed)
    boxes = generator.uniform([400, 250, 350], [800, 450, 600], (count, 3))
    return crop_to_camera.View(boxes, LENS.width, LENS.height)


def a_motion(count: int = 6, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return a moving person in random poses, and the twists."""
    from scipy.spatial.transform import Rotation

    generator = np.random.default_rng(seed)
    vectors = generator.normal(0.0, 0.2, (count * 24, 3))
    local = Rotation.from_rotvec(vectors).as_matrix().reshape(count, 24, 3, 3)
    local[:, 0] = local[:, 0] @ np.diag([1.0, -1.0, -1.0])
    root = generator.uniform([-0.5, -0.3, 3.5], [0.5, 0.3, 4.5], (count, 3))
    twist = np.broadcast_to([1.0, 0.0], (count, 23, 2))
    return forward(local, REST_JOINTS[None], root).points, twist


def seen_through_crops(
    points: np.ndarray, view: crop_to_camera.View
) -> tuple[np.ndarray, np.ndarray]:
    """Return (uvd, scale) of points before each frame's own lens, by projection."""
    pixels = points[..., :2] / points[..., 2:] * view.focal_px[:, None, None]
    pixels += np.array([view.width, view.height]) / 2.0
    uv = (pixels - view.boxes[:, None, :2]) / view.boxes[:, None, 2:]
    depth = points[:, :1, 2:] - 0.05
    uvd = np.concatenate([uv, (points[..., 2:] - depth) / crop_to_camera.DEPTH_M], -1)
    return uvd, crop_to_camera.FOCAL_PX / (person_crop.SIDE_PX * depth[:, 0, 0])


def test_a_box_is_a_square_a_quarter_wider_than_the_person() -> None:
    marks = np.zeros((1, 33, 2))
    marks[0, :2] = [[300.0, 100.0], [420.0, 600.0]]
    marks[0, 2:] = [350.0, 300.0]
    (x, y, side) = person_crop.person_boxes(marks)[0]
    above, below = 500.0 * person_crop.ABOVE, 500.0 * person_crop.BELOW
    assert (x, y) == pytest.approx((360.0, 350.0 + (below - above) / 2.0))
    assert side == pytest.approx((500.0 + above + below) * 1.25)


def test_a_crop_shows_the_box() -> None:
    image = np.zeros((720, 1280, 3), np.uint8)
    box = np.array([500.0, 300.0, 400.0])
    image[300 - 100 : 300 - 94, 500 + 50 : 500 + 56] = 255
    row, column = np.argwhere(person_crop.cut(image, box)[..., 0] > 128).mean(0) + 0.5
    uv = np.array([column, row]) / person_crop.SIDE_PX - 0.5
    there = person_crop.to_image(uv[None, None], box[None])[0, 0]
    assert np.abs(there - [553.0, 203.0]).max() < 1.5


def test_a_crop_beyond_the_image_is_black_there() -> None:
    image = np.full((100, 100, 3), 200, np.uint8)
    piece = person_crop.cut(image, np.array([0.0, 50.0, 100.0]))
    assert not piece[:, :120].any()
    assert (piece[10:-10, 136:] == 200).all()


def test_the_normalisation_is_the_one_that_the_weights_know() -> None:
    crops = np.zeros((1, 256, 256, 3), np.uint8)
    crops[..., 0], crops[..., 1], crops[..., 2] = 255, 128, 51
    red, green, blue = person_crop.normalise(crops)[0, :, 0, 0]
    assert red == pytest.approx((1.0 - 0.406) / 0.225)
    assert green == pytest.approx((128 / 255 - 0.457) / 0.224)
    assert blue == pytest.approx((0.2 - 0.480) / 0.229, rel=1e-5)


def test_lifting_undoes_the_projection() -> None:
    view, (points, _) = a_view(), a_motion()
    assert (
        np.abs(crop_to_camera.lift(*seen_through_crops(points, view), view) - points).max() < 1e-6
    )


def test_lifted_points_project_to_where_the_crop_has_them() -> None:
    view = a_view()
    generator = np.random.default_rng(5)
    uvd = generator.uniform(-0.4, 0.4, (6, 29, 3))
    points = crop_to_camera.lift(uvd, generator.uniform(0.6, 1.1, 6), view)
    for frame in range(6):
        lens = Pinhole(float(view.focal_px[frame]), view.width, view.height)
        expected = person_crop.to_image(
            uvd[frame : frame + 1, :, :2], view.boxes[frame : frame + 1]
        )[0]
        assert np.abs(lens.project(points[frame]) - expected).max() < 1e-6


def test_refocusing_keeps_the_shape_and_the_pixel_of_the_pelvis() -> None:
    view, (points, _) = a_view(), a_motion()
    moved = crop_to_camera.refocus(points, view, LENS, fps=30.0, depth_cutoff_hz=15.0)
    before = points[:, 0, :2] / points[:, 0, 2:] * view.focal_px[:, None]
    assert np.abs(moved - moved[:, :1] - (points - points[:, :1])).max() < 1e-12
    assert np.abs(LENS.project(moved[:, 0]) - before - [640.0, 360.0]).max() < 1e-6


def test_refocusing_with_the_same_lens_changes_nothing() -> None:
    points, _ = a_motion()
    side = LENS.focal_px * person_crop.SIDE_PX / crop_to_camera.FOCAL_PX
    view = crop_to_camera.View(np.tile([640.0, 360.0, side], (6, 1)), LENS.width, LENS.height)
    moved = crop_to_camera.refocus(points, view, LENS, fps=30.0, depth_cutoff_hz=15.0)
    assert np.abs(moved - points).max() < 1e-12


def test_the_refined_scale_is_that_of_the_true_bones() -> None:
    """A scale that is wrong by 5 % makes a person with other bones, which the clip's bones show."""
    view, (points, twist) = a_view(), a_motion()
    uvd, scale = seen_through_crops(points, view)
    zero = np.zeros((6, 29))
    wrong = scale * 1.05
    found = crop_to_camera.refine_scale(uvd, wrong, zero, twist, REST_JOINTS[None], view)
    assert (np.abs(found - scale) < 0.5 * np.abs(wrong - scale)).all()


def test_a_scale_that_nothing_refines_stays() -> None:
    view, (points, twist) = a_view(), a_motion()
    uvd, scale = seen_through_crops(points, view)
    found = crop_to_camera.refine_scale(
        uvd, scale, np.ones((6, 29)), twist, REST_JOINTS[None], view
    )
    assert np.array_equal(found, scale)


@pytest.fixture(scope="module")
def tables() -> dict[str, torch.Tensor]:
    """Return a body of SMPL's size with random vertices, one of which is every joint."""
    generator = torch.Generator().manual_seed(0)
    regressor = torch.zeros(24, 6890)
    regressor[torch.arange(24), torch.arange(24) * 100] = 1.0
    return {
        "v_template": torch.rand(6890, 3, generator=generator),
        "shapedirs": 0.01 * torch.randn(6890, 3, 10, generator=generator),
        "J_regressor": regressor,
    }


def test_rest_joints_come_from_the_shaped_template(tables: dict[str, torch.Tensor]) -> None:
    body = body_of(Weights(Path("w48.pth"), "hybrik_hrnet48", {}, tables))
    assert body is not None
    betas = np.random.default_rng(1).normal(0.0, 1.0, 10)
    shaped = tables["v_template"].numpy() + tables["shapedirs"].numpy() @ betas
    vertices = [*range(0, 2400, 100), *(LEAF_VERTICES[name] for name in KEYPOINT_NAMES[24:])]
    assert np.abs(body.rest_joints(betas) - shaped[vertices]).max() < 1e-6


def test_weights_without_smpl_have_no_body() -> None:
    assert body_of(Weights(Path("w48.pth"), "hybrik_hrnet48", {}, {})) is None


def test_a_body_of_another_size_is_reported(tables: dict[str, torch.Tensor]) -> None:
    other = tables | {"v_template": torch.zeros(10475, 3)}
    with pytest.raises(BadWeights, match=r"'v_template' is \(10475, 3\), expected \(6890, 3\)"):
        body_of(Weights(Path("w48.pth"), "hybrik_hrnet48", {}, other))


def test_measured_bones_are_those_of_the_person() -> None:
    points, _ = a_motion()
    assert np.abs(measured_rest(points * 1.1) - REST_JOINTS * 1.1).max() < 1e-9
