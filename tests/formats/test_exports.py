"""Every format: where the quaternion's parts stand, the way back, and what its readers look for."""

import io
import pickle
from collections.abc import Callable
from dataclasses import replace
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from robojackson.errors import BadTable, UnknownName
from robojackson.formats import beyondmimic, gmr, keyframes, locomujoco, omniretarget, unitree_csv
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.robot.sampling import SampledMotion
from tests.formats.conftest import (
    DT,
    MJCF,
    PERIOD_S,
    ROOT_HALF,
    STEPS,
    poses,
    same_rotations,
    yaw_rate,
)

WXYZ = [ROOT_HALF, 0.0, 0.0, ROOT_HALF]
XYZW = [0.0, 0.0, ROOT_HALF, ROOT_HALF]
"""90 degrees about the vertical."""
WITH_MODEL = {"gmr": gmr, "beyondmimic": beyondmimic, "locomujoco": locomujoco}
WITHOUT_MODEL = {"csv": unitree_csv, "omniretarget": omniretarget, "keyframes": keyframes}
READERS: dict[str, Callable[[bytes], SampledMotion]] = {
    name: module.read for name, module in (WITH_MODEL | WITHOUT_MODEL).items()
}
RATES = {"gmr": 30, "csv": 30, "omniretarget": 30, "beyondmimic": 50}


def exported(name: str, reference: ReferenceMotion, model: mujoco.MjModel) -> bytes:
    if name in WITH_MODEL:
        return WITH_MODEL[name].write(reference, model)
    return WITHOUT_MODEL[name].write(reference)


def arrays(data: bytes) -> dict[str, np.ndarray]:
    """Return the arrays of an .npz, read without pickles."""
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return dict(archive)


def csv_root(data: bytes) -> np.ndarray:
    return np.array(data.decode().splitlines()[3].split(",")[3:7], float)


def key_root(data: bytes) -> np.ndarray:
    key = ElementTree.fromstring(data).findall("keyframe/key")[3]
    return np.array(key.attrib["qpos"].split()[3:7], float)


@pytest.mark.parametrize(
    ("name", "root_of", "order"),
    [
        ("gmr", lambda data: pickle.loads(data)["root_rot"][3], XYZW),
        ("csv", csv_root, XYZW),
        ("beyondmimic", lambda data: arrays(data)["body_quat_w"][3, 0], WXYZ),
        ("locomujoco", lambda data: arrays(data)["qpos"][3, 3:7], WXYZ),
        ("omniretarget", lambda data: arrays(data)["qpos"][3, 3:7], WXYZ),
        ("keyframes", key_root, WXYZ),
    ],
)
def test_a_quarter_turn_stands_in_the_order_of_the_format(
    name: str, root_of, order: list[float], turned: ReferenceMotion, model: mujoco.MjModel
) -> None:
    np.testing.assert_allclose(root_of(exported(name, turned, model)), order, atol=1e-7)


