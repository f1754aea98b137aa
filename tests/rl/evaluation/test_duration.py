"""How long a training takes, as a pass estimates it."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.evaluation.duration import (
    CYCLIC_MINUTES,
    FED_MINUTES,
    OTHER_MINUTES,
    WALKING_MINUTES,
    minutes_needed,
)
from tests.fixtures.robots import robot_motion


@pytest.fixture(scope="module")
def dance_b() -> ReferenceMotion:
    return replace(robot_motion("dance_b"), cyclic=False)


def test_a_longer_motion_takes_longer(dance_b: ReferenceMotion) -> None:
    long, longer = (replace(dance_b, dt=seconds / len(dance_b)) for seconds in (11.0, 22.0))
    assert minutes_needed(long) == minutes_needed(dance_b) == OTHER_MINUTES
    assert minutes_needed(longer) == pytest.approx(2 * minutes_needed(long))


def test_a_motion_that_repeats_takes_longer_where_it_travels(dance_b: ReferenceMotion) -> None:
    in_place = replace(dance_b, cyclic=True, cycle_offset=np.zeros(3))
    walk = replace(in_place, cycle_offset=np.array([1.0, 0.0, 0.0]))
    assert minutes_needed(in_place) == CYCLIC_MINUTES
    assert minutes_needed(walk) == WALKING_MINUTES


def test_feedback_along_the_motion_saves_most_of_the_time(dance_b: ReferenceMotion) -> None:
    long = replace(dance_b, dt=10.0 / len(dance_b))
    seconds = len(long) * long.dt
    assert minutes_needed(long, fed=True) == pytest.approx(seconds)
    assert minutes_needed(long, fed=True) <= 0.5 * minutes_needed(long)
    assert minutes_needed(replace(long, cyclic=True), fed=True) == FED_MINUTES
