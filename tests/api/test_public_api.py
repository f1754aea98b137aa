"""The public functions: light to import, from file, array or value, saved and shown."""

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robojackson as rj
from robojackson.clips.video import read_frames
from robojackson.errors import BadConfiguration, BadTable, RejectedReference, StoreError
from robojackson.motion.rollout import Rollout
from robojackson.pipeline.bundled_clips import bundled
from robojackson.rl.config.evaluate_config import EvaluateConfig
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.policy import load_policy

pytestmark = pytest.mark.xdist_group("api")

CLIP = bundled("hip_shake.mp4")
NO_LIBRARY = """
import sys
import robojackson as rj
assert len(dir(rj)) > 20
heavy = {"numpy", "torch", "mujoco", "mediapipe", "prefect", "pydantic", "pyarrow"}
print(sorted(heavy & set(sys.modules)))
"""
FUNCTIONS = (
    "probe_video", "detect_landmarks", "recover_motion", "retarget_motion", "load_robot",
    "train_policy", "evaluate_policy", "render_video", "read_motion", "write_motion",
)  # fmt: skip
TQC = {"n_envs": 8, "warmup": 100, "steps_per_round": 8, "updates_per_round": 2, "actor": [16, 16],
       "critic": [16, 16]}  # fmt: skip


@pytest.fixture(scope="module")
def track() -> rj.LandmarkTrack:
    return rj.detect_landmarks(CLIP, quality="lite")


@pytest.fixture(scope="module")
def motion(track: rj.LandmarkTrack) -> rj.SmplSequence:
    return rj.recover_motion(track)


@pytest.fixture(scope="module")
def reference(motion: rj.SmplSequence) -> rj.ReferenceMotion:
    return rj.retarget_motion(motion)


@pytest.fixture(scope="module")
def config() -> TrainConfig:
    return TrainConfig(trainer="sb3", steps=1200, tqc=TQC)  # type: ignore[arg-type]


def paid(state: rj.RewardState) -> np.ndarray:
    """Return a reward term of a user."""
    return np.full(len(state.qpos), 0.5)


def test_importing_it_loads_no_library() -> None:
    done = subprocess.run([sys.executable, "-c", NO_LIBRARY], capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_has_a_docstring_with_its_results_and_errors(name: str) -> None:
    result = getattr(rj, name).__doc__
    assert name in rj.__all__
    assert "Args:" in result
    assert "Returns:" in result
    assert "Raises:" in result


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'recover'"):
        rj.recover  # noqa: B018


def test_a_video_is_probed_and_its_figures_saved(tmp_path: Path) -> None:
    info = rj.probe_video(str(CLIP))
    assert (info.width, info.height, info.frames) == (640, 480, 120)
    assert json.loads(info.save(tmp_path / "info.json").read_text())["fps"] == info.fps


@pytest.mark.medium
def test_frames_of_an_array_give_the_landmarks_of_the_file(track: rj.LandmarkTrack) -> None:
    frames = np.stack(list(read_frames(CLIP)))
    counted: list[tuple[int, int]] = []
    seen = rj.detect_landmarks(
        frames, fps=30.0, quality="lite", progress=lambda done, total: counted.append((done, total))
    )
    assert np.abs(seen.landmarks - track.landmarks).max() < 1e-6
    assert counted[-1] == (120, 120)


@pytest.mark.parametrize(
    ("frames", "fps"),
    [
        (np.zeros((4, 8, 8, 3), np.uint8), None),
        (np.zeros((4, 8, 8, 3), np.uint8), float("nan")),
        (np.zeros((4, 8, 8), np.uint8), 30.0),
        (np.zeros((4, 8, 8, 3)), 30.0),
    ],
)
def test_an_array_that_is_no_video_is_refused(frames: np.ndarray, fps: float | None) -> None:
    with pytest.raises(BadConfiguration):
        rj.detect_landmarks(frames, fps=fps)


@pytest.mark.medium
def test_a_table_is_saved_and_loaded(
    track: rj.LandmarkTrack, motion: rj.SmplSequence, tmp_path: Path
) -> None:
    loaded = rj.LandmarkTrack.load(track.save(tmp_path / "new" / "landmarks.parquet"))
    assert np.array_equal(rj.recover_motion(loaded).joints.shape, motion.joints.shape)
    from_file = rj.recover_motion(tmp_path / "new" / "landmarks.parquet")
    assert np.abs(from_file.joints - motion.joints).max() < 1e-3


@pytest.mark.medium
def test_a_table_of_another_kind_is_refused(track: rj.LandmarkTrack, tmp_path: Path) -> None:
    path = track.save(tmp_path / "landmarks.parquet")
    with pytest.raises(BadTable, match="holds a LandmarkTrack"):
        rj.SmplSequence.load(path)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="nobody"):
        rj.read_motion(tmp_path / "nobody.parquet")


