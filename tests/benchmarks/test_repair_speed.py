"""The speed benchmark of retargeting measures each row once and leaves the stages as they were."""

from argparse import Namespace

from benchmarks.retarget import repair_speed
from robojackson.retarget import danced_motion


def test_a_row_that_the_file_has_is_not_measured_again():
    rows = [{"code": "now", "robot": "humanoid", "clip": "walk", "clip_s": 3.0}]
    options = Namespace(code="now", beside=None)
    assert not list(repair_speed._rows(rows, "humanoid", "walk", 3.0, options))


def test_stages_are_clocked_and_left_as_they_were():
    own = danced_motion.optimise
    with repair_speed.clocked() as spent:
        assert danced_motion.optimise is not own
    assert danced_motion.optimise is own
    assert spent == dict.fromkeys(repair_speed.STAGES, 0.0)


def test_a_clip_goes_back_and_forth_until_it_is_long_enough():
    clip = repair_speed.clip_of("dance_b", 8.0)
    assert len(clip) == round(8.0 * clip.fps)
    assert len(repair_speed.clip_of("dance_b", 0)) < len(clip)
