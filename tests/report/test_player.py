"""The marks and curves of a page's player."""

from dataclasses import replace

import numpy as np

from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.pages.run_page import PageContent, render
from robojackson.report.web.player_data import player
from robojackson.robot.model import load_robot
from tests.fixtures.robots import stock


def test_a_robot_that_drifts_over_the_floor_does_not_leave_the_dance(
    track: LandmarkTrack, sequence: SmplSequence, reference: ReferenceMotion
) -> None:
    """Errors and marks are in the frame of pelvis and heading, as strict success is."""
    robot = stock()
    drifted, bent = (np.array(reference.qpos, float) for _ in range(2))
    drifted[:, 0] += 1.0
    bent[:, 7:] += 1.5
    motion = replace(reference, certificate=None)
    for qpos, is_off in ((drifted, False), (bent, True)):
        shown = player(track, sequence, motion, qpos, robot, 30.0, 5.0)
        titles = {span.title for band in shown.bands for span in band.spans}
        assert ("robot off the dance" in titles) == is_off
        assert (max(error.max() for error in shown.error_m.values()) > 0.1) == is_off


def test_person_and_camera_do_not_jump_back_with_a_cycle(
    track: LandmarkTrack, sequence: SmplSequence, reference: ReferenceMotion
) -> None:
    walked = np.array(sequence.keypoints_w, float)
    walked[:, :, 0] += 0.05 * np.arange(len(walked))[:, None]
    motion = replace(reference, certificate=None)
    rollout = np.tile(motion.qpos, (4, 1))
    person = replace(sequence, keypoints_w=walked)
    shown = player(track, person, motion, rollout, stock(), 30.0, 5.0)
    steps = np.diff(shown.points["person"][:, 0, 0])
    assert len(steps) > 40
    assert ((steps >= 0.0) & (steps < 0.11)).all()


def test_a_cut_dance_is_noted_on_its_page(
    track: LandmarkTrack, sequence: SmplSequence, reference: ReferenceMotion
) -> None:
    motion = replace(reference, certificate=None)
    for most, is_cut in ((0.2, True), (20.0, False)):
        shown = player(track, sequence, motion, motion.qpos, stock(), 30.0, most)
        html = render(PageContent(title="x", player=shown))
        assert ("--set render.max_seconds=1 shows the whole dance" in html) == is_cut


def test_the_reference_has_bands_of_its_feet_whatever_its_contacts_are_called(
    track: LandmarkTrack, sequence: SmplSequence, reference: ReferenceMotion
) -> None:
    described = stock().description
    names = dict(zip(described.contacts, ("sole_l", "sole_r"), strict=True))
    contacts = {names[name]: point for name, point in described.contacts.items()}
    robot = load_robot(replace(described, contacts=contacts))
    motion = replace(reference, contact_names=robot.contact_names, certificate=None)
    titles = {band.title for band in player(track, sequence, motion, None, robot, 30.0, 5.0).bands}
    assert {"reference, left foot", "reference, right foot"} <= titles