@pytest.mark.medium
@pytest.mark.parametrize("name", ["motion.bvh", "motion.npz", "motion.parquet"])
def test_a_human_motion_is_written_and_read(
    name: str, motion: rj.SmplSequence, tmp_path: Path
) -> None:
    to = "amass" if name.endswith(".npz") else None
    read = rj.read_motion(rj.write_motion(motion, tmp_path / name, to))
    assert isinstance(read, rj.SmplSequence)
    hips = read.joints[:, 0] - read.joints[0, 0]
    assert np.abs(hips - (motion.joints[:, 0] - motion.joints[0, 0])).max() < 0.01


@pytest.mark.medium
def test_a_robots_motion_is_written_and_read(reference: rj.ReferenceMotion, tmp_path: Path) -> None:
    path = reference.save(tmp_path / "reference.parquet")
    assert np.array_equal(rj.read_motion(path).qpos, reference.qpos)  # type: ignore[union-attr]
    assert rj.write_motion(path, tmp_path / "robot.csv").stat().st_size > 1000


def test_a_robot_is_saved_as_a_model_that_mujoco_loads(tmp_path: Path) -> None:
    import mujoco

    robot = rj.load_robot("humanoid")
    path = robot.save(tmp_path / "humanoid.mjb")
    assert mujoco.MjModel.from_binary_path(str(path)).nq == robot.model.nq


def test_a_robot_comes_from_a_file_of_ones_own(tmp_path: Path) -> None:
    from robojackson.pipeline.configuration_files import SHIPPED

    text = (SHIPPED / "robots" / "humanoid.yaml").read_text()
    (tmp_path / "mine.yaml").write_text(text.replace("name: humanoid", "name: mine"))
    assert rj.load_robot(tmp_path / "mine.yaml").description.name == "mine"


@pytest.mark.slow
def test_a_reward_of_ones_own_is_in_the_table_and_the_policy_is_saved(
    reference: rj.ReferenceMotion, config: TrainConfig, tmp_path: Path
) -> None:
    rows: list[dict[str, float]] = []
    trained = rj.train_policy(reference, config=config, reward=paid, progress=rows.append)
    assert trained.episodes
    for row in trained.episodes:
        assert row["reward_own"] == pytest.approx(0.5 * row["episode_length"])
    folder = trained.save(tmp_path / "run")
    assert load_policy(folder / "policy.safetensors").action_size == 17
    short = EvaluateConfig(0.5, phases=2, resets=1)
    again = rj.evaluate_policy(folder / "policy.safetensors", reference, config=short)
    assert again.summary["rollouts"] == 3.0
    same = rj.evaluate_policy(trained, reference, config=short)
    assert str(same.summary) == str(again.summary)  # NaN among them equals nothing
    assert {path.name for path in again.save(tmp_path / "evaluated").iterdir()} == {
        "evaluation.json", "evaluations.parquet", "rollout.parquet",
    }  # fmt: skip


@pytest.mark.parametrize("wrong", [{"steps": 0}, {"seed": -1}, {"minutes": -2.0}])
def test_a_budget_or_seed_that_cannot_be_is_named_in_one_line(
    wrong: dict[str, Any], reference: rj.ReferenceMotion
) -> None:
    (name,) = wrong
    with pytest.raises(BadConfiguration, match=f"^train_policy: '{name}' is {wrong[name]}: .*than"):
        rj.train_policy(reference, **wrong)


def test_what_is_no_policy_is_named(reference: rj.ReferenceMotion) -> None:
    with pytest.raises(TypeError, match="policy is 5: expected a policy, its file or a tracker"):
        rj.evaluate_policy(5, reference)  # type: ignore[arg-type]


def test_a_video_that_is_given_as_a_motion_is_named_with_the_remedy() -> None:
    with pytest.raises(BadTable, match=r"hip_shake\.mp4: a video; `robojackson mocap` recovers"):
        rj.retarget_motion(CLIP)


