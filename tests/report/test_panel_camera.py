"""The camera of a panel: no one is cut at an edge, and every robot stands in the same light."""

from contextlib import ExitStack

import mujoco
import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video import canvas
from robojackson.report.video.film import SIDE_DEG, Film, VideoConfig
from robojackson.report.video.panel_camera import Framing, Subject, fit, view_of
from robojackson.report.video.robot_panel import REFERENCE_TINT, RobotView
from robojackson.report.video.timeline import Timeline, at_frames, reference_qpos
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.robot.model import load_robot
from tests.fixtures.robots import G1, description, human, robot_motion, stock

SIZE = 120, 180
CONFIG = VideoConfig(panel_width=SIZE[0], panel_height=SIZE[1])
MAGENTA = (1.0, 0.0, 1.0)
CLIPS = ("hip_shake", "walk", "dance_b")
EVERY = 6
"""Frames from one that is looked at to the next."""
IN_THE_DARK = """
<mujoco>
  <visual><headlight active="0"/></visual>
  <worldbody>
    <geom type="plane" size="5 5 1" rgba="0.05 0.05 0.05 1"/>
    <light pos="0 0 9" diffuse="0.1 0.1 0.1"/>
    <body pos="0 0 0.7">
      <freejoint/>
      <geom type="capsule" fromto="0 0 -0.5 0 0 0.6" size="0.16" rgba="0 0 0 1"/>
    </body>
  </worldbody>
</mujoco>
"""
"""A robot whose own model has no light and a black floor."""


def edge(picture: np.ndarray) -> np.ndarray:
    """Return the outermost pixels below the title, (N, 3)."""
    below = picture[canvas.strip_height(*picture.shape[1::-1]) :].astype(int)
    return np.concatenate([below[0], below[-1], below[:, 0], below[:, -1]])


def has_skeleton(pixels: np.ndarray) -> bool:
    colours = np.array([canvas.LEFT, canvas.RIGHT, canvas.MIDDLE])
    return bool((np.abs(pixels[:, None] - colours).max(-1) < 40).any())


def has_robot(pixels: np.ndarray) -> bool:
    return bool((pixels[:, [0, 2]].min(1) - pixels[:, 1] > 30).any())


def moments_of(reference: ReferenceMotion) -> Timeline:
    return at_frames(np.arange(0, len(reference), EVERY), 1.0 / reference.dt, len(reference))


def robot_film(stack: ExitStack, reference: ReferenceMotion, model: mujoco.MjModel) -> Film:
    """Return a film of the front and the side of a robot, magenta."""
    when = moments_of(reference)
    qpos = np.asarray(reference.qpos)[when.frame]
    film = Film(stack, CONFIG, when)
    film.add_robot("front", qpos, model, MAGENTA)
    film.add_robot("side", qpos, model, MAGENTA, SIDE_DEG)
    return film


@pytest.mark.parametrize("azimuth_deg", [0.0, 35.0, 90.0])
@pytest.mark.parametrize("scale", [0.2, 1.0, 3.0])
def test_every_point_is_in_the_panel_below_the_title(azimuth_deg: float, scale: float) -> None:
    points = scale * np.random.default_rng(5).uniform((-1, -1, 0), (1, 1, 2), (200, 3))
    framing = fit([Subject(points, azimuth_deg)], 320, 480)
    pixels = view_of(np.zeros(2), azimuth_deg, 320, 480, framing).project(points)
    assert (pixels > [0, canvas.strip_height(320, 480)]).all()
    assert (pixels < [320, 480]).all()


def test_no_nearer_camera_has_every_point_in_its_panel() -> None:
    points = np.random.default_rng(6).uniform((-1, -1, 0), (1, 1, 2), (200, 3))
    framing = fit([Subject(points, 0.0)], 320, 480)
    heights = np.linspace(0.0, 2.0, 101)
    nearer = [Framing(0.93 * framing.distance, height) for height in heights]
    room = np.array([320, 480]) * 0.5 - 0.035 * 480
    for each in nearer:
        pixels = view_of(np.zeros(2), 0.0, 320, 480, each).project(points) - [160, 240]
        over = np.abs(pixels).max(0) > room
        assert over.any() or pixels[:, 1].min() < -room[1] + canvas.strip_height(320, 480)


def test_a_subject_whose_width_decides_is_in_the_middle_below_the_title() -> None:
    points = np.random.default_rng(7).uniform((-0.1, -0.6, 0), (0.1, 0.6, 1.1), (400, 3))
    framing = fit([Subject(points, 0.0)], 320, 480)
    rows = view_of(np.zeros(2), 0.0, 320, 480, framing).project(points)[:, 1]
    above, below = rows.min() - canvas.strip_height(320, 480), 480 - rows.max()
    assert above == pytest.approx(below, rel=0.1)


def test_without_a_subject_the_camera_stands_where_it_always_did() -> None:
    assert fit([], 320, 480) == Framing()


def test_a_point_that_is_not_known_is_left_out() -> None:
    points = np.array([[0.0, 0.3, 0.0], [0.0, -0.3, 1.7], [np.nan] * 3])
    assert fit([Subject(points, 0.0)], 320, 480) == fit([Subject(points[:2], 0.0)], 320, 480)


