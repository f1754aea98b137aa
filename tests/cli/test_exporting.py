"""`robojackson.cli.exporting`: a reference of the real pipeline, written for others from file to
file."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.cli.cards import command_line
from robojackson.cli.exporting import export, has_screen, pack_command
from robojackson.cli.lifetime.interruption import python
from robojackson.cli.training_words import pack_of
from robojackson.errors import RejectedReference, StoreError, UnknownName
from robojackson.files import tables
from robojackson.formats import (
    beyondmimic,
    gmr,
    keyframes,
    locomujoco,
    omniretarget,
    registry,
    unitree_csv,
)
from tests.fixtures.commands import Said, in_process, robojackson
from tests.fixtures.robots import robot_motion

pytestmark = pytest.mark.xdist_group("exporting")

READERS = {
    "gmr": gmr.read,
    "csv": unitree_csv.read,
    "beyondmimic": beyondmimic.read,
    "locomujoco": locomujoco.read,
    "omniretarget": omniretarget.read,
    "keyframes": keyframes.read,
}


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the hip shake, as `robojackson retarget` leaves it."""
    path = tmp_path_factory.mktemp("export") / "reference.parquet"
    path.write_bytes(tables.encode(robot_motion("hip_shake")))
    return path


@pytest.mark.medium
@pytest.mark.parametrize("to", sorted({*registry.robot_exporters()} - {"gltf"}))  # test_gltf.py
def test_every_format_starts_with_the_first_pose(to: str, reference: Path, tmp_path: Path) -> None:
    out = tmp_path / "motion"
    export(reference, to, out)
    first = READERS[to](out.read_bytes()).qpos[0]
    expected = robot_motion("hip_shake").qpos[0]
    sign = np.sign(first[3:7] @ expected[3:7])
    np.testing.assert_allclose(
        first, [*expected[:3], *sign * expected[3:7], *expected[7:]], atol=1e-5
    )


@pytest.mark.medium
def test_the_answer_names_what_was_written(reference: Path, tmp_path: Path) -> None:
    out = tmp_path / "motion.csv"
    result = export(reference, "csv", out)
    assert (result["file"], result["bytes"]) == (str(out), out.stat().st_size)


@pytest.mark.medium
def test_the_answer_rates_the_motion_by_its_score_card(reference: Path, tmp_path: Path) -> None:
    result = export(reference, "csv", tmp_path / "motion.csv")
    assert result["verdict"]["kind"] == "feasible"
    assert "next" not in result, "another program trains on the file"


@pytest.mark.medium
@pytest.mark.parametrize("to", sorted({*registry.robot_exporters()} - {"gltf"}))
def test_the_answer_counts_the_frames_of_the_file(to: str, reference: Path, tmp_path: Path) -> None:
    out = tmp_path / "motion"
    result = export(reference, to, out)
    found = READERS[to](out.read_bytes())
    assert "steps" not in result
    assert (result["frames"], result["fps"]) == (len(found), pytest.approx(found.fps, rel=1e-4))


@pytest.mark.medium
@pytest.mark.parametrize(
    ("card", "kind"), [({}, "unchecked"), ({"floor_penetration_mm": 500.0}, "refused")]
)
def test_a_motion_that_no_robot_can_follow_is_retargeted_next(
    card: dict[str, float], kind: str, tmp_path: Path
) -> None:
    motion = replace(robot_motion("hip_shake"), scorecard=card, certificate=None)
    source, out = motion.save(tmp_path / "r.parquet"), tmp_path / "motion.csv"
    result = export(source, "csv", out)
    assert result["verdict"]["kind"] == kind
    assert "next" not in result, "there is no person to retarget"
    (tmp_path / "smpl.parquet").touch()
    words = ("retarget", tmp_path / "smpl.parquet", "-o", tmp_path, "--robot", "humanoid")
    assert export(source, "csv", out)["next"] == command_line(*words)


@pytest.mark.medium
def test_an_unknown_format_lists_those_there_are(reference: Path, tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="Known: beyondmimic, csv, gltf, gmr, keyframes"):
        export(reference, "fbx", tmp_path / "motion.fbx")


@pytest.mark.medium
def test_a_format_for_persons_does_not_fit_a_robot(reference: Path, tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match=r"a robot's motion.*Known: beyondmimic, csv, gltf, gmr"):
        export(reference, "bvh", tmp_path / "motion.bvh")
    assert not (tmp_path / "motion.bvh").exists()


