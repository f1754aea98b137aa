"""Targets keep the directions of the human's bones and take the robot's lengths."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.body.skeleton import KEYPOINT_NAMES
from robojackson.motion.smpl_sequence import AIR, PLANTED
from robojackson.retarget.targets.human_clip import HumanClip
from robojackson.retarget.targets.keypoint_targets import BONES, targets
from robojackson.robot.model import KEYPOINTS, Robot
from tests.fixtures.robots import human

HUMAN_END = {"hip": "hip", "knee": "knee", "foot": "ankle", "shoulder": "shoulder"} | {
    "elbow": "elbow",
    "hand": "wrist",
}
RIGHT_FOOT = ("right_ankle", "right_foot", "right_big_toe")


def _clip(name: str = "walk", **changes: object) -> HumanClip:
    source = human(name)
    clip = HumanClip(
        time_s=np.arange(len(source)) / source.fps,
        keypoints_w=source.keypoints_w,
        contact=source.contact,
        valid=source.valid,
        dt=1 / source.fps,
        cycle_offset=None,
    )
    return replace(clip, **changes)  # type: ignore[arg-type]


def _human_bone(clip: HumanClip, name: str) -> np.ndarray:
    side, joint = name.split("_")
    return clip.keypoints_w[:, KEYPOINT_NAMES.index(f"{side}_{HUMAN_END[joint]}")]


def test_limbs_have_robot_lengths_and_human_directions(robot: Robot):
    clip = _clip()
    aims = targets(clip, robot).keypoints_w
    for a, b in BONES:
        bone = aims[:, KEYPOINTS.index(b)] - aims[:, KEYPOINTS.index(a)]
        source = _human_bone(clip, b) - _human_bone(clip, a)
        np.testing.assert_allclose(np.linalg.norm(bone, axis=1), robot.lengths[a, b], rtol=1e-9)
        cosine = np.sum(bone * source, 1) / np.linalg.norm(source, axis=1) / robot.lengths[a, b]
        np.testing.assert_allclose(cosine, 1.0, atol=1e-9)


def test_the_size_of_the_human_does_not_matter(robot: Robot):
    clip = _clip("hip_shake")
    tall = replace(clip, keypoints_w=1.15 * clip.keypoints_w)
    expected = targets(clip, robot).keypoints_w
    assert np.abs(targets(tall, robot).keypoints_w - expected).max() < 0.01


def test_the_lowest_sole_that_carries_is_on_the_floor(robot: Robot):
    aims = targets(_clip("hip_shake"), robot)
    soles = aims.keypoints_w[:, robot.contact_keypoints, 2] - robot.contact_radii
    carried = np.where(aims.contact != AIR, soles, np.inf).min(axis=1)
    np.testing.assert_allclose(carried, 0.0, atol=0.005)


def test_a_raised_recording_is_put_back_on_the_floor(robot: Robot):
    clip = _clip("hip_shake")
    raised = replace(clip, keypoints_w=clip.keypoints_w + [0.0, 0.0, 0.05])
    down, up = targets(clip, robot).keypoints_w, targets(raised, robot).keypoints_w
    np.testing.assert_allclose(up[..., 2].min(), down[..., 2].min(), atol=0.005)


def test_a_body_that_does_not_fall_stands_on_something_whatever_the_labels_say(robot: Robot):
    clip = _clip("hip_shake")
    bare = replace(clip, contact=np.zeros_like(clip.contact))
    assert (targets(bare, robot).contact != AIR).any(axis=1).all()


def _jump(cycles: bool = False, fall: float = 9.81) -> HumanClip:
    """Return two seconds of which steps 20 to 34 are a leap, m/s^2 downward."""
    clip = _clip("hip_shake")
    time = np.arange(15) * clip.dt
    points = np.repeat(clip.keypoints_w[:1], 60, axis=0)
    points[20:35, :, 2] += (fall / 2 * time * (time[-1] - time))[:, None]
    contact = np.ones((60, 4), int)
    contact[21:34] = AIR
    cycle_offset = np.zeros(3) if cycles else None
    return HumanClip(
        np.arange(60) * clip.dt, points, contact, np.ones(60, bool), clip.dt, cycle_offset
    )


@pytest.mark.parametrize("shift", [0, 22, 27, 31, 33])
def test_a_jump_over_the_seam_of_a_cycle_is_one_jump(robot: Robot, shift: int):
    """Wherever the cycle begins, the same steps of it are in the air."""
    whole = _jump(cycles=True)
    turned = replace(
        whole,
        keypoints_w=np.roll(whole.keypoints_w, -shift, 0),
        contact=np.roll(whole.contact, -shift, 0),
    )
    aims, expected = targets(turned, robot), targets(whole, robot)
    assert expected.airborne.sum() >= 11
    np.testing.assert_array_equal(np.roll(aims.airborne, shift), expected.airborne)
    np.testing.assert_array_equal(np.roll(aims.contact, shift, 0), expected.contact)


def test_a_jump_is_airborne_where_it_falls(robot: Robot):
    aims = targets(_jump(), robot)
    assert aims.airborne[22:33].all()
    assert not aims.airborne[:18].any()
    assert (aims.contact[23:32] == AIR).all()
    sole = aims.keypoints_w[:, robot.contact_keypoints, 2].min(axis=1) - robot.contact_radii[0]
    assert sole[27] == pytest.approx(4.905 * 0.233**2, abs=0.03)


def test_a_bouncing_step_is_no_jump(robot: Robot):
    """A foot carries what does not fall as fast as gravity, whatever the labels say."""
    aims = targets(_jump(fall=0.65 * 9.81), robot)
    assert not aims.airborne.any()
    assert (aims.contact != AIR).any(axis=1).all()


@pytest.mark.parametrize(("fall", "both"), [(0.65 * 9.81, True), (0.5, False)])
def test_a_leap_that_does_not_fall_is_a_step_with_both_feet_down(
    robot: Robot, fall: float, both: bool
):
    """A foot that is raised where the labels say air, but the body does not rise, stays raised."""
    clip = _jump(fall=fall)
    points = clip.keypoints_w.copy()
    raised = [i for i, name in enumerate(KEYPOINT_NAMES) if name in RIGHT_FOOT]
    points[15:40, raised] += [-0.25, 0.0, 0.12]
    aims = targets(replace(clip, keypoints_w=points), robot, hops=False)
    sides = np.array([point.side for point in robot.description.contacts.values()])
    assert (aims.contact[22:33][:, sides == "left"] != AIR).any(axis=1).all()
    assert (aims.contact[22:33][:, sides == "right"] != AIR).any(axis=1).all() == both


def test_frames_without_a_person_weigh_less(robot: Robot):
    clip = _clip()
    valid = clip.valid.copy()
    valid[10] = False
    weights = targets(replace(clip, valid=valid), robot).weights
    np.testing.assert_allclose(weights[10], 0.2 * weights[11])


def test_still_feet_are_planted(robot: Robot):
    assert (targets(_clip("hip_shake"), robot).contact == PLANTED).mean() > 0.95