@pytest.mark.parametrize("clip", CLIPS)
def test_the_skeleton_touches_no_edge(clip: str) -> None:
    sequence: SmplSequence = human(clip)
    when = at_frames(np.arange(0, len(sequence), EVERY), sequence.fps, len(sequence))
    with ExitStack() as stack:
        film = Film(stack, CONFIG, when)
        film.add_body(sequence)
        film.add_body(sequence, "side", SIDE_DEG)
        panels = [panel for moment in film.moments() for panel in moment]
    assert all(has_skeleton(panel.reshape(-1, 3).astype(int)) for panel in panels)
    assert not any(has_skeleton(edge(panel)) for panel in panels)


@pytest.mark.slow
@pytest.mark.parametrize("clip", CLIPS)
def test_the_robot_touches_no_edge(clip: str) -> None:
    with ExitStack() as stack:
        film = robot_film(stack, robot_motion(clip), stock().model)
        panels = [panel for moment in film.moments() for panel in moment]
    assert all(has_robot(panel.reshape(-1, 3).astype(int)) for panel in panels)
    assert not any(has_robot(edge(panel)) for panel in panels)


@G1
@pytest.mark.parametrize("clip", ["hip_shake", "walk"])
def test_the_g1_touches_no_edge(clip: str) -> None:
    robot = load_robot(description("g1"))
    reference = retarget_motion(human(clip), robot, RetargetConfig())
    with ExitStack() as stack:
        film = robot_film(stack, reference, robot.model)
        panels = [panel for moment in film.moments() for panel in moment]
    assert all(has_robot(panel.reshape(-1, 3).astype(int)) for panel in panels)
    assert not any(has_robot(edge(panel)) for panel in panels)


def test_a_robot_that_falls_flat_touches_no_edge() -> None:
    """What a trained robot does at first: the camera follows its trunk, not its feet."""
    qpos = np.tile(stock().standing, (10, 1))
    qpos[:, 2] = np.linspace(1.3, 0.2, 10)
    tilt = np.linspace(0.0, np.pi / 2, 10)
    qpos[:, 3], qpos[:, 4] = np.cos(tilt / 2), np.sin(tilt / 2)
    with ExitStack() as stack:
        film = Film(stack, CONFIG, at_frames(np.arange(10), 30.0, 10))
        film.add_robot("trained robot", qpos, stock().model, MAGENTA)
        panels = [moment[0] for moment in film.moments()]
    assert not any(has_robot(edge(panel)) for panel in panels)


def light(model: mujoco.MjModel, qpos: np.ndarray) -> tuple[float, float]:
    """Return the mean luminance of the robot and of the floor beside it, 0..255."""
    grey = np.array([0.2126, 0.7152, 0.0722])
    with RobotView(model, *SIZE, MAGENTA) as view:
        marked = view.picture(qpos, qpos[:2], 0.0)
    with RobotView(model, *SIZE, REFERENCE_TINT) as view:
        picture = view.picture(qpos, qpos[:2], 0.0)
    on_robot = marked[..., [0, 2]].min(-1).astype(int) - marked[..., 1] > 60
    assert on_robot.sum() > 200
    corner = picture[int(0.94 * SIZE[1]) :, : int(0.2 * SIZE[0])]
    return float((picture[on_robot] @ grey).mean()), float((corner @ grey).mean())


def standing_light() -> tuple[float, float]:
    return light(stock().model, np.asarray(stock().standing, float))


def test_a_model_in_the_dark_is_as_bright_as_the_humanoid() -> None:
    model = mujoco.MjModel.from_xml_string(IN_THE_DARK)
    found = light(model, model.qpos0)
    np.testing.assert_allclose(np.array(found) / standing_light(), 1.0, atol=0.2)


@G1
def test_the_g1_is_as_bright_as_the_humanoid() -> None:
    robot = load_robot(description("g1"))
    found = light(robot.model, np.asarray(robot.standing, float))
    np.testing.assert_allclose(np.array(found) / standing_light(), 1.0, atol=0.2)


def test_the_robot_is_brighter_than_its_floor_and_the_floor_than_the_sky() -> None:
    robot, floor = standing_light()
    assert robot > 1.4 * floor > 1.4 * 2.0 * np.mean(canvas.BACKDROP)


def test_a_cyclic_reference_that_walks_away_stays_in_the_panel() -> None:
    reference = robot_motion("walk")
    steps = np.arange(0, 3 * len(reference), 4)
    zero = np.zeros(len(steps), int)
    when = Timeline(
        time_s=steps * reference.dt, step=steps % len(reference), cycle=steps // len(reference),
        frame=zero, rollout=zero, ended=zero.astype(bool),
    )  # fmt: skip
    with ExitStack() as stack:
        film = Film(stack, CONFIG, when)
        film.add_robot("r", reference_qpos(reference, when), stock().model, MAGENTA)
        panels = [moment[0] for moment in film.moments()]
    assert not any(has_robot(edge(panel)) for panel in panels)
