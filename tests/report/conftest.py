"""A tiny run: 12 frames of a person who waves, a cyclic reference and a rollout of the humanoid."""

from dataclasses import replace
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
import pytest

from robojackson.body.skeleton import REST_JOINTS
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video.encoder import write_video

FRAMES, FPS, STEPS, DT = 12, 30.0, 27, 0.015
SIZE = (96, 64)


def with_stands(motion: ReferenceMotion, before: int = 40, after: int = 60) -> ReferenceMotion:
    """Return a motion that stands in its first pose for some steps before the clip and after it."""
    step = np.r_[np.zeros(before, int), np.arange(len(motion)), np.zeros(after, int)]
    times = np.pad(np.asarray(motion.source_time_s), (before, after), mode="edge")
    rows = ("qpos", "qvel", "body_pos_w", "keypoints_w", "contact", "torque_ratio")
    return replace(
        motion,
        **{name: np.asarray(getattr(motion, name))[step] for name in rows},
        cyclic=False,
        cycle_offset=np.zeros(3),
        source_time_s=times,
    )


@pytest.fixture(scope="session")
def model() -> mujoco.MjModel:
    folder = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"
    return mujoco.MjModel.from_xml_path(str(folder / "humanoid.xml"))


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    pictures = [np.full((SIZE[1], SIZE[0], 3), 20 * k, np.uint8) for k in range(FRAMES)]
    return write_video(pictures, int(FPS), tmp_path / "clip.mp4")


@pytest.fixture
def track() -> LandmarkTrack:
    rng = np.random.default_rng(1)
    landmarks = rng.uniform(0.3, 0.7, (FRAMES, 33, 3))
    return LandmarkTrack(FPS, *SIZE, landmarks, landmarks, np.ones((FRAMES, 33)))


@pytest.fixture
def sequence() -> SmplSequence:
    standing = REST_JOINTS[:, [2, 0, 1]] + [0.0, 0.0, 1.0]
    points = np.tile(standing, (FRAMES, 1, 1))
    return SmplSequence(
        fps=FPS,
        global_orient=np.zeros((FRAMES, 3)),
        body_pose=np.zeros((FRAMES, 69)),
        transl=np.zeros((FRAMES, 3)),
        joints=points[:, :24],
        keypoints_w=points,
        confidence=np.ones((FRAMES, 29)),
        contact=np.ones((FRAMES, 4), int),
        valid=np.ones(FRAMES, bool),
        betas=np.zeros(10),
        rest_joints=REST_JOINTS,
        notes=("the camera moves",),
    )


@pytest.fixture
def reference(model: mujoco.MjModel) -> ReferenceMotion:
    qpos = np.tile(model.qpos0, (STEPS, 1))
    qpos[:, 7:] += 0.2 * np.sin(2 * np.pi * np.arange(STEPS) / STEPS)[:, None]
    joints = tuple(model.joint(i).name for i in range(1, model.njnt))
    return ReferenceMotion(
        robot="humanoid",
        model_sha256="0" * 64,
        dt=DT,
        cyclic=True,
        cycle_offset=np.array([0.5, 0.0, 0.0]),
        qpos=qpos,
        qvel=np.zeros((STEPS, model.nv)),
        body_pos_w=np.zeros((STEPS, model.nbody - 1, 3)),
        keypoints_w=np.zeros((STEPS, 14, 3)),
        contact=np.ones((STEPS, 2), int),
        torque_ratio=np.zeros((STEPS, model.nu)),
        source_time_s=np.arange(STEPS) * DT,
        joint_names=joints,
        body_names=tuple(model.body(i).name for i in range(1, model.nbody)),
        keypoint_names=tuple(f"point_{i}" for i in range(14)),
        contact_names=("left_foot", "right_foot"),
        scorecard={"keypoint_mm": 7.25, "limit_violations": 0.0, "cyclic": 1.0},
    )
