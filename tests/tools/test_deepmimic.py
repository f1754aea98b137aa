"""Motion files survive a round trip, another rate and further loops."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tools.render import deepmimic


def some_motion(frames: int = 7) -> deepmimic.Motion:
    rng = np.random.default_rng(3)
    steps = np.cumsum(rng.normal(0.0, 0.1, (frames, 3)), axis=0)
    rotations = {"root": Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.1, (frames, 3)), axis=0))}
    for name in deepmimic.TREE_ORDER:
        table = deepmimic.BALL_JOINTS if name in deepmimic.BALL_JOINTS else deepmimic.HINGES
        local = np.cumsum(rng.normal(0.0, 0.1, (frames, 3)), axis=0)
        if name in deepmimic.HINGES:
            local[:, :2] = 0.0
        rotations[name] = rotations[table[name][0]] * Rotation.from_rotvec(local)
    return deepmimic.Motion(30.0, steps, rotations)


def test_reading_what_was_written_gives_the_same_rotations(tmp_path: Path) -> None:
    motion = some_motion()
    deepmimic.write(tmp_path / "m.txt", motion)
    back = deepmimic.read(tmp_path / "m.txt", fps=30.0)
    apart = [
        (motion.rotations[n].inv() * back.rotations[n]).magnitude().max() for n in back.rotations
    ]
    assert max(apart) < 1e-6


def test_reading_what_was_written_gives_the_same_path(tmp_path: Path) -> None:
    motion = some_motion()
    deepmimic.write(tmp_path / "m.txt", motion)
    back = deepmimic.read(tmp_path / "m.txt", fps=30.0)
    np.testing.assert_allclose(back.root_position, motion.root_position, atol=1e-7)


def test_half_the_rate_keeps_every_second_frame() -> None:
    motion = some_motion(7)
    half = deepmimic.resampled(motion, 15.0)
    np.testing.assert_allclose(half.root_position, motion.root_position[::2], atol=1e-12)


def test_second_cycle_starts_where_the_first_ended_on_the_floor() -> None:
    motion = some_motion(7)
    twice = deepmimic.repeated(motion, 2)
    np.testing.assert_allclose(twice.root_position[7, [0, 2]], motion.root_position[6, [0, 2]])


def test_file_with_other_frames_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "bad.txt").write_text('{"Frames": [[0.1, 1, 2]]}')
    with pytest.raises(ValueError, match=r"bad\.txt"):
        deepmimic.read(tmp_path / "bad.txt", fps=30.0)
