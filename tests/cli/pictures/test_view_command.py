"""`view`: the folder of a run as films and recordings for other viewers, and its refusals."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from robojackson.api.rerun_export import rewards
from robojackson.api.robots import load_robot
from robojackson.api.run_folder import read_run
from robojackson.body.skeleton import REST_JOINTS
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.rollout import Rollout
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video.animation import write_animation
from robojackson.report.video.encoder import write_video
from tests.fixtures.commands import in_process

pytestmark = pytest.mark.xdist_group("view_command")

REFERENCE = Path(__file__).parents[3] / "benchmarks/learning/references/hip_shake.parquet"
FRAMES, FPS, STEPS = 30, 30.0, 60


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the files of a dance: a second of the hip shake, danced perfectly."""
    place = tmp_path_factory.mktemp("run")
    reference = ReferenceMotion.load(REFERENCE)
    points = np.tile(REST_JOINTS[:, [2, 0, 1]] + [0.0, 0.0, 1.0], (FRAMES, 1, 1))
    sequence = SmplSequence(
        fps=FPS, global_orient=np.zeros((FRAMES, 3)), body_pose=np.zeros((FRAMES, 69)),
        transl=np.zeros((FRAMES, 3)), joints=points[:, :24], keypoints_w=points,
        confidence=np.ones((FRAMES, 29)), contact=np.ones((FRAMES, 4), int),
        valid=np.ones(FRAMES, bool), betas=np.zeros(10), rest_joints=REST_JOINTS,
    )  # fmt: skip
    found = np.random.default_rng(0).uniform(0.3, 0.7, (FRAMES, 33, 3))
    LandmarkTrack(FPS, 96, 64, found, found, np.ones((FRAMES, 33))).save(
        place / "landmarks.parquet"
    )
    sequence.save(place / "smpl.parquet")
    reference.save(place / "reference.parquet")
    Rollout(reference.dt, np.asarray(reference.qpos[:STEPS])).save(place / "rollout.parquet")
    pictures = [np.full((64, 1280, 3), 8 * k, np.uint8) for k in range(FRAMES)]
    write_video(pictures, int(FPS), place / "dance.mp4")
    return place


@pytest.mark.parametrize("options", [(), ("--to", "gif", "-o", "x.gif")])
@pytest.mark.parametrize("table", ["landmarks", "rollout"])
def test_a_table_is_refused_with_what_to_do(
    table: str, options: tuple[str, ...], folder: Path, tmp_path: Path
) -> None:
    words = [tmp_path / word if word == "x.gif" else word for word in options]
    answer = in_process("view", folder / f"{table}.parquet", *words)
    assert answer.code == 1
    assert f"{table}.parquet: no " in answer.err
    assert "name the folder of its run" in answer.err


@pytest.mark.parametrize("kind", ["gif", "webp"])
def test_a_film_becomes_a_picture_that_moves(kind: str, folder: Path, tmp_path: Path) -> None:
    out = tmp_path / f"dance.{kind}"
    assert in_process("view", folder, "--to", kind, "-o", out).code == 0
    with Image.open(out) as image:
        assert (image.format, image.width) == (kind.upper(), 640)
        assert image.n_frames == FRAMES / 3
        assert image.info.get("loop") == 0


@pytest.mark.parametrize("to", ["gif", "rerun"])
def test_a_pipe_in_the_place_of_a_result_stays_one(to: str, folder: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    result = in_process("view", folder, "--to", to, "-o", tmp_path / "pipe")
    assert (result.code, "a device or a pipe" in result.err) == (1, True)
    assert (tmp_path / "pipe").is_fifo()
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]


def test_a_film_is_not_replaced_by_its_own_picture(folder: Path, tmp_path: Path) -> None:
    film = tmp_path / "a.mp4"
    shutil.copy(folder / "dance.mp4", film)
    result = in_process("view", film, "--to", "gif", "-o", film)
    assert (result.code, film.read_bytes()) == (1, (folder / "dance.mp4").read_bytes())
    assert "a folder" in in_process("view", film, "--to", "gif", "-o", tmp_path).err


def test_a_picture_of_an_upright_film_is_as_high_as_one_of_a_wide_film_is_wide(
    tmp_path: Path,
) -> None:
    upright = [np.full((1280, 720, 3), 8 * k, np.uint8) for k in range(6)]
    film = write_video(upright, int(FPS), tmp_path / "dance.mp4")
    with Image.open(write_animation(film, tmp_path / "dance.gif", "gif")) as image:
        assert image.size == (360, 640)


def test_a_run_becomes_a_recording_for_rerun(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "dance.rrd"
    assert in_process("view", folder, "--to", "rerun", "-o", out).code == 0
    words = [sys.executable, "-m", "rerun", "rrd", "print", str(out)]
    output = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    paths = set(re.findall(r" - (/\S+) - data columns", output))
    for expected in ("/video", "/landmarks", "/person/bones", "/robot/torso", "/robot/torso/0"):
        assert expected in paths
    assert {"/contacts/left_heel", "/rewards/sum", "/errors/head"} <= paths


def test_a_perfect_dance_earns_more_than_a_late_one(folder: Path) -> None:
    run = read_run(folder)
    late = replace(run, rollout=np.roll(run.rollout, 15, axis=0))
    perfect, worse = (rewards(each) for each in (run, late))
    assert len(perfect) > 3
    assert perfect["sum"][1:].mean() > 1.2 * worse["sum"][20:].mean()


def test_a_run_becomes_one_gltf_of_dancer_reference_and_robot(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "dance.glb"
    assert in_process("view", folder, "--to", "gltf", "-o", out).code == 0
    data = out.read_bytes()
    length = int.from_bytes(data[12:16], "little")
    names = {node["name"] for node in json.loads(data[20 : 20 + length])["nodes"]}
    assert {"person body", "reference torso", "robot torso", "left_wrist"} <= names
    assert data[:4] == b"glTF"


def test_a_trackers_folder_is_a_run_as_well(folder: Path, tmp_path: Path) -> None:
    for name in ("landmarks.parquet", "smpl.parquet", "reference.parquet"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    (tmp_path / "tracker_rollout.parquet").write_bytes((folder / "rollout.parquet").read_bytes())
    assert len(read_run(tmp_path).rollout) == STEPS
    assert read_run(tmp_path).robot.model.nq == load_robot("humanoid").model.nq


def test_a_run_of_more_than_a_minute_is_whole(folder: Path, tmp_path: Path) -> None:
    for name in ("landmarks.parquet", "smpl.parquet", "reference.parquet"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    reference = ReferenceMotion.load(REFERENCE)
    steps = round(61.0 / reference.dt)
    qpos = np.resize(np.asarray(reference.qpos), (steps, reference.qpos.shape[1]))
    Rollout(reference.dt, qpos).save(tmp_path / "rollout.parquet")
    shown = read_run(tmp_path).shown
    assert shown.when.rollout[-1] == pytest.approx(steps - 1, abs=1 / (FPS * reference.dt))


def test_another_folder_is_refused_in_one_line(tmp_path: Path) -> None:
    result = in_process("view", tmp_path, "--to", "gltf", "-o", tmp_path / "x.glb")
    assert (result.code != 0, "not the folder of a run" in result.err) == (True, True)
    assert "name it with -o FILE" in in_process("view", tmp_path, "--to", "gif").err


def test_a_file_to_write_needs_a_format(tmp_path: Path) -> None:
    done = in_process("view", str(tmp_path), "-o", str(tmp_path / "film.gif"))
    assert "needs --to: gif, webp, rerun, gltf" in done.err
