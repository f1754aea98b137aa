"""Laws of the leash: it holds what strays for long, lets outliers be mended and the body travel."""

import numpy as np

from robojackson.mocap.landmarks.leash import leashed

START = np.random.default_rng(0).normal(size=(1, 12, 3)) + np.zeros((40, 1, 1))
WRIST, LEASH, FPS = 4, 0.12, 30.0


def test_a_landmark_that_strays_for_long_is_held() -> None:
    body = START.copy()
    body[10:30, WRIST, 2] += 0.5
    held = leashed(START, body, FPS, LEASH)
    assert np.allclose((held - START)[10:30, WRIST, 2], LEASH)


def test_an_outlier_of_one_frame_is_put_right() -> None:
    glitch = START.copy()
    glitch[20, WRIST, 0] += 0.6
    assert np.allclose(leashed(glitch, START, FPS, LEASH), START)


def test_the_body_as_a_whole_may_go_anywhere() -> None:
    body = START + [1.0, 2.0, 3.0]
    assert np.allclose(leashed(START, body, FPS, LEASH), body)
