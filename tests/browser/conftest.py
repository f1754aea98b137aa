"""A page and a live dance of the humanoid, and Debian's chromium that opens them from disk."""

import shutil
import subprocess
import tarfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np
import pytest

from robojackson.api.robots import load_robot
from robojackson.body.skeleton import REST_JOINTS
from robojackson.clips.sound import RATE, Sound
from robojackson.clips.video import VideoLimits, probe
from robojackson.metrics.rollout_score import heading_frame, site_error
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.pages.live_page import live_page
from robojackson.report.pages.page_content import Results, page_content
from robojackson.report.pages.run_page import render
from robojackson.report.video.encoder import write_video
from robojackson.report.video.film import VideoConfig
from robojackson.report.web.shown_run import RecordedRun, shown_run
from robojackson.rl.config.track_config import ControlConfig
from robojackson.rl.evaluation.rollouts import Rollouts
from robojackson.rl.policy import Policy
from robojackson.rl.sim.simulation import resolved
from robojackson.robot.model import Robot
from robojackson.robot.names import PELVIS

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

FRAMES, FPS, STEPS = 60, 30.0, 128
SIZE = 96, 64
LEVEL, CYCLE = 30, 7
"""Grey of the clip's first picture and by how much the next is brighter, until it starts again."""
FALLEN = 50
"""Picture at which the rollout of a page ends."""
LYING = np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0
"""Quaternion wxyz of a body that lies on its face."""
TITLE = "<script>alert(1)</script> \u202emosnart"
WITHOUT_3D = """(() => { const whole = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
    return kind.startsWith('webgl') ? null : whole.call(this, kind, ...more); }; })()"""
"""A script by which a browser draws no 3D."""
ARGUMENTS = [
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--autoplay-policy=no-user-gesture-required",
]


@dataclass
class Opened:
    """A page with its requests and messages."""

    page: "Page"
    requests: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)


def standing_reference(robot: Robot) -> ReferenceMotion:
    """Return a cyclic motion in which the arms swing."""
    model, times = robot.model, np.arange(STEPS) / STEPS
    qpos = np.tile(robot.standing, (STEPS, 1))
    arms = [i for i, name in enumerate(robot.joint_names) if "shoulder" in name or "elbow" in name]
    qpos[:, [7 + i for i in arms]] += 0.3 * np.sin(2 * np.pi * times)[:, None]
    data, points, bodies = mujoco.MjData(model), [], []
    for row in qpos:
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        points.append(data.site_xpos[robot.keypoint_sites].copy())
        bodies.append(data.xpos[1:].copy())
    dt = robot.description.control_dt
    qvel = np.zeros((STEPS, model.nv))
    qvel[:, 6:] = np.gradient(qpos[:, 7:], dt, axis=0)
    return ReferenceMotion(
        robot="humanoid", model_sha256=robot.sha256, dt=dt, cyclic=True, cycle_offset=np.zeros(3),
        qpos=qpos, qvel=qvel, body_pos_w=np.array(bodies), keypoints_w=np.array(points),
        contact=np.ones((STEPS, len(robot.contact_names)), int),
        torque_ratio=np.zeros((STEPS, len(robot.joint_names))), source_time_s=np.arange(STEPS) * dt,
        joint_names=robot.joint_names, body_names=robot.body_names,
        keypoint_names=robot.keypoint_names, contact_names=robot.contact_names,
        scorecard={"keypoint_mm": 7.25, "limit_violations": 0.0, "floor_penetration_mm": 6.0},
    )  # fmt: skip


def beside_pelvis(robot: Robot, done: Rollouts) -> np.ndarray:
    """Return the mean site error of each robot after each step, as tables of an evaluation have
    it."""
    pelvis = robot.keypoint_names.index(PELVIS)
    here = heading_frame(done.points, done.qpos[..., 3:7], pelvis)
    return site_error(here, heading_frame(done.target, done.target_qpos[..., 3:7], pelvis))


def made_policy(robot: Robot) -> Policy:
    """Return an untrained network: small random corrections of the reference's angles."""
    from dataclasses import asdict

    from robojackson.rl.modes.observation import Observer

    rng, size = np.random.default_rng(0), Observer(robot, "full").actor_size
    layers = tuple(
        (rng.normal(0, 0.3 / np.sqrt(i), (i, o)).astype(np.float32), np.zeros(o, np.float32))
        for i, o in ((size, 64), (64, robot.model.nu))
    )
    control = asdict(resolved(ControlConfig(), robot))
    return Policy(layers, {"robot": "humanoid", "control": control, "mode": "track"})


