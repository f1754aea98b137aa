"""The person beside the robot, and the picture of what the motion would take."""

from dataclasses import replace
from pathlib import Path

import av
import mujoco
import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.plots import run_plots
from robojackson.report.video import canvas
from robojackson.report.video.side_by_side import VideoConfig, side_by_side

SMALL = VideoConfig(fps=10, panel_width=64, panel_height=96, quality=5)
BLUE_TO_GREY = 20
"""How much bluer than red a pixel of the robot is, at least, of 255."""


@pytest.fixture
def frames(
    sequence: SmplSequence, reference: ReferenceMotion, model: mujoco.MjModel, tmp_path: Path
) -> list[np.ndarray]:
    """Return the small video, decoded."""
    given = (None, None, sequence, reference, None, tmp_path / "r.mp4")
    out = side_by_side(*given, model=model, config=SMALL)
    with av.open(str(out)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def test_one_cycle_is_shown(frames: list[np.ndarray], reference: ReferenceMotion) -> None:
    assert len(frames) == round(len(reference) * reference.dt * SMALL.fps)


def test_there_are_two_panels(frames: list[np.ndarray]) -> None:
    assert frames[0].shape == (96, 2 * 64 + 2, 3)


def test_the_person_is_on_the_left(frames: list[np.ndarray]) -> None:
    panel = frames[0][24:, :64].astype(int)
    assert (np.abs(panel - canvas.LEFT).sum(-1) < 120).any()
    assert (np.abs(panel - canvas.RIGHT).sum(-1) < 120).any()


def test_the_robot_is_on_the_right(frames: list[np.ndarray]) -> None:
    panel = frames[0][24:, 66:].astype(int)
    middle = (panel[..., 2] - panel[..., 0] > BLUE_TO_GREY).mean(0)[24:40]
    assert middle.max() > 0.2


def test_progress_counts_every_picture(
    sequence: SmplSequence, reference: ReferenceMotion, model: mujoco.MjModel, tmp_path: Path
) -> None:
    calls: list[tuple[int, int]] = []
    side_by_side(
        None, None, sequence, reference, None, tmp_path / "r.mp4", model=model, config=SMALL,
        progress=lambda done, total: calls.append((done, total)),
    )  # fmt: skip
    assert calls == [(count, 4) for count in range(1, 5)]


def loaded(reference: ReferenceMotion) -> ReferenceMotion:
    """Return a motion whose second motor is beyond its limit for a third of the time, the first
    never."""
    ratio = np.full_like(reference.torque_ratio, 0.4)
    ratio[: len(ratio) // 3, 1] = 1.5
    return replace(reference, torque_ratio=ratio)


def test_the_heat_map_shows_how_long_each_motor_is_over_its_limit(
    reference: ReferenceMotion,
) -> None:
    axes = run_plots.torque_heat_map(loaded(reference), reference.joint_names).axes[0]
    result = [label.get_text().split("  ")[1] for label in axes.get_yticklabels()]
    assert result == ["0 %", "33 %", *["0 %"] * (len(result) - 2)]


@pytest.mark.parametrize(("ratio", "warm"), [(0.95, False), (1.05, True)])
def test_the_colour_changes_at_the_limit(ratio: float, warm: bool) -> None:
    reference = ReferenceMotion(
        "r", "", 0.1, False, np.zeros(3), *[np.zeros((2, 8))] * 5, np.full((2, 1), ratio),
        np.zeros(2), ("knee",), (), (), (),
    )  # fmt: skip
    picture = run_plots.torque_heat_map(reference, ["knee"]).axes[0].images[0]
    red, _, blue, _ = picture.cmap(picture.norm(ratio))
    assert (red > blue) == warm


def test_a_name_too_few_is_an_error(reference: ReferenceMotion) -> None:
    with pytest.raises(ValueError, match="longer"):
        run_plots.torque_heat_map(reference, reference.joint_names[:-1])
