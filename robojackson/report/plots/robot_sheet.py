"""A picture of a robot description: the robot at rest from front and side, and its joint ranges.

Keypoints and contact balls are labelled beside it, with lines to their places; degrees, metres.
"""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robojackson.report.plots.run_plots import ACCENT, INK, SECOND
from robojackson.report.video.canvas import Picture, side_colour
from robojackson.report.video.panel_camera import Framing, Subject, View, fit, view_of
from robojackson.report.video.robot_extent import corners
from robojackson.report.video.robot_panel import REFERENCE_TINT, RobotView
from robojackson.robot.body_states import drawn_geoms
from robojackson.robot.model import Robot

PIXELS = 1800
"""Width and height of a rendering before it is cropped, pixels."""
MARGIN = 0.08
"""Margin around the robot, share of its height."""
BALL = (0.25, 0.75, 0.4)
GROUND = "#16181d"
VIEWS = (("front", 0.0), ("left side", 90.0))
ROW_INCHES, LEAST_INCHES = 0.16, 5.4
BESIDE = 0.36
"""Room for the names on each side, share of the robot's height."""
RANGE_MARGIN = 0.04


@dataclass(frozen=True)
class Standing:
    """A robot in its rest pose with its soles on the floor.

    Attributes:
        qpos: Pose of the robot.
        keypoints, balls: Positions, world, metres.
        low, high: Corners of the box around what is drawn of it, world, metres.
    """

    qpos: Float[np.ndarray, " nq"]
    keypoints: dict[str, Float[np.ndarray, "3"]]
    balls: dict[str, Float[np.ndarray, "3"]]
    low: Float[np.ndarray, "3"]
    high: Float[np.ndarray, "3"]


def standing(robot: Robot) -> Standing:
    """Return a robot in its rest pose with its soles on the floor."""
    model, data = robot.model, mujoco.MjData(robot.model)
    data.qpos[:] = robot.standing
    data.qpos[:2] = 0.0
    mujoco.mj_kinematics(model, data)
    soles = _balls(robot, data)[:, 2] - robot.contact_radii
    data.qpos[2] -= soles.min()
    mujoco.mj_kinematics(model, data)
    points = data.site_xpos[robot.keypoint_sites].copy()
    box = np.concatenate([corners(model, data, drawn_geoms(model)).reshape(-1, 3), points])
    return Standing(
        data.qpos.copy(),
        dict(zip(robot.keypoint_names, points, strict=True)),
        dict(zip(robot.contact_names, _balls(robot, data), strict=True)),
        box.min(0),
        box.max(0),
    )


def robot_sheet(robot: Robot) -> Figure:
    """Draw the sheet.

    Raises:
        MissingDependency: no way to draw without a screen.
    """
    pose = standing(robot)
    height = max(LEAST_INCHES, ROW_INCHES * len(robot.joint_names) + 1.2)
    figure = Figure(figsize=(15.0, height), layout="constrained", facecolor="white")
    grid = figure.subplots(1, 3, width_ratios=(1.0, 0.9, 0.8))
    with RobotView(robot.model, PIXELS, PIXELS, REFERENCE_TINT) as view:
        at, framing = (pose.low[:2] + pose.high[:2]) / 2, framing_of(pose)
        for axes, (title, azimuth) in zip(grid, VIEWS, strict=False):
            camera = view_of(at, azimuth, PIXELS, PIXELS, framing)
            _panel(axes, robot, pose, view.picture(pose.qpos, at, azimuth, framing), camera)
            axes.set_title(f"{robot.description.name}, {title}", fontsize=10)
    _ranges(grid[2], robot)
    return figure


def framing_of(pose: Standing) -> Framing:
    """Return the camera that holds the robot, with room for the names beside it, in all views."""
    tall = float(np.ptp([pose.low[2], pose.high[2]]))
    middle = np.append((pose.low[:2] + pose.high[:2]) / 2, 0.0)
    subjects = []
    for _, azimuth in VIEWS:
        aside = BESIDE * tall * np.abs([np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))])
        room = np.append(aside, MARGIN * tall)
        subjects.append(Subject(_ends(pose.low - room, pose.high + room) - middle, azimuth))
    return fit(subjects, PIXELS, PIXELS)


def _ends(low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]) -> Float[np.ndarray, "8 3"]:
    """Return the corners of a box."""
    return np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T