@pytest.fixture(scope="session")
def run() -> RecordedRun:
    robot = load_robot("humanoid")
    reference = standing_reference(robot)
    rng = np.random.default_rng(1)
    found = rng.uniform(0.3, 0.7, (FRAMES, 33, 3))
    points = np.tile(REST_JOINTS[:, [2, 0, 1]] + [0.0, 0.0, 1.0], (FRAMES, 1, 1))
    sequence = SmplSequence(
        fps=FPS, global_orient=np.zeros((FRAMES, 3)), body_pose=np.zeros((FRAMES, 69)),
        transl=np.zeros((FRAMES, 3)), joints=points[:, :24], keypoints_w=points,
        confidence=np.ones((FRAMES, 29)), contact=np.ones((FRAMES, 4), int),
        valid=np.arange(FRAMES) > 5, betas=np.zeros(10), rest_joints=REST_JOINTS,
    )  # fmt: skip
    track = LandmarkTrack(FPS, *SIZE, found, found, np.zeros((FRAMES, 33)))
    return RecordedRun(robot, track, sequence, reference, reference.qpos, made_policy(robot))


def page_of(run: RecordedRun, folder: Path) -> Path:
    """Write a page whose clip gets brighter with each frame, so that the grey is its number."""
    pictures = [
        np.full((SIZE[1], SIZE[0], 3), LEVEL + LEVEL * (k % CYCLE), np.uint8) for k in range(FRAMES)
    ]
    hum = np.repeat(0.2 * np.sin(np.arange(2 * RATE) * 0.05)[:, None], 2, 1)
    clip = write_video(pictures, int(FPS), folder / "clip.mp4", sound=Sound(hum))
    shown = shown_run(run, clip, VideoConfig())
    results = Results(
        title=TITLE, info=probe(clip, VideoLimits()), stability=None, sequence=run.sequence,
        reference=run.reference, training={"steps": 5}, episodes=[], evaluations=[],
        evaluation={"success": 1.0, "rollouts": 3.0, "survived_s": 1.9}, player=shown.player,
        film=shown.film, has_sound=shown.has_sound, settings="minutes: 1",
    )  # fmt: skip
    file = folder / "index.html"
    file.write_text(render(page_content(results, "dance.mp4")), encoding="utf-8")
    return file


@pytest.fixture(scope="session")
def page_file(run: RecordedRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return page_of(run, tmp_path_factory.mktemp("page"))


@pytest.fixture(scope="session")
def fallen_page(run: RecordedRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a page whose robot lies on the floor for the last 0.2 s of its rollout."""
    qpos = np.array(run.reference.qpos[: round(FALLEN / FPS / run.reference.dt)])
    lies = round(0.2 / run.reference.dt)
    qpos[-lies:, 2:7] = 0.15, *LYING
    return page_of(replace(run, rollout_qpos=qpos), tmp_path_factory.mktemp("fallen"))


@pytest.fixture(scope="session")
def live_file(run: RecordedRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("live") / "live.html"
    text = live_page(run, TITLE)
    assert text is not None
    file.write_text(text, encoding="utf-8")
    return file


@pytest.fixture(scope="session")
def browser() -> Iterator["Browser"]:
    path = shutil.which("chromium")
    assert path, "apt-get install chromium"
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        yield playwright.chromium.launch(executable_path=path, args=ARGUMENTS)


@pytest.fixture
def opened(browser: "Browser") -> Iterator[Callable[..., Opened]]:
    """Open a file and wait until it can be used; the context is closed after the test.

    `before` is a script that runs ahead of the page's, `options` are of the browser's context.
    """
    contexts = []

    def open_file(
        file: Path, width: int = 1600, scheme: str = "light", before: str = "", **options: object
    ) -> Opened:
        context = browser.new_context(
            viewport={"width": width, "height": 1000}, color_scheme=scheme, **options
        )
        contexts.append(context)
        if before:
            context.add_init_script(before)
        found = Opened(context.new_page())
        found.page.set_default_timeout(180_000)
        found.page.on("request", lambda request: found.requests.append(request.url))
        found.page.on("pageerror", lambda error: found.complaints.append(str(error)))
        found.page.on("console", lambda message: _note(found, message.type, message.text))
        found.page.goto(file.as_uri())
        if not before and found.page.query_selector("#player-data, #dance-data"):
            found.page.wait_for_selector("[data-ready=yes]")
        return found

    yield open_file
    for context in contexts:
        context.close()


def _note(found: Opened, kind: str, text: str) -> None:
    if kind in ("error", "warning") and "GL Driver Message" not in text:
        found.complaints.append(text)


@pytest.fixture(scope="session")
def axe(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return axe-core (MPL-2.0) from npm; it is no part of the package."""
    folder = tmp_path_factory.mktemp("axe")
    command = ["npm", "pack", "axe-core@4.14.1", "--silent", "--pack-destination", str(folder)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    with tarfile.open(next(folder.glob("*.tgz"))) as archive:
        member = archive.extractfile("package/axe.min.js")
        assert member is not None
        return member.read().decode()
