"""The sheet of a robot holds all of it, however tall it is."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.report.plots.robot_sheet import BESIDE, PIXELS, VIEWS, framing_of, standing
from robojackson.report.video.panel_camera import view_of
from tests.fixtures.robots import stock


@pytest.mark.parametrize("scale", [0.3, 1.0, 1.5, 4.0])
def test_a_robot_of_any_height_fits_with_its_names_beside_it(scale: float) -> None:
    pose = standing(stock())
    pose = replace(pose, low=scale * pose.low, high=scale * pose.high)
    at, tall = (pose.low[:2] + pose.high[:2]) / 2, pose.high[2] - pose.low[2]
    for _, azimuth in VIEWS:
        camera = view_of(at, azimuth, PIXELS, PIXELS, framing_of(pose))
        ends = np.array(np.meshgrid(*zip(pose.low, pose.high, strict=True))).reshape(3, -1).T
        for aside in (-BESIDE, BESIDE):
            pixels = camera.project(ends + aside * tall * camera.axes[0])
            assert (pixels >= 0.0).all()
            assert (pixels <= PIXELS).all()
            if scale > 1.0:
                assert np.ptp(pixels[:, 1]) > 0.7 * PIXELS, (
                    "the robot is as large as the picture allows"
                )
