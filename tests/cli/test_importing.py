"""`robojackson import` and `export` of a person's motion, from file to file."""

import gzip
import os
import pickle
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.api.foreign_files import Up
from robojackson.body.skeleton import keypoint
from robojackson.cli.exporting import export
from robojackson.cli.importing import import_motion, import_verdict
from robojackson.errors import BadConfiguration, BadTable, StoreError, UnknownName
from robojackson.files import tables
from robojackson.formats import amass, bvh, registry
from robojackson.formats.containers.npz_archive import pack
from robojackson.formats.foreign_motion import PELVIS
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.yaml_loader import load
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.robot.description import RobotDescription
from robojackson.robot.model import load_robot
from tests.fixtures.commands import Said, robojackson
from tests.fixtures.person import person

pytestmark = pytest.mark.xdist_group("importing")


@pytest.fixture(scope="module")
def smpl(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return smpl.parquet of a person who stands and waves."""
    path = tmp_path_factory.mktemp("import") / "smpl.parquet"
    path.write_bytes(tables.encode(person(legs=0.1, speed=0.0)))
    return path


def read(path: Path) -> SmplSequence:
    return tables.decode(SmplSequence, path.read_bytes(), str(path))


@pytest.mark.parametrize(
    "to", sorted(registry.person_exporters().keys() & registry.importers().keys())
)
def test_a_motion_goes_out_and_comes_back(to: str, smpl: Path, tmp_path: Path) -> None:
    export(smpl, to, tmp_path / "motion")
    result = import_motion(tmp_path / "motion", tmp_path / "back", None, None, "base", {})
    assert result["format"] == to
    back = read(tmp_path / "back" / "smpl.parquet")
    np.testing.assert_allclose(back.joints, read(smpl).joints, atol=1e-5)


@pytest.mark.parametrize(
    ("frames", "share", "lying", "kind"),
    [
        (90, 0.9, 0.1, "whole"),
        (90, 0.9, 0.6, "turned"),
        (90, 0.1, 0.0, "airborne"),
        (30, 0.9, 0.0, "too_short"),
    ],
)
def test_an_import_is_rated_by_its_feet_and_its_length(
    frames: int, share: float, lying: float, kind: str
) -> None:
    figures = {"frames": frames, "fps": 30.0, "contact_share": share, "lying_share": lying}
    assert import_verdict(figures | {"head_down_share": 0.0})["kind"] == kind


@pytest.mark.parametrize(("to", "up"), [("bvh", "z"), ("amass", "y")])
def test_wrong_axes_are_doubted(to: str, up: Up, smpl: Path, tmp_path: Path) -> None:
    """A person who lies by wrong axes "stands on the floor", since some point always does."""
    export(smpl, to, tmp_path / "motion")
    result = import_motion(tmp_path / "motion", tmp_path / "back", None, up, "base", {})
    assert result["verdict"]["kind"] == "turned"
    assert "is --up right?" in result["verdict"]["sentence"]


@pytest.mark.medium
def test_what_was_imported_can_be_retargeted(smpl: Path, tmp_path: Path) -> None:
    export(smpl, "bvh", tmp_path / "motion.bvh")
    import_motion(tmp_path / "motion.bvh", tmp_path, None, None, "base", {})
    robot = load_robot(load(RobotDescription, "robots/humanoid"))
    config = RetargetConfig(starts=1, tempo=1.0)
    reference = retarget_motion(read(tmp_path / "smpl.parquet"), robot, config)
    assert np.isfinite(reference.qpos).all()
    assert reference.scorecard["limit_violations"] == 0.0


@pytest.mark.parametrize("to", ["gmr", "keyframes"])
def test_a_format_for_robots_does_not_fit_a_person(to: str, smpl: Path, tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match=r"holds a person's.*Known: amass, bvh, csv, gltf, gvhmr"):
        export(smpl, to, tmp_path / "motion")


def test_what_is_no_table_is_reported(tmp_path: Path) -> None:
    (tmp_path / "x.parquet").write_bytes(b"no table")
    with pytest.raises(BadTable, match="not a Parquet file"):
        export(tmp_path / "x.parquet", "bvh", tmp_path / "motion.bvh")


def lacking_rate(tmp_path: Path) -> Path:
    """Return an AMASS file without a frame rate."""
    sequence = person()
    poses = np.concatenate([sequence.global_orient, sequence.body_pose[:, :63]], axis=1)
    trans = sequence.transl - PELVIS["smpl"]
    path = tmp_path / "motion.npz"
    path.write_bytes(pack({"poses": poses, "trans": trans}))
    return path


def test_a_file_without_a_rate_needs_one(tmp_path: Path) -> None:
    path = lacking_rate(tmp_path)
    with pytest.raises(BadConfiguration, match="--fps"):
        import_motion(path, tmp_path / "out", None, None, "base", {})
    assert not (tmp_path / "out").exists()
    assert import_motion(path, tmp_path / "out", 25.0, None, "base", {})["fps"] == 25.0


def test_another_rate_than_the_files_is_reported(smpl: Path, tmp_path: Path) -> None:
    export(smpl, "bvh", tmp_path / "motion.bvh")
    result = import_motion(tmp_path / "motion.bvh", tmp_path, 60.0, None, "base", {})
    assert result["fps"] == 60.0
    assert "the file has 30 frames a second: 60 was given" in result["notes"]


def test_the_axis_that_points_up_can_be_given(smpl: Path, tmp_path: Path) -> None:
    export(smpl, "bvh", tmp_path / "motion.bvh")
    result = import_motion(tmp_path / "motion.bvh", tmp_path, None, "z", "base", {})
    joints = read(tmp_path / "smpl.parquet").joints
    trunk = joints[:, keypoint("neck")] - joints[:, 0]
    assert (np.abs(trunk[:, 1]) > 2.0 * np.abs(trunk[:, 2])).all()
    assert result["frames"] == len(joints)


class Trap:
    """What runs a function where it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.system, (f"touch {self.mark}",)


def test_a_wicked_file_runs_nothing_and_makes_nothing(tmp_path: Path) -> None:
    path, mark = tmp_path / "res.pk", tmp_path / "mark"
    path.write_bytes(pickle.dumps({"pred_xyz_29": Trap(mark)}))
    with pytest.raises(BadTable, match=r"res.pk: refused, it asks for \w+.system"):
        import_motion(path, tmp_path / "out", None, None, "base", {})
    assert not mark.exists()
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "content", [b"hello", bytes(100), pickle.dumps({"joints": 1}), b"\xff\xd8\xff\xe0"]
)
def test_no_ones_file_lists_what_is_read(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(content)
    with pytest.raises(UnknownName, match="Known: aist, amass, bvh, csv, gvhmr, hybrik"):
        import_motion(tmp_path / "file", tmp_path / "out", None, None, "base", {})


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "empty"),
        (tables.encode(person()), "retarget"),
        (amass.write(person())[:500], "cut off"),
        (gzip.compress(b"HIERARCHY", mtime=0), "unpack"),
        (zlib.compress(b"joblib"), "compress=0"),
    ],
)
def test_a_file_that_cannot_be_read_says_what_to_do(
    content: bytes, message: str, tmp_path: Path
) -> None:
    (tmp_path / "file").write_bytes(content)
    with pytest.raises(BadTable, match=message):
        import_motion(tmp_path / "file", tmp_path / "out", None, None, "base", {})
    assert not (tmp_path / "out").exists()


