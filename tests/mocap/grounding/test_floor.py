"""Laws of the floor, flight and smoothing."""

import numpy as np
import pytest

from robojackson.body.skeleton import REST_JOINTS, keypoint, pair
from robojackson.body.smoothing import lowpass
from robojackson.mocap.grounding import flight as air
from robojackson.mocap.grounding import floor as ground

FRAMES = 60


def test_centre_of_mass_is_inside_a_standing_person() -> None:
    mass = ground.centre_of_mass(REST_JOINTS[None])[0]
    assert mass[0] == pytest.approx(0.0)
    assert REST_JOINTS[pair("hip")[0], 1] < mass[1] < REST_JOINTS[keypoint("spine3"), 1]


def test_centre_of_mass_moves_with_the_body() -> None:
    shift = np.array([1.0, -2.0, 3.0])
    moved = ground.centre_of_mass(REST_JOINTS[None] + shift)
    assert np.allclose(moved, ground.centre_of_mass(REST_JOINTS[None]) + shift)


def test_a_thrown_body_falls_freely_and_a_standing_one_does_not() -> None:
    time = np.arange(30) / 30.0
    assert air.free_fall(1.0 + 3.0 * time - 4.905 * time**2, 30.0)[5:-5].all()
    assert not air.free_fall(np.full(30, 0.9), 30.0).any()


def test_floor_follows_the_lowest_foot() -> None:
    lowest = np.linspace(0.2, 0.4, FRAMES)
    floor = ground.floor_height(lowest, np.zeros(FRAMES, bool), 30.0, 3.0)
    assert np.allclose(floor, lowest, atol=1e-6)


def test_floor_does_not_rise_with_a_jump() -> None:
    lowest = np.zeros(FRAMES)
    falling = np.zeros(FRAMES, bool)
    lowest[25:35], falling[25:35] = 0.4, True
    assert np.abs(ground.floor_height(lowest, falling, 30.0, 3.0)).max() < 1e-9


@pytest.mark.parametrize("height_m", [0.1, 0.25, 0.45])
def test_a_jump_is_ballistic_as_long_as_it_lasts(height_m: float) -> None:
    speed = np.sqrt(2.0 * 9.81 * height_m)
    time = np.arange(60) / 30.0 - 0.7
    rise = np.maximum(speed * time - 4.905 * time**2, 0.0) * (time > 0.0)
    seen = lowpass(rise, 30.0, 4.0)
    found = np.flatnonzero(air.ballistic(1.0 + seen, 0.02 + seen, 30.0))
    true = np.flatnonzero(rise > 0.0)
    assert abs(found[0] - true[0]) <= 2
    assert abs(found[-1] - true[-1]) <= 2


@pytest.mark.parametrize("fps", [20.0, 24.0, 25.0, 50.0, 60.0])
def test_a_small_jump_is_found_at_every_frame_rate(fps: float) -> None:
    """17 cm, .37 s: push-off, flight and landing, in twenty phases to the frames."""
    time = np.arange(-3600, 3600) / 2400.0
    flight, push, speed = 0.372, 0.25, 9.81 * 0.186
    force = np.where(np.abs(np.abs(time) - (flight + push) / 2.0) < push / 2.0, speed / push, 0.0)
    force[np.abs(time) < flight / 2.0] = -9.81
    height = np.cumsum(np.cumsum(force)) / 2400.0**2
    inside = np.clip(time, -flight / 2.0, flight / 2.0)
    rise = speed * (inside + flight / 2.0) - 4.905 * (inside + flight / 2.0) ** 2
    for phase in np.arange(20) / 20.0:
        seen = (np.arange(2.6 * fps) + phase) / fps - 1.3
        body, feet = (lowpass(np.interp(seen, time, each), fps, 4.0) for each in (height, rise))
        assert air.ballistic(body, feet, fps).any()


@pytest.mark.parametrize("frames", [60, 28, 26, 24])
def test_a_person_who_drops_into_a_squat_does_not_jump(frames: int) -> None:
    """The shorter clips end in the fall."""
    time = np.arange(frames) / 30.0
    height = 1.0 - 0.4 * np.clip((time - 0.7) / 0.25, 0.0, 1.0) ** 2
    assert not air.ballistic(height, np.zeros(frames), 30.0).any()


def test_flight_reaches_from_the_last_to_the_first_touch() -> None:
    lowest = np.array([0.0, 0.0, 0.1, 0.3, 0.4, 0.3, 0.1, 0.0, 0.0])
    falling = np.zeros(9, bool)
    falling[3:6] = True
    height = -4.905 * ((np.arange(9) - 4) / 30.0) ** 2
    assert np.flatnonzero(air.flight(lowest, height, falling, 30.0)).tolist() == [2, 3, 4, 5, 6]


def test_feet_that_rise_while_the_body_does_not_fall_are_no_flight() -> None:
    lowest = np.array([0.0, 0.0, 0.1, 0.3, 0.4, 0.3, 0.1, 0.0, 0.0])
    falling = np.zeros(9, bool)
    falling[4] = True
    found = air.flight(lowest, np.zeros(9), falling, 30.0)
    assert np.flatnonzero(found).tolist() == [4]


def test_lowpass_keeps_lines_and_slow_waves_and_removes_fast_ones() -> None:
    time = np.arange(300) / 30.0
    slow, fast = np.sin(2 * np.pi * 0.5 * time), np.sin(2 * np.pi * 12.0 * time)
    smooth = lowpass(2.0 * time + slow + fast, 30.0, 4.0)
    assert np.abs(smooth - 2.0 * time - slow)[15:-15].max() < 0.02


def test_lowpass_has_no_lag() -> None:
    pulse = np.exp(-(((np.arange(101) - 50) / 4.0) ** 2))
    smooth = lowpass(pulse, 30.0, 3.0)
    assert np.allclose(smooth, smooth[::-1], atol=1e-3)
    assert smooth.argmax() == 50


def test_lowpass_leaves_a_clip_of_two_frames() -> None:
    assert np.array_equal(lowpass(np.array([[1.0], [2.0]]), 30.0, 4.0), [[1.0], [2.0]])
