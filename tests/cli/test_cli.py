"""Bad input gets one line and a code; the answer on stdout stands alone."""

import json
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

from robojackson.cli import scoring
from robojackson.cli.console import lines, to_json_types
from robojackson.errors import TruncatedVideo
from tests.fixtures.commands import ROOT, environment, in_process, robojackson

HIPS = ROOT / "clips" / "hip_shake.mp4"
COMMANDS = ["dance", "score", "mocap", "retarget", "train", "evaluate", "doctor"]


def invoke(*words: object) -> tuple[int, str, str]:
    result = in_process(*words)
    return result.code, result.out, result.err


def write_video(path: Path, frames: int) -> Path:
    """Write grey frames without a person."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=10)
        stream.width, stream.height, stream.pix_fmt = 64, 64, "yuv420p"
        grey = np.full((64, 64, 3), 128, np.uint8)
        for _ in range(frames):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(grey)))
        container.mux(stream.encode(None))
    return path


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str) -> None:
    assert invoke(command, "--help")[0] == 0


def text_as_video(folder: Path) -> list[object]:
    (folder / "notes.mp4").write_text("this is not a video\n")
    return ["score", folder / "notes.mp4"]


def half_a_video(folder: Path) -> list[object]:
    whole = (ROOT / "clips" / "hip_shake.mp4").read_bytes()
    (folder / "half.mp4").write_bytes(whole[: len(whole) // 2])
    return ["mocap", folder / "half.mp4", "-o", folder / "out"]


def no_person(folder: Path) -> list[object]:
    return ["mocap", write_video(folder / "empty.mp4", 5), "-o", folder / "out"]


def one_frame(folder: Path) -> list[object]:
    return ["mocap", write_video(folder / "one.mp4", 1), "-o", folder / "out"]


def unknown_robot(folder: Path) -> list[object]:
    return ["retarget", folder / "smpl.parquet", "-o", folder / "out", "--robot", "c3po"]


def unknown_robot_in_set(folder: Path) -> list[object]:
    return ["retarget", folder / "smpl.parquet", "-o", folder / "out", "--set", "robot=c3po"]


def unknown_robot_in_yaml(folder: Path) -> list[object]:
    (folder / "mine.yaml").write_text("robot: c3po\n")
    words = ["retarget", folder / "smpl.parquet", "-o", folder / "out"]
    return [*words, "--config", folder / "mine.yaml"]


def typo_in_yaml(folder: Path) -> list[object]:
    (folder / "mine.yaml").write_text("mocap: {cutof_hz: 5}\n")
    clip = ROOT / "clips" / "hip_shake.mp4"
    return ["mocap", clip, "-o", folder / "out", "--config", folder / "mine.yaml"]


def foreign_table(folder: Path) -> list[object]:
    (folder / "smpl.parquet").write_text("frame,joint\n")
    return ["retarget", folder / "smpl.parquet", "-o", folder / "out"]


def video_as_table(folder: Path) -> list[object]:
    return ["train", write_video(folder / "clip.mp4", 5), "-o", folder / "out", "--steps", "10"]


def video_as_motion_file(folder: Path) -> list[object]:
    return ["import", write_video(folder / "clip.mp4", 5), "-o", folder / "out"]


def video_to_export(folder: Path) -> list[object]:
    clip = write_video(folder / "clip.mp4", 5)
    return ["export", clip.rename(folder / "clip.parquet"), "--to", "bvh", "-o", folder / "x.bvh"]


def missing_table(folder: Path) -> list[object]:
    return ["train", folder / "reference.parquet", "-o", folder / "out", "--steps", "10"]


def folder_as_table(folder: Path) -> list[object]:
    return ["train", folder, "-o", folder / "out", "--steps", "10"]


def missing_file(folder: Path) -> list[object]:
    return ["dance", folder / "gone.mp4"]


@pytest.mark.medium
@pytest.mark.parametrize(
    ("make", "message"),
    [
        (text_as_video, "UnreadableVideo"),
        (half_a_video, "TruncatedVideo"),
        (no_person, "NoPersonFound"),
        (one_frame, "TrackTooShort"),
        (unknown_robot, "unknown robot 'c3po'"),
        (unknown_robot_in_set, "unknown robot 'c3po'"),
        (unknown_robot_in_yaml, "unknown robot 'c3po'"),
        (typo_in_yaml, "mine.yaml: unknown key 'mocap.cutof_hz'. Did you mean 'cutoff_hz'?"),
        (foreign_table, "smpl.parquet: not a Parquet file"),
        (video_as_table, "clip.mp4: a video; `robojackson mocap` recovers its dancer's motion"),
        (video_as_motion_file, "clip.mp4: a video; `robojackson mocap` recovers"),
        (video_to_export, "clip.parquet: a video; `robojackson mocap` recovers"),
        (missing_table, "reference.parquet: no such file"),
        (folder_as_table, ": a folder, not a file"),
        (missing_file, "gone.mp4: no such file"),
    ],
)
def test_bad_input_gets_one_line_and_no_answer(make, message: str, tmp_path: Path) -> None:
    code, out, err = invoke(*make(tmp_path), "--json")
    result = [line for line in err.splitlines() if line.startswith("robojackson: ")]
    assert (code, out, len(result)) == (1, "", 1)
    assert message in result[0]
    assert "Traceback" not in err


def test_a_clip_without_a_person_has_a_score(tmp_path: Path) -> None:
    code, out, _ = invoke("score", write_video(tmp_path / "empty.mp4", 5), "--json")
    scored = json.loads(out)["videos"][0]
    assert (code, scored["missing_joints"], scored["note"]) == (
        0,
        33 * 5,
        "no person found in 5 of 5 frames",
    )


def test_a_video_that_breaks_off_while_it_is_looked_at_loses_no_other_score(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_process = scoring.in_video_process

    def breaks_off(function: Any, video: Path, *rest: Any, **more: Any) -> Any:
        if video.name == "b.mp4":
            raise TruncatedVideo(f"{video}: damaged")
        return in_process(function, video, *rest, **more)

    monkeypatch.setattr(scoring, "in_video_process", breaks_off)
    clips = [write_video(tmp_path / name, 5) for name in ("a.mp4", "b.mp4", "c.mp4")]
    code, out, _ = invoke("score", *clips, "--json")
    answer = [set(video) & {"error", "stability_score"} for video in json.loads(out)["videos"]]
    assert (code, answer) == (1, [{"stability_score"}, {"stability_score"}, {"error"}])
    code, _, err = invoke("score", clips[1])
    assert (code, err.splitlines()[-1]) == (
        1,
        f"robojackson: TruncatedVideo: {clips[1]}: damaged",
    )


@pytest.mark.medium
@pytest.mark.parametrize(
    ("where", "reason"),
    [
        (">/dev/full", "the answer cannot be written to stdout: No space left on device"),
        (">&-", "stdout is closed: there is nowhere to write the answer"),
    ],
)
def test_an_answer_that_cannot_be_written_is_one_line(where: str, reason: str) -> None:
    command = f"{shlex.quote(sys.executable)} -m robojackson robots --json {where}"
    done = subprocess.run(
        command, shell=True, cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (1, f"robojackson: StoreError: {reason}\n")


def test_a_readable_video_is_scored_beside_one_that_is_not(tmp_path: Path) -> None:
    (tmp_path / "more").mkdir()
    write_video(tmp_path / "more" / "empty.mp4", 5)
    (tmp_path / "notes.mp4").write_text("this is not a video")
    code, out, _ = invoke("score", tmp_path / "notes.mp4", tmp_path / "more", "--json")
    answer = [set(video) & {"error", "stability_score"} for video in json.loads(out)["videos"]]
    assert (code, answer) == (1, [{"stability_score"}, {"error"}])


def test_only_a_video_that_is_named_must_be_readable(tmp_path: Path) -> None:
    write_video(tmp_path / "empty.mp4", 5)
    (tmp_path / "notes.mp4").write_text("this is not a video")
    code, out, _ = invoke("score", tmp_path, "--json")
    answer = [set(video) & {"error", "stability_score"} for video in json.loads(out)["videos"]]
    assert (code, answer) == (0, [{"stability_score"}, {"error"}])


@pytest.mark.parametrize("make", [no_person, one_frame, unknown_robot])
def test_a_command_that_failed_leaves_no_folder(make, tmp_path: Path) -> None:
    invoke(*make(tmp_path))
    assert not (tmp_path / "out").exists()


def test_what_is_said_of_a_clip_without_a_person_names_it(tmp_path: Path) -> None:
    assert f"{tmp_path / 'empty.mp4'}: no person found" in invoke(*no_person(tmp_path))[2]


def test_a_folder_is_not_one_video(tmp_path: Path) -> None:
    assert "a folder, expected one video" in invoke("mocap", tmp_path, "-o", tmp_path / "out")[2]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["notes.mp4"], "notes.mp4: not a video"),
        (["."], "notes.mp4: not a video"),
        ([HIPS, "--robot", "nao"], "unknown robot 'nao'"),
        ([HIPS, "--set", "train.sede=3"], "--set train.sede: unknown key"),
        ([HIPS, "--start", "1", "--end", "0"], "no range from 1 s to 0 s"),
    ],
)
def test_dance_refuses_bad_input_before_prefect_starts(
    words: list[object], message: str, monkeypatch, tmp_path: Path
) -> None:
    (tmp_path / "notes.mp4").write_text("this is not a video")
    monkeypatch.chdir(tmp_path)
    code, _, err = invoke("dance", *words)
    assert (code, len(err.splitlines())) == (1, 1)
    assert message in err
    assert not (tmp_path / "store").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("find nosuchfolder --source folder", "nosuchfolder: no such file or folder"),
        ("find nosuch.txt --source urls", "nosuch.txt: no such file"),
        ("find x --set bogus.key=3", "--set bogus.key: unknown key"),
        ("find x --config nosuch", "unknown configuration 'nosuch'"),
        ("find x --source nosuch", "unknown source 'nosuch'"),
        ("find ''", "the query is empty"),
        ("find '' --source urls", "the query is empty"),
        ("refresh nosuch", "unknown dance 'nosuch'"),
        ("refresh --set bogus.key=3", "--set bogus.key: unknown key"),
        ("ablation nosuch", "unknown study 'nosuch'"),
        ("ablation smoke --move nosuch", "unknown move 'nosuch'"),
        ("ablation smoke --setup nosuch", "'setups.0' is 'nosuch'"),
        ("ablation smoke --set robot=nosuch", "unknown robot 'nosuch'"),
        ("ablation smoke --set pipeline=nosuch", "unknown configuration 'nosuch'"),
        ("ablation smoke --set train.sede=3", "unknown key 'sede'"),
    ],
)
def test_a_flow_refuses_simple_mistakes_before_prefect_starts(
    words: str, message: str, monkeypatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    code, _, err = invoke(*shlex.split(words))
    assert (code, len(err.splitlines())) == (1, 1)
    assert message in err
    assert not (tmp_path / "store").exists()


def test_a_full_store_is_reported_before_any_work(monkeypatch, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "file" / "store"))
    code, _, err = invoke("dance", ROOT / "clips" / "hip_shake.mp4")
    assert code == 1
    assert "cannot write the store" in err


def test_results_where_nothing_can_be_written_name_the_folder_and_no_store() -> None:
    code, _, err = invoke("mocap", ROOT / "clips" / "hip_shake.mp4", "-o", "/proc/results")
    assert code == 1
    assert "StoreError: cannot write the folder /proc: " in err


def test_an_empty_question_is_refused() -> None:
    code, _, err = invoke("metrics", "--sql", "")
    assert (code, "there is no query in the text" in err) == (1, True)


def test_an_override_without_a_value_is_refused() -> None:
    assert "expected KEY=VALUE" in invoke("score", "x.mp4", "--set", "train.seed")[2]


@pytest.mark.medium
def test_doctor_reports_what_is_installed_in_one_object() -> None:
    result = robojackson("doctor", "--json")
    assert {"ok", "packages", "libraries", "models", "missing", "optional"} == set(
        result.answer
    ) - {
        "python",
        "python_supported",
        "javascript",
    }
    assert not result.loaded_prefect


def test_what_a_library_prints_does_not_stand_beside_the_answer(tmp_path: Path) -> None:
    code = (
        "import os, sys\n"
        "from robojackson.cli import console\n"
        "@console.command\n"
        "def noisy(as_json=False):\n"
        "    print('chatter'); os.write(1, b'C++ chatter')\n"
        "    return console.CommandResult({'x': float('nan')})\n"
        "noisy(as_json=True)\n"
    )
    run = [sys.executable, "-c", code]
    done = subprocess.run(run, capture_output=True, text=True, env=environment(), check=True)
    assert done.stdout == '{"x": null}\n'


def test_an_answer_for_people_has_one_line_a_figure() -> None:
    data = to_json_types(
        {"skill": 0.123456, "baselines": {"statue": {"skill": None}}, "names": ["a", "b"]}
    )
    assert list(lines(data)) == [
        "skill      0.1235",
        "baselines",
        "  statue",
        "    skill  -",
        "names      a, b",
    ]


@pytest.mark.slow
@pytest.mark.heavy
def test_ctrl_c_in_training_is_resumed_by_the_same_command(tmp_path: Path, short_clip) -> None:
    robojackson("mocap", short_clip, "-o", tmp_path)
    robojackson("retarget", tmp_path / "smpl.parquet", "-o", tmp_path, "--config", "smoke")
    words = [
        *("train", str(tmp_path / "reference.parquet"), "-o", str(tmp_path / "run")),
        *("--trainer=sb3", "--set=tqc.n_envs=4", "--set=tqc.warmup=100", "--set=tqc.batch=32"),
        *("--set=progress_seconds=0.2", "--json"),
    ]
    command = [sys.executable, "-m", "robojackson", *words, "--steps=1000000"]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment()
    ) as process:
        assert process.stderr is not None
        audit, progress = process.stderr.readline(), process.stderr.readline()
        process.send_signal(signal.SIGINT)
        rest = process.stderr.read()
    assert "of a perfect dance" in audit
    assert "steps" in progress
    assert "stopping after this round" in rest
    assert (process.returncode, rest.count("resume: robojackson train")) == (130, 1)
    first = int(progress.split()[0].replace(",", ""))
    again = robojackson(*words, f"--steps={first + 200}")
    assert again.code == 0
    assert "resuming at" in again.err
