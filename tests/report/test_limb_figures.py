"""Figures of head, hands and feet: what is compared with what, and over which steps."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.body.skeleton import keypoint
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.pages.limb_figures import limb_directions, limb_rows
from robojackson.report.video.timeline import Timeline
from robojackson.report.web.player_data import Player
from tests.report.conftest import with_stands

NAMES = ("pelvis", "head") + tuple(
    f"{side}_{part}" for side in ("left", "right") for part in ("shoulder", "hand", "hip", "foot")
)
HUMANS = [name.replace("hand", "wrist").replace("foot", "ankle") for name in NAMES]


def following(sequence: SmplSequence, reference: ReferenceMotion) -> ReferenceMotion:
    """Return a reference robot whose keypoints are at the dancer's."""
    frames = np.round(np.asarray(reference.source_time_s) * sequence.fps).astype(int)
    person = np.asarray(sequence.keypoints_w, float)[np.clip(frames, 0, len(sequence) - 1)]
    points = person[:, [keypoint(name) for name in HUMANS]]
    return replace(reference, keypoints_w=points, keypoint_names=NAMES)


def waving(sequence: SmplSequence) -> SmplSequence:
    """Return a dancer who raises the left arm by half a turn."""
    points = np.array(sequence.keypoints_w, float)
    angle = np.linspace(-np.pi / 2, np.pi / 2, len(points))
    arm = 0.5 * np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)
    points[:, keypoint("left_wrist")] = points[:, keypoint("left_shoulder")] + arm
    return replace(sequence, keypoints_w=points)


@pytest.mark.medium
def test_errors_by_limb_end_with_the_rollout(
    sequence: SmplSequence, reference: ReferenceMotion
) -> None:
    error = np.linspace(0.0, 0.9, 10)
    when = Timeline(*np.zeros((5, 10), int), ended=np.arange(10) >= 5)
    shown = Player({}, [], when, dict.fromkeys(("head", "left_hand"), error), {})
    rows = {row.title: row.values for row in limb_rows(sequence, reference, shown, {})}
    assert rows["head"][2] == "200 mm"
    assert rows["left foot"][2] == "–"


def test_a_robot_at_the_dancers_wrists_and_ankles_points_its_limbs_as_the_dancer(
    sequence: SmplSequence, reference: ReferenceMotion
) -> None:
    """The hand and the foot of a robot follow them, not the fingers and the ball of the foot."""
    found = limb_directions(sequence, following(sequence, reference))
    assert max(found.values()) < 0.1


def test_directions_are_compared_over_the_clip_alone(
    sequence: SmplSequence, reference: ReferenceMotion
) -> None:
    """A robot that stands around a dance that it follows exactly has no error."""
    dancing = waving(sequence)
    follows = following(dancing, reference)
    stood = with_stands(follows)
    assert max(limb_directions(dancing, stood).values()) < 0.1
    late = replace(stood, keypoints_w=np.roll(stood.keypoints_w, 5, axis=0))
    assert limb_directions(dancing, late)["left_hand"] > 10.0


def test_a_limb_that_the_robot_lacks_has_a_dash(
    sequence: SmplSequence, reference: ReferenceMotion
) -> None:
    row = limb_rows(sequence, reference, None, {})[0]
    assert (row.title, row.values[1]) == ("head", "–")