@pytest.mark.slow
def test_the_same_call_resumes(
    reference: rj.ReferenceMotion, config: TrainConfig, tmp_path: Path
) -> None:
    first = rj.train_policy(reference, config=config, out=tmp_path)
    more = rj.train_policy(reference, config=config, steps=1600, out=tmp_path)
    assert more.steps > first.steps
    assert len(more.episodes) > len(first.episodes) > 0
    for row, kept in zip(first.episodes, more.episodes, strict=False):
        assert {name: kept[name] for name in row} == row


@pytest.mark.medium
@pytest.mark.parametrize(
    "wrong", [lambda state: 1.0, lambda state: np.full(len(state.qpos), np.nan)]
)
def test_a_reward_that_is_no_number_a_robot_is_refused(
    wrong: object, reference: rj.ReferenceMotion, config: TrainConfig
) -> None:
    with pytest.raises(BadConfiguration, match="reward 'wrong'"):
        rj.train_policy(reference, config=config, reward={"wrong": wrong})  # type: ignore[dict-item]


@pytest.mark.medium
def test_a_motion_that_the_gate_refuses_is_not_trained(
    reference: rj.ReferenceMotion, config: TrainConfig
) -> None:
    bad = replace(reference, scorecard={**reference.scorecard, "limit_violations": 3.0})
    with pytest.raises(RejectedReference, match="limit_violations"):
        rj.train_policy(bad, config=config)


@pytest.mark.slow
def test_a_video_has_a_panel_for_what_is_given(
    reference: rj.ReferenceMotion, motion: rj.SmplSequence, track: rj.LandmarkTrack, tmp_path: Path
) -> None:
    from robojackson.report.video.side_by_side import VideoConfig

    small = VideoConfig(fps=5, panel_width=64, panel_height=96, max_seconds=0.4)
    alone = rj.render_video(tmp_path / "one.mp4", reference, config=small)
    assert (alone.width, alone.height) == (64, 96)
    whole = rj.render_video(
        tmp_path / "four.mp4", reference, rollout=reference.qpos, motion=motion, video=CLIP,
        landmarks=track, config=small,
    )  # fmt: skip
    assert whole.width >= 4 * 64
    with pytest.raises(BadConfiguration, match="both or neither"):
        rj.render_video(tmp_path / "x.mp4", reference, video=CLIP)


@pytest.mark.medium
@pytest.mark.parametrize("name", ["track", "motion", "reference"])
def test_a_repr_is_one_line(name: str, request: pytest.FixtureRequest) -> None:
    result = repr(request.getfixturevalue(name))
    assert len(result) < 140
    assert "\n" not in result
    assert "array" not in result


@pytest.mark.parametrize(
    ("function", "what"),
    [
        (rj.recover_motion, "the video is None: expected a file"),
        (rj.read_motion, "the motion is None: expected a file"),
        (rj.retarget_motion, "the motion is None: expected a file"),
        (rj.train_policy, "the motion is None: expected a file or ReferenceMotion"),
        (rj.load_robot, "the robot is None: expected a file, a name or a robot"),
    ],
)
def test_what_is_no_argument_at_all_is_named(function: Callable[[Any], Any], what: str) -> None:
    with pytest.raises(TypeError, match=what):
        function(None)


@pytest.mark.parametrize(
    ("reward", "message"),
    [
        ({"joints": len}, "'joints' is the name of a configured term"),
        ({"mine": 3}, "expected a function"),
    ],
)
def test_a_reward_has_a_name_of_its_own_and_is_a_function(
    reward: dict, message: str, reference: rj.ReferenceMotion, config: TrainConfig
) -> None:
    with pytest.raises(BadConfiguration, match=message):
        rj.train_policy(reference, config=config, reward=reward)


def test_a_rollout_of_another_robot_is_refused_before_anything_is_drawn(
    tmp_path: Path, reference: rj.ReferenceMotion
) -> None:
    path = Rollout(reference.dt, np.zeros((5, 30))).save(tmp_path / "rollout.parquet")
    with pytest.raises(BadConfiguration, match=r"shape \(5, 30\); humanoid needs \(steps, 24\)"):
        rj.render_video(tmp_path / "film.mp4", reference, rollout=path)


def test_our_own_tables_take_no_frame_rate(tmp_path: Path, reference: rj.ReferenceMotion) -> None:
    path = reference.save(tmp_path / "reference.parquet")
    with pytest.raises(BadConfiguration, match="have their own fps and axes"):
        rj.read_motion(path, fps=12)