def _panel(axes: Axes, robot: Robot, pose: Standing, picture: Picture, camera: View) -> None:
    """Draw a view, cropped around the robot, with names in two columns beside it."""
    box = camera.project(_ends(pose.low, pose.high))
    low, high = box.min(0), box.max(0)
    pad = MARGIN * (high[1] - low[1])
    beside = BESIDE * (high[1] - low[1])
    axes.imshow(picture, interpolation="antialiased")
    axes.set_xlim(max(low[0] - beside, 0.0), min(high[0] + beside, PIXELS))
    axes.set_ylim(min(high[1] + pad, PIXELS), max(low[1] - pad, 0.0))
    axes.set_facecolor(GROUND)
    axes.set_xticks([])
    axes.set_yticks([])
    marks = [(name, camera.project(point), False) for name, point in pose.keypoints.items()]
    for name, point in pose.balls.items():
        called = f"{name} (ball)" if name in pose.keypoints else name
        marks.append((called, camera.project(point), True))
    for ball, radius in zip(pose.balls.values(), robot.contact_radii, strict=True):
        edge = camera.project(ball + [0.0, 0.0, radius]) - camera.project(ball)
        _ring(axes, camera.project(ball), float(np.linalg.norm(edge)))
    middle = (low[0] + high[0]) / 2
    for is_left in (True, False):
        side = [mark for mark in marks if (mark[1][0] < middle) == is_left]
        column = low[0] - 0.12 * beside if is_left else high[0] + 0.12 * beside
        _names(axes, side, column, (low[1] - pad / 2, high[1] + pad / 2), is_left)


def _ring(axes: Axes, at: np.ndarray, radius: float) -> None:
    turn = np.linspace(0.0, 2 * np.pi, 40)
    axes.plot(at[0] + radius * np.cos(turn), at[1] + radius * np.sin(turn), color=BALL, lw=1.2)


def _names(
    axes: Axes,
    marks: list[tuple[str, np.ndarray, bool]],
    column: float,
    span: tuple[float, float],
    is_left: bool,
) -> None:
    """Draw names in a column in the order of height, evenly apart, each with a line to its
    place."""
    ordered = sorted(marks, key=lambda mark: (float(mark[1][1]), mark[0]))
    heights = _spread([float(mark[1][1]) for mark in ordered], span)
    for (name, at, is_ball), y in zip(ordered, heights, strict=True):
        colour = BALL if is_ball else tuple(c / 255 for c in side_colour(name))
        axes.plot([at[0], column], [at[1], y], color=colour, lw=0.5, alpha=0.7)
        axes.plot(*at, marker="o", ms=2.5 if is_ball else 4.0, color=colour, mec="black", mew=0.4)
        where: Any = {"va": "center", "ha": "right" if is_left else "left", "fontsize": 7}
        box = {"facecolor": GROUND, "alpha": 0.75, "pad": 0.8, "lw": 0}
        axes.text(column, y, name, color=colour, bbox=box, **where)


def _spread(preferred: list[float], span: tuple[float, float]) -> list[float]:
    """Return heights as near as possible to the preferred ones, without overlapping names."""
    low, high = span
    gap = min((high - low) / max(len(preferred), 1), (high - low) / 24)
    found: list[float] = []
    for height in preferred:
        found.append(max(height, found[-1] + gap if found else low))
    for index in range(len(found) - 1, -1, -1):
        most = found[index + 1] - gap if index + 1 < len(found) else high
        found[index] = min(found[index], most)
    return found


def _ranges(axes: Axes, robot: Robot) -> None:
    rows = np.arange(len(robot.joint_names))
    low, high, rest = (np.degrees(a) for a in (robot.lower, robot.upper, robot.rest))
    colours = [ACCENT if driven else INK for driven in robot.actuated]
    axes.barh(rows, high - low, left=low, color=colours, height=0.6, alpha=0.8)
    axes.margins(x=RANGE_MARGIN)
    axes.use_sticky_edges = False
    axes.plot(rest, rows, ls="", marker="|", ms=9, mew=2.2, color=SECOND)
    axes.axvline(0.0, color=INK, lw=0.6)
    axes.set_yticks(rows, robot.joint_names, fontsize=7)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.tick_params(axis="x", labelsize=8)
    axes.set_xlabel("degrees; orange: rest angle; grey: no torque limit", fontsize=8)
    axes.set_title("joint ranges", fontsize=10)
    for name in ("top", "right"):
        axes.spines[name].set_visible(False)


def _balls(robot: Robot, data: mujoco.MjData) -> Float[np.ndarray, "C 3"]:
    sites = data.site_xpos[robot.keypoint_sites[robot.contact_keypoints]]
    turns = data.xmat[robot.contact_bodies].reshape(-1, 3, 3)
    result: np.ndarray = sites + (turns @ robot.contact_offsets[:, :, None])[:, :, 0]
    return result