@pytest.mark.medium
def test_no_file_of_a_stage_is_replaced(reference: Path, tmp_path: Path) -> None:
    kept = tmp_path / "smpl.parquet"
    kept.write_bytes(b"motion of a person")
    with pytest.raises(StoreError, match="is what a stage wrote"):
        export(reference, "csv", kept)
    assert kept.read_bytes() == b"motion of a person"


@pytest.mark.parametrize(("display", "screen"), [("", False), (":0", True)])
def test_a_window_is_offered_where_one_can_be_opened(
    display: str, screen: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", display)
    assert has_screen() is screen


@pytest.mark.parametrize(("platform", "interpreter"), [("darwin", "mjpython"), ("linux", python())])
def test_the_viewer_of_a_pack_is_opened_by_the_interpreter_that_may(
    platform: str, interpreter: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("sys.platform", platform)
    assert pack_command(Path("PACK")) == f"{interpreter} {Path('PACK') / 'run.py'} --view"


def test_a_reference_of_another_model_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "reference.parquet"
    path.write_bytes(tables.encode(replace(robot_motion("hip_shake"), model_sha256="0" * 64)))
    with pytest.raises(RejectedReference):
        export(path, "csv", tmp_path / "motion.csv")


@pytest.mark.medium
def test_a_folder_is_refused_with_the_motion_in_it(reference: Path, tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"did you mean .*/reference\.parquet\?"):
        export(reference.parent, "csv", tmp_path / "motion.csv")


def test_a_missing_reference_is_reported(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="no such file"):
        export(tmp_path / "reference.parquet", "csv", tmp_path / "motion.csv")


def test_a_format_of_motions_does_not_fit_a_policy(tmp_path: Path) -> None:
    (tmp_path / "policy.safetensors").write_bytes(b"")
    with pytest.raises(UnknownName, match=r"holds a policy\)\. Known: deploy, onnx"):
        export(tmp_path / "policy.safetensors", "bvh", tmp_path / "motion.bvh")


@pytest.fixture(scope="module")
def answered(reference: Path) -> Said:
    """Run the command in a process of its own."""
    out = reference.parent / "motion.pkl"
    return robojackson("export", reference, "--to", "gmr", "-o", out, "--json")


@pytest.mark.medium
def test_the_command_writes_the_file_it_names(answered: Said) -> None:
    assert answered.code == 0, answered.err
    assert len(gmr.read(Path(answered.answer["file"]).read_bytes())) > 1


@pytest.mark.medium
def test_the_command_loads_no_prefect(answered: Said) -> None:
    assert not answered.loaded_prefect


def test_the_help_lists_every_format() -> None:
    listed = set(re.findall(r"[\w-]+", in_process("export", "--help").out))
    declared = {*registry.robot_exporters(), *registry.person_exporters()}
    assert listed >= declared | set(registry.policy_exporters())


def test_a_pack_of_a_tracker_needs_the_motion_and_one_that_a_robot_can_run(
    reference: Path, tmp_path: Path
) -> None:
    words = ("export", "regulator_onboard", "--to", "deploy", "-o", str(tmp_path / "pack"))
    said = robojackson(*words)
    assert said.code != 0
    assert "needs the motion: --reference reference.parquet" in said.err
    other = robojackson(*words, "--reference", str(reference))
    assert other.code != 0
    assert "drives robot 'g1', not 'humanoid'" in other.err
    network = robojackson("export", "twist2", *words[2:], "--reference", str(reference))
    assert "'twist2' cannot go into a deploy pack" in network.err
    onnx = robojackson("export", "regulator_onboard", "--to", "onnx", "-o", str(tmp_path / "x"))
    assert "can be written as deploy alone" in onnx.err
    assert not (tmp_path / "pack").exists()


def test_after_the_evaluation_of_a_tracker_comes_its_pack_with_the_evaluation(
    reference: Path, tmp_path: Path
) -> None:
    shown = pack_of(Path("regulator_onboard"), reference, tmp_path)
    assert shown.startswith("robojackson export regulator_onboard --to deploy --reference")
    assert shown.endswith(f"--evaluation {tmp_path} -o {tmp_path}/pack")
    assert "--evaluation" not in pack_of(Path("regulator_onboard"), reference, None)
