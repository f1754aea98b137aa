"""AMASS, AIST++, GVHMR and csv: there and back, and files written as their projects write them."""

import io
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from robojackson.errors import BadTable
from robojackson.formats import aist, amass, bvh, gvhmr, smpl_csv
from robojackson.formats.containers import torch_archive
from robojackson.formats.foreign_motion import PELVIS, ForeignMotion
from robojackson.mocap.imported_motion import ground_foreign_motion
from tests.fixtures.person import FRAMES, UPRIGHT, axis_angles, joints_of, path, person

Y_UP = Rotation.from_matrix([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Our world seen by a file whose y is up."""


def placed(motion: ForeignMotion) -> np.ndarray:
    """Return the joints in our world, from the pelvis."""
    found = ground_foreign_motion(motion, 30.0).joints
    return found - found[:, :1]


CAMERA = {"rotation_w": np.eye(3).tolist(), "position_w": [0.0, -3.0, 1.0], "focal_px": 500.0}
CAMERA |= {"width": 640, "height": 360}
INCAM = {"smpl_params_incam", "K_fullimg"}


def from_pelvis(joints: np.ndarray) -> np.ndarray:
    return joints - joints[:, :1]


@pytest.mark.parametrize("module", [amass, bvh, gvhmr, smpl_csv])
def test_a_motion_comes_back_as_it_went(module: Any) -> None:
    expected = person()
    motion = module.read(module.write(expected))
    back = ground_foreign_motion(motion, motion.fps)
    assert back.fps == pytest.approx(expected.fps)
    np.testing.assert_allclose(back.joints, expected.joints, atol=1e-5)


@pytest.mark.parametrize(
    ("order", "line"),
    [
        ([*range(5), *range(9, FRAMES)], 7),
        ([*range(9), *range(4, FRAMES)], 11),
        ([*range(6), 7, 6, *range(8, FRAMES)], 8),
        ([*range(FRAMES - 1, -1, -1)], 3),
    ],
    ids=["cut", "pasted", "exchanged", "backwards"],
)
def test_a_csv_whose_rows_are_not_in_time_is_refused_at_its_line(
    order: list[int], line: int
) -> None:
    head, *lines = smpl_csv.write(person()).decode().splitlines()
    with pytest.raises(BadTable, match=f"line {line}: time_s goes from"):
        smpl_csv.read("\n".join([head, *(lines[n] for n in order)]).encode())


@pytest.mark.parametrize("digits", [3, 2])
def test_a_csv_with_rounded_times_and_blank_lines_keeps_its_tempo(digits: int) -> None:
    head, *lines = smpl_csv.write(person()).decode().splitlines()
    cells = [line.split(",") for line in lines]
    table = [",".join([f"{float(first):.{digits}f}", *rest]) for first, *rest in cells]
    found = smpl_csv.read("\n\n".join([head, *table]).encode())
    assert found.fps == pytest.approx(person().fps, rel=0.02)


@pytest.mark.parametrize("module", [bvh, smpl_csv])
def test_formats_with_hands_bring_their_tips_back(module: Any) -> None:
    expected = person()
    back = ground_foreign_motion(module.read(module.write(expected)), expected.fps)
    np.testing.assert_allclose(back.keypoints_w, expected.keypoints_w, atol=1e-5)


@pytest.mark.parametrize("scale", [0.3, 0.5, 0.65, 1.3])
def test_a_bvh_of_ours_keeps_the_size_of_the_person(scale: float) -> None:
    small = replace(person(), rest_joints=scale * person().rest_joints)
    motion = bvh.read(bvh.write(small))
    np.testing.assert_allclose(motion.rest_joints, small.rest_joints, atol=1e-5)
    assert not motion.notes


def test_of_a_camera_that_moved_gvhmr_gets_no_view() -> None:
    still = replace(person(), camera=CAMERA)
    moved = replace(person(), camera={**CAMERA, "moved": True})
    views = [set(torch_archive.load(gvhmr.write(s), "f")) & INCAM for s in (still, moved)]
    assert views == [INCAM, set()]


def amass_file(**arrays: Any) -> bytes:
    sink = io.BytesIO()
    np.savez_compressed(sink, **arrays)
    return sink.getvalue()


def z_up() -> tuple[np.ndarray, np.ndarray]:
    """Return poses (FRAMES, 22, 3) with the root turned upright, and the path of SMPL's trans."""
    vectors = axis_angles()[:, :22]
    vectors[:, 0] = UPRIGHT.as_rotvec()
    return vectors, path()


def wanted_joints() -> np.ndarray:
    vectors = axis_angles()
    vectors[:, 22:] = 0.0
    return joints_of(vectors, path())


def test_a_file_of_amass_with_fingers_is_read() -> None:
    vectors, pelvis = z_up()
    poses = np.concatenate([vectors.reshape(FRAMES, 66), np.ones((FRAMES, 90))], axis=1)
    data = amass_file(
        poses=poses,
        trans=pelvis - PELVIS["smpl"],
        betas=np.ones(16),
        dmpls=np.zeros((FRAMES, 8)),
        gender=np.array("male"),
        mocap_framerate=np.array(120.0),
    )
    motion = amass.read(data)
    assert motion.fps == 120.0
    np.testing.assert_allclose(placed(motion), from_pelvis(wanted_joints()), atol=1e-9)


def test_a_file_of_amass_for_smplx_is_read_and_its_labels_are_not_unpickled() -> None:
    vectors, pelvis = z_up()
    data = amass_file(
        root_orient=vectors[:, 0],
        pose_body=vectors[:, 1:].reshape(FRAMES, 63),
        pose_hand=np.zeros((FRAMES, 90)),
        trans=pelvis - PELVIS["smplx"],
        betas=np.zeros(16),
        gender=np.array("female"),
        surface_model_type=np.array("smplx"),
        markers_latent_vids=np.array([{"a": 1}], dtype=object),
        mocap_frame_rate=np.array(60.0),
    )
    motion = amass.read(data)
    assert motion.fps == 60.0
    np.testing.assert_allclose(motion.pelvis, pelvis, atol=1e-12)
    np.testing.assert_allclose(placed(motion), from_pelvis(wanted_joints()), atol=1e-9)


def y_up() -> tuple[np.ndarray, np.ndarray]:
    """Return the root's axis-angle and the pelvis of the person in axes with y up."""
    root = (Y_UP * UPRIGHT).as_rotvec()
    return np.tile(root, (FRAMES, 1)), Y_UP.apply(path())


def aist_file(protocol: int = 4, **more: Any) -> bytes:
    root, pelvis = y_up()
    poses = np.concatenate([root[:, None], axis_angles()[:, 1:]], axis=1).reshape(FRAMES, 72)
    content = {
        "smpl_loss": 1.5,
        "smpl_poses": poses.astype(np.float32),
        "smpl_scaling": np.array([93.0], np.float32),
        "smpl_trans": (93.0 * (pelvis - PELVIS["smpl"])).astype(np.float32),
    }
    return pickle.dumps(content | more, protocol=protocol)


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_a_file_of_aist_is_read(protocol: int) -> None:
    motion = aist.read(aist_file(protocol))
    assert motion.fps == 60.0
    back = ground_foreign_motion(motion, 60.0)
    np.testing.assert_allclose(
        from_pelvis(back.joints), from_pelvis(joints_of(axis_angles(), path())), atol=1e-5
    )
    moved = np.diff(back.joints[:, 0], axis=0)
    np.testing.assert_allclose(moved, np.diff(path(), axis=0), atol=1e-5)


def gvhmr_file(**more: Any) -> bytes:
    root, pelvis = y_up()
    part = {
        "body_pose": torch.tensor(axis_angles()[:, 1:22].reshape(FRAMES, 63)),
        "global_orient": torch.tensor(root),
        "transl": torch.tensor(pelvis - PELVIS["smplx"]),
        "betas": torch.ones(10).expand(FRAMES, 10),
    }
    sink = io.BytesIO()
    content = {"smpl_params_global": part, "smpl_params_incam": part, "K_fullimg": torch.eye(3)}
    torch.save(content | more, sink)
    return sink.getvalue()


def test_a_file_of_gvhmr_is_read() -> None:
    motion = gvhmr.read(gvhmr_file())
    assert motion.fps is None
    np.testing.assert_array_equal(motion.betas, np.ones(10))
    np.testing.assert_allclose(placed(motion), from_pelvis(wanted_joints()), atol=1e-9)


def test_what_we_write_for_gvhmr_opens_in_torch_without_pickle() -> None:
    sequence = person()
    back = torch.load(io.BytesIO(gvhmr.write(sequence)), weights_only=True)["smpl_params_global"]
    root = Rotation.from_rotvec(back["global_orient"].numpy()).as_matrix()
    up = root[:, :, 1]
    np.testing.assert_allclose(up, np.tile([0.0, 1.0, 0.0], (FRAMES, 1)), atol=1e-6)
    pelvis = back["transl"].numpy() + PELVIS["smplx"]
    np.testing.assert_allclose(pelvis[:, 1], sequence.joints[:, 0, 2], atol=1e-6)


def test_gvhmrs_camera_sees_the_person_where_the_camera_is() -> None:
    """A level camera three metres before the person: z forward, y down."""
    sequence = person()
    rotation = [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
    camera = {"rotation_w": rotation, "position_w": [3.0, 0.0, 1.0], "focal_px": 500.0}
    object.__setattr__(sequence, "camera", camera | {"width": 640, "height": 480})
    back = torch.load(io.BytesIO(gvhmr.write(sequence)), weights_only=True)
    pelvis = back["smpl_params_incam"]["transl"].numpy() + PELVIS["smplx"]
    world = sequence.joints[:, 0]
    seen = np.stack([world[:, 1], 1.0 - world[:, 2], 3.0 - world[:, 0]], -1)
    np.testing.assert_allclose(pelvis, seen, atol=1e-5)
    assert back["K_fullimg"].shape == (FRAMES, 3, 3)


def broken(kind: str) -> dict[str, Any]:
    poses = np.zeros((FRAMES, 72), np.float32)
    if kind == "NaN":
        poses[3, 5] = np.nan
    return {
        "NaN": {"smpl_poses": poses},
        "shape": {"smpl_poses": poses[:, :66]},
        "length": {"smpl_poses": poses[:-3]},
        "empty": {"smpl_poses": poses[:0]},
        "text": {"smpl_poses": "none"},
        "scale": {"smpl_scaling": np.zeros(1)},
        "word": {"smpl_scaling": "none"},
    }[kind]


@pytest.mark.parametrize("kind", ["NaN", "shape", "length", "empty", "text", "scale", "word"])
def test_arrays_that_are_no_motion_are_named(kind: str) -> None:
    with pytest.raises(BadTable, match="AIST"):
        aist.read(aist_file(**broken(kind)))


@pytest.mark.parametrize(
    ("read", "data", "missing"),
    [
        (amass.read, amass_file(poses=np.zeros((4, 156))), "trans"),
        (amass.read, amass_file(trans=np.zeros((4, 3))), "poses"),
        (amass.read, amass_file(trans=np.zeros((4, 3)), poses=np.zeros((4, 100))), "100"),
        (aist.read, pickle.dumps({"smpl_trans": np.zeros((4, 3))}), "smpl_poses"),
        (gvhmr.read, gvhmr_file(smpl_params_global=None), "smpl_params_global"),
        (smpl_csv.read, b"time_s,a\n1,2\n", "head"),
        (smpl_csv.read, b"", "csv"),
    ],
)
def test_what_is_missing_is_named(read: Any, data: bytes, missing: str) -> None:
    with pytest.raises(BadTable, match=missing):
        read(data)


@pytest.mark.parametrize("betas", [None, "none", np.array(1.0), np.zeros(0), np.full(10, np.nan)])
def test_a_shape_that_is_none_is_left_out(betas: Any) -> None:
    part = {"body_pose": np.zeros((4, 63)), "global_orient": np.zeros((4, 3))}
    part |= {"transl": np.zeros((4, 3)), "betas": betas}
    sink = io.BytesIO()
    torch.save({"smpl_params_global": part}, sink)
    assert np.isfinite(gvhmr.read(sink.getvalue()).betas).all()


@pytest.mark.parametrize("module", [amass, bvh, gvhmr, smpl_csv])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_file_that_is_cut_off_is_reported(module: Any, share: float) -> None:
    data = module.write(person())
    with pytest.raises(BadTable):
        module.read(data[: int(share * len(data))])


@pytest.mark.parametrize("rate", [10**400, float("nan"), "fast", None, [1.0, 2.0]])
def test_a_rate_that_is_no_number_is_none(rate: object) -> None:
    content = io.BytesIO()
    row = torch.zeros(2, 3)
    part = {"body_pose": torch.zeros(2, 63), "global_orient": row, "transl": row}
    torch.save({gvhmr.WORLD: part, "fps": rate}, content)
    assert gvhmr.read(content.getvalue()).fps is None


def test_a_message_names_a_dozen_of_many_keys() -> None:
    content = io.BytesIO()
    torch.save({f"key{i}": 0 for i in range(2000)}, content)
    with pytest.raises(BadTable, match=r"key11 and 1988 more$"):
        gvhmr.read(content.getvalue())


def test_complex_numbers_are_no_motion() -> None:
    arrays = {"poses": np.zeros((3, 156)), "trans": np.zeros((3, 3), complex)}
    with pytest.raises(BadTable, match="'trans' is not an array of numbers"):
        amass.read(amass_file(**arrays))