@pytest.mark.parametrize("name", READERS)
def test_what_is_written_is_read_back(
    name: str, swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    back = READERS[name](exported(name, swaying, model))
    expected = poses(np.arange(len(back)) / back.fps)
    rest = [0, 1, 2, *range(7, 24)]
    np.testing.assert_allclose(back.qpos[:, rest], expected[:, rest], atol=2e-5)
    np.testing.assert_allclose(same_rotations(back.qpos[:, 3:7], expected[:, 3:7]), 1.0, atol=1e-6)


@pytest.mark.parametrize("name", READERS)
def test_a_cycle_has_the_frames_of_the_formats_rate(
    name: str, swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    back = READERS[name](exported(name, swaying, model))
    fps = RATES.get(name, 1 / DT)
    assert back.fps == pytest.approx(fps)
    assert len(back) == round(PERIOD_S * fps)


@pytest.mark.parametrize("name", ["locomujoco", "keyframes"])
def test_velocities_come_back_too(
    name: str, swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    back = READERS[name](exported(name, swaying, model))
    np.testing.assert_allclose(back.qvel, swaying.qvel, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("name", WITH_MODEL)
def test_another_robots_model_is_refused(
    name: str, swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    renamed = replace(swaying, joint_names=("tail", *swaying.joint_names[1:]))
    with pytest.raises(UnknownName, match="unknown joint 'tail'"):
        exported(name, renamed, model)


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("data", [b"", b"\x80\x04N.", b"1,2\n3,4\n", b"PK\x03\x04rubbish"])
def test_a_file_of_another_kind_is_reported(name: str, data: bytes) -> None:
    with pytest.raises(BadTable):
        READERS[name](data)


@pytest.mark.parametrize("name", ["beyondmimic", "locomujoco", "omniretarget"])
def test_a_missing_array_is_named(name: str) -> None:
    sink = io.BytesIO()
    np.savez(sink, fps=30, frequency=30)
    with pytest.raises(BadTable, match="is missing"):
        READERS[name](sink.getvalue())


def test_gmr_has_the_keys_that_its_readers_need(
    swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    content = pickle.loads(gmr.write(swaying, model))
    assert list(content) == [
        *("fps", "root_pos", "root_rot", "dof_pos", "local_body_pos", "link_body_list")
    ]


def test_gmr_bodies_are_posed_by_the_hinges_alone(
    swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    """Distances from the root are those in the world: the root itself moves nothing."""
    content = pickle.loads(gmr.write(swaying, model))
    local, data = content["local_body_pos"], mujoco.MjData(model)
    frame, foot = 20, content["link_body_list"].index("left_foot")
    data.qpos[:] = poses(np.array([frame / 30]))[0]
    mujoco.mj_kinematics(model, data)
    inside = data.xmat[1].reshape(3, 3).T @ (data.body("left_foot").xpos - data.xpos[1])
    np.testing.assert_allclose(local[frame, foot], inside, atol=1e-4)


def test_beyondmimic_has_the_keys_and_types_that_its_loader_reads(
    swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    found = arrays(beyondmimic.write(swaying, model))
    shapes = {name: values.shape for name, values in found.items() if values.dtype == np.float32}
    frames, bodies = 75, 13
    assert found["fps"].tolist() == [50]
    assert shapes == {
        "joint_pos": (frames, 17),
        "joint_vel": (frames, 17),
        "body_pos_w": (frames, bodies, 3),
        "body_quat_w": (frames, bodies, 4),
        "body_lin_vel_w": (frames, bodies, 3),
        "body_ang_vel_w": (frames, bodies, 3),
    }


@pytest.mark.parametrize("fps", [50.0, 1 / 0.015])
def test_beyondmimic_states_the_frame_rate_that_a_pack_has(
    swaying: ReferenceMotion, model: mujoco.MjModel, fps: float
) -> None:
    """A robot of 15 ms a control step has no whole number of frames a second."""
    motion = SampledMotion(fps, np.array(swaying.qpos), np.array(swaying.qvel))
    found = beyondmimic.motion_arrays(motion, model)["fps"]
    assert found.item() == pytest.approx(fps)
    assert (found.dtype.kind == "i") == fps.is_integer()


def test_beyondmimic_velocities_are_the_change_of_the_positions(
    swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    found = arrays(beyondmimic.write(swaying, model))
    moved = (found["body_pos_w"][2:] - found["body_pos_w"][:-2]) * 25
    np.testing.assert_allclose(found["body_lin_vel_w"][1:-1], moved, atol=0.02)


def test_beyondmimic_turns_are_reported_in_the_axes_of_the_world(
    swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    turns = arrays(beyondmimic.write(swaying, model))["body_ang_vel_w"][:, 0]
    expected = yaw_rate(np.arange(75) / 50)[:, None] * [0.0, 0.0, 1.0]
    np.testing.assert_allclose(turns, expected, atol=0.005)


def test_beyondmimic_says_which_column_is_which_body(
    swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    found = arrays(beyondmimic.write(swaying, model))
    assert tuple(found["body_names"]) == swaying.body_names
    assert tuple(found["joint_names"]) == swaying.joint_names


def test_locomujoco_has_every_field_of_a_trajectory_and_no_other(
    swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    """Its loader raises for a key that it does not know."""
    info = {"joint_names", "body_names", "site_names", "frequency"}
    data = {"qpos", "qvel", "xpos", "xquat", "cvel", "subtree_com", "site_xpos", "site_xmat"}
    constants = {"njnt", "jnt_type", "nbody", "body_rootid", "body_weldid", "body_mocapid"}
    constants |= {"body_pos", "body_quat", "body_ipos", "body_iquat"}
    constants |= {"nsite", "site_bodyid", "site_pos", "site_quat"}
    found = arrays(locomujoco.write(swaying, model))
    assert set(found) == info | data | constants | {"split_points"}


def test_locomujoco_counts_agree_with_its_names(
    swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    found = arrays(locomujoco.write(swaying, model))
    counted = [int(found[key]) for key in ("njnt", "nbody", "nsite")]
    assert counted == [len(found[key]) for key in ("joint_names", "body_names", "site_names")]
    assert found["xpos"].shape == (STEPS, len(found["body_names"]), 3)
    assert found["split_points"].tolist() == [0, STEPS]


def test_csv_has_a_root_and_all_hinges_a_row_and_no_head(swaying: ReferenceMotion) -> None:
    rows = [line.split(",") for line in unitree_csv.write(swaying).decode().splitlines()]
    assert {len(row) for row in rows} == {7 + 17}
    assert float(rows[0][2]) == pytest.approx(1.3)


def test_mujoco_takes_the_keyframes_into_the_robots_model(swaying: ReferenceMotion) -> None:
    included = MJCF.read_text().replace("</mujoco>", '<include file="keys.xml"/></mujoco>')
    assets = {"keys.xml": keyframes.write(swaying)}
    model = mujoco.MjModel.from_xml_string(included, assets)
    np.testing.assert_allclose(model.key_qpos, swaying.qpos, atol=1e-8)
    np.testing.assert_allclose(model.key_qvel, swaying.qvel, atol=1e-8)
    np.testing.assert_allclose(model.key_time, np.arange(STEPS) * DT, atol=1e-6)
