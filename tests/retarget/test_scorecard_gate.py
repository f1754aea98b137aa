"""Red team: no spoilt motion passes the gate, and the message names the figure."""

import json
import math
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from robojackson.errors import RejectedReference
from robojackson.files.json_types import to_json
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.scorecard import score
from robojackson.retarget.scorecard_gate import BARS, check
from robojackson.retarget.targets.cycle import human_clip
from robojackson.retarget.targets.keypoint_targets import Targets, targets
from robojackson.robot.model import Robot
from robojackson.robot.resampling import velocities
from robojackson.robot.tree_kinematics import pose, tree
from tests.fixtures.robots import human, robot_motion, stock

DT = 0.015


def _aims(robot: Robot) -> Targets:
    clip, _ = human_clip(human("hip_shake"), DT, "auto", 1.0, RetargetConfig().cycle)
    return targets(clip, robot)


def _spoilt(change: Callable[[np.ndarray], None]) -> ReferenceMotion:
    """Return the hip shake with its poses changed and everything that follows from them
    recomputed."""
    motion = robot_motion("hip_shake")
    qpos = motion.qpos.copy()
    change(qpos)
    posed = pose(tree(stock()), qpos)
    return replace(
        motion,
        qpos=qpos,
        qvel=velocities(qpos, motion.dt, motion.cycle_offset),
        keypoints_w=posed.site_pos,
        body_pos_w=posed.body_pos[:, 1:],
    )


def _levitate(qpos: np.ndarray) -> None:
    qpos[:, 2] += 0.05


def _sink(qpos: np.ndarray) -> None:
    qpos[:, 2] -= 0.03


def _slide(qpos: np.ndarray) -> None:
    qpos[:, 0] += 0.1 * np.sin(np.linspace(0, 2 * np.pi, len(qpos), endpoint=False))


def _overbend(qpos: np.ndarray) -> None:
    qpos[7, 13] = np.radians(5.0)


def _jerk(qpos: np.ndarray) -> None:
    qpos[50, 20] += 0.4


def _shrink(qpos: np.ndarray) -> None:
    qpos[:, 3:7] *= 0.999


def _lose(qpos: np.ndarray) -> None:
    qpos[30, 12] = np.nan


def _tear(qpos: np.ndarray) -> None:
    ramp = np.linspace(0, 1, len(qpos))
    qpos[:, 7] += np.radians(20.0) * ramp


def _hop_at_the_seam(qpos: np.ndarray) -> None:
    qpos[:, 2] += 0.03 * np.linspace(0, 1, len(qpos))


@pytest.mark.parametrize(
    ("change", "figure"),
    [
        (_levitate, "contact_gap_mm"),
        (_sink, "floor_penetration_mm"),
        (_slide, "planted_slip_cm_s"),
        (_overbend, "limit_violations"),
        (_jerk, "speed_over_limit"),
        (_shrink, "quat_error"),
        (_lose, "nan_count"),
        (_tear, "seam_deg"),
        (_hop_at_the_seam, "seam_mm"),
    ],
)
def test_a_spoilt_motion_is_refused_by_name(change, figure: str, robot: Robot):
    card = score(_spoilt(change), robot, _aims(robot))
    with pytest.raises(RejectedReference, match=figure):
        check(card)
    assert card["passed"] == 0.0


def test_the_untouched_motion_passes(robot: Robot):
    check(score(_spoilt(lambda qpos: None), robot, _aims(robot)))


def test_levitation_without_contact_labels_is_refused_too(robot: Robot):
    aims = _aims(robot)
    unlabelled = replace(aims, contact=np.zeros_like(aims.contact))
    card = score(_spoilt(_levitate), robot, unlabelled)
    assert card["contact_gap_mm"] == 0.0
    with pytest.raises(RejectedReference, match="unsupported_share"):
        check(card)


def test_of_several_figures_the_one_that_explains_the_others_is_named_first():
    card = dict.fromkeys(BARS, 0.0) | {"contact_gap_mm": 6.3, "fallen_share": 1.0}
    findings = ["steps 0-199: body not over its feet", "steps 0-199: tilted 104 degrees: a fall"]
    with pytest.raises(RejectedReference, match="fallen_share is 1") as refused:
        check({**card, "findings": findings})
    message = str(refused.value)
    assert message.index("a fall") < message.index("not over its feet")
    assert "(and contact_gap_mm)" in message


def test_a_figure_that_is_no_number_is_refused_by_name_from_a_file_too():
    card = json.loads(to_json(dict.fromkeys(BARS, 0.0) | {"fallen_share": np.nan}))
    with pytest.raises(RejectedReference, match="fallen_share is nan") as refused:
        check(card)
    assert math.isnan(refused.value.value)


@pytest.mark.parametrize("figure", sorted(BARS))
def test_a_remedy_is_something_that_can_be_typed(figure: str):
    with pytest.raises(RejectedReference) as refused:
        check({**dict.fromkeys(BARS, 0.0), figure: 1e3})
    assert re.search(r"--(set retarget\.\w+=|start|method)", refused.value.remedy)


def test_a_refusal_can_be_given_more_advice():
    error = RejectedReference("refused", "try less", figure="seam_mm", value=9.0, forcible=True)
    more = error.advised(["the picture is upside down"])
    assert str(more) == "refused; try less; the picture is upside down, or --force"
    assert (more.figure, more.value) == ("seam_mm", 9.0)


def test_a_card_without_figures_is_refused():
    with pytest.raises(RejectedReference, match="no score card"):
        check({})


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_damped_motion_is_farther_from_the_targets(share: float, robot: Robot):
    """Frozen in the mean pose, or half the amplitude: worse on the headline figure."""

    def damp(qpos: np.ndarray) -> None:
        qpos[:, 7:] = qpos[:, 7:].mean(axis=0) + share * (qpos[:, 7:] - qpos[:, 7:].mean(axis=0))

    aims = _aims(robot)
    spoilt, real = score(_spoilt(damp), robot, aims), robot_motion("hip_shake").scorecard
    assert spoilt["keypoint_leaned_mm"] > 1.3 * real["keypoint_leaned_mm"]
