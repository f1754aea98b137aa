"""How long a training takes, as a pass estimates it."""

from dataclasses import replace

import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.evaluation.duration import FED_MINUTES, minutes_needed
from tests.fixtures.robots import robot_motion


@pytest.fixture(scope="module")
def dance_b() -> ReferenceMotion:
    return replace(robot_motion("dance_b"), cyclic=False)


def test_a_longer_motion_takes_longer(dance_b: ReferenceMotion) -> None:
    long, longer = (replace(dance_b, dt=times * dance_b.dt) for times in (2, 4))
    assert minutes_needed(longer) == pytest.approx(2 * minutes_needed(long))
    assert minutes_needed(replace(long, cyclic=True)) < minutes_needed(long)


def test_feedback_along_the_motion_saves_most_of_the_time(dance_b: ReferenceMotion) -> None:
    long = replace(dance_b, dt=4 * dance_b.dt)
    seconds = len(long) * long.dt
    assert minutes_needed(long, fed=True) == pytest.approx(seconds)
    assert minutes_needed(long, fed=True) < 0.2 * minutes_needed(long)
    assert minutes_needed(replace(long, cyclic=True), fed=True) == FED_MINUTES