def test_a_skeleton_without_legs_is_refused_by_the_files_name(tmp_path: Path) -> None:
    path = tmp_path / "motion.npz"
    path.write_bytes(amass.write(replace(person(), rest_joints=np.zeros((29, 3)))))
    with pytest.raises(BadTable, match=r"motion.npz: the skeleton: not a person, its legs are 0 m"):
        import_motion(path, tmp_path / "out", None, None, "base", {})


def test_a_folder_in_the_place_of_a_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="a folder, not a file"):
        import_motion(tmp_path, tmp_path / "out", None, None, "base", {})


def test_a_motion_is_not_written_over_itself(smpl: Path) -> None:
    before = smpl.read_bytes()
    with pytest.raises(StoreError, match="is the motion itself"):
        export(smpl, "bvh", smpl.parent / "." / smpl.name)
    assert smpl.read_bytes() == before


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="no such file"):
        import_motion(tmp_path / "res.pk", tmp_path / "out", None, None, "base", {})


@pytest.fixture(scope="module")
def answered(smpl: Path) -> Said:
    """Run the command in a process of its own."""
    path = smpl.parent / "motion.bvh"
    path.write_bytes(bvh.write(read(smpl)))
    return robojackson("import", path, "-o", smpl.parent / "out", "--json")


@pytest.mark.medium
def test_the_command_writes_the_table_it_names(answered: Said) -> None:
    assert answered.code == 0, answered.err
    assert len(read(Path(answered.answer["smpl"]))) == answered.answer["frames"]


@pytest.mark.medium
def test_the_command_loads_no_prefect(answered: Said) -> None:
    assert not answered.loaded_prefect
