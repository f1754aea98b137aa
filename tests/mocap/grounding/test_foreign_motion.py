"""Contacts of motions of other projects that have a world frame: what is in the air is AIR."""

import numpy as np

from robojackson.formats.foreign_motion import ForeignMotion
from robojackson.mocap.imported_motion import ground_foreign_motion
from robojackson.motion.smpl_sequence import AIR, PLANTED
from tests.fixtures.person import UPRIGHT

FPS = 30.0


def test_feet_are_in_the_air_where_a_file_ends_in_a_jump() -> None:
    """A jump of .3 m from frame 31 on, cut two frames after its top."""
    time = np.arange(41) / FPS - 1.0
    rise = np.maximum(np.sqrt(2.0 * 9.81 * 0.3) * time - 4.905 * time**2, 0.0) * (time > 0.0)
    turns = np.tile(np.eye(3), (len(rise), 24, 1, 1))
    turns[:, 0] = UPRIGHT.as_matrix()
    pelvis = np.stack([0.0 * rise, 0.0 * rise, 0.95 + rise], -1)
    found = ground_foreign_motion(ForeignMotion(FPS, turns, pelvis), FPS).contact
    assert (found[:28] == PLANTED).all()
    assert (found[36:] == AIR).all()
