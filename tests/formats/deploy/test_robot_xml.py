"""The MJCF of a deploy pack: one file, without what is only looked at."""

from dataclasses import replace
from pathlib import Path

import cv2
import mujoco
import numpy as np

from robojackson.formats.deploy.robot_xml import robot_xml
from robojackson.robot.model import load_robot
from tests.fixtures import machine


def test_a_picture_on_a_robot_is_left_out(tmp_path: Path) -> None:
    described = machine.description(tmp_path)
    cv2.imwrite(str(tmp_path / "skin.png"), np.full((8, 8, 3), 200, np.uint8))
    looks = '<asset><texture name="t" type="2d" file="skin.png"/><material name="m" texture="t"/>'
    text = machine.mjcf().replace("<worldbody>", f"{looks}</asset><worldbody>")
    Path(described.mjcf).write_text(text.replace('type="sphere"', 'type="sphere" material="m"'))
    robot = load_robot(replace(described, torque_limits={"*": 20.0}))
    assert robot.model.ntex == 1
    alone = mujoco.MjModel.from_xml_string(robot_xml(robot).decode())
    assert (alone.ntex, alone.nu) == (0, robot.model.nu)
