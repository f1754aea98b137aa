"""Every name of a robot description binds, or the error lists the known ones."""

from dataclasses import replace
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
import pytest

from robojackson.errors import BadConfiguration, UnknownName
from robojackson.robot.description import description_sha256
from robojackson.robot.mjcf import robots_folder
from robojackson.robot.model import ContactPoint, Robot, load_robot
from storage.store import Store
from tests.fixtures.robots import G1, description


def test_an_unknown_body_lists_the_known_ones():
    sites = dict(description().sites) | {"head": ("skull", (0.0, 0.0, 0.0))}
    with pytest.raises(UnknownName, match=r"'skull' .*sites.head.*left_foot, left_lower_arm"):
        load_robot(replace(description(), sites=sites))


def test_an_unknown_rest_joint_lists_the_known_ones():
    with pytest.raises(UnknownName, match=r"'left_ankle' .*abdomen_x, abdomen_y"):
        load_robot(replace(description(), rest_pose={"left_ankle": 0.1}))


def test_an_unknown_contact_body_is_refused():
    point = ContactPoint(site="left_foot", radius=0.1, body="sole", side="left")
    with pytest.raises(UnknownName, match="'sole'"):
        load_robot(replace(description(), contacts={"left_foot": point}))


def test_a_weight_of_an_unknown_keypoint_is_refused():
    with pytest.raises(UnknownName, match="'tail'"):
        load_robot(replace(description(), weights={"tail": 1.0}))


def test_a_missing_keypoint_is_named():
    sites = {key: site for key, site in description().sites.items() if key != "head"}
    with pytest.raises(BadConfiguration, match="missing head"):
        load_robot(replace(description(), sites=sites))


def test_sides_that_are_not_mirrored_are_refused():
    sites = dict(description().sites) | {"left_knee": ("left_shin", (0.0, 0.0, 0.1))}
    with pytest.raises(BadConfiguration, match=r"left_hip to left_knee is .* must be mirrored"):
        load_robot(replace(description(), sites=sites))


def test_a_missing_file_is_named():
    with pytest.raises(BadConfiguration, match=r"no such file: /nowhere\.xml"):
        load_robot(replace(description(), mjcf="/nowhere.xml"))


@pytest.mark.parametrize("address", ["{folder}", "file://{folder}"])
def test_added_robots_are_in_the_folder_of_the_store(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROBOJACKSON_STORE", address.format(folder=tmp_path / "a store"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert robots_folder() == tmp_path / "a store" / "robots"


def test_added_robots_of_an_object_store_are_in_the_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("ROBOJACKSON_STORE", "memory://bucket/store")
    assert robots_folder() == Store.from_environment().here / "robots"
    assert robots_folder().is_relative_to(tmp_path / "robojackson")


def test_lengths_are_those_of_the_mjcf(robot: Robot):
    assert robot.lengths["left_elbow", "left_hand"] == pytest.approx(0.18 * np.sqrt(3))
    assert robot.lengths["left_hip", "right_hip"] == pytest.approx(0.2)


def test_torque_limits_follow_the_joints_and_not_the_actuators(robot: Robot):
    limits = dict(zip(robot.joint_names, robot.torque_limit, strict=True))
    assert limits["left_hip_y"] == pytest.approx(120.0)
    assert limits["right_knee"] == pytest.approx(80.0)
    assert limits["left_elbow"] == pytest.approx(10.0)


def test_the_strong_variant_has_three_times_the_torque(robot: Robot):
    strong = load_robot(description("humanoid_strong"))
    np.testing.assert_allclose(strong.torque_limit, 3 * robot.torque_limit)


def test_the_sites_leave_the_stock_dynamics_as_they_are(robot: Robot, rng: np.random.Generator):
    stock = gymnasium.make("Humanoid-v5").unwrapped.model
    ctrl = rng.uniform(-0.4, 0.4, stock.nu)
    ends = []
    for model in (stock, robot.model):
        data = mujoco.MjData(model)
        data.ctrl[:] = ctrl
        mujoco.mj_step(model, data, 100)
        ends.append(data.qpos.copy())
    np.testing.assert_array_equal(ends[0], ends[1])


def test_the_place_of_the_accelerometer_ends_no_training_and_the_gains_do() -> None:
    own = description("humanoid")
    joints = load_robot(own).joint_names
    before = description_sha256(own, joints)
    assert description_sha256(replace(own, imu=(0.1, 0.0, 0.0)), joints) == before
    assert description_sha256(replace(own, robust_action_factor=2.0), joints) != before


def test_the_order_of_patterns_is_in_the_digest_where_it_has_a_meaning(robot: Robot) -> None:
    def digest(*limits: tuple[str, float]) -> str:
        own = replace(robot.description, torque_limits=dict(limits))
        return description_sha256(own, robot.joint_names)

    every, knees, elbows = ("*", 50.0), ("*_knee", 200.0), ("*_elbow", 9.0)
    assert digest(every, knees) != digest(knees, every)
    assert digest(every, knees, elbows) == digest(every, elbows, knees)


@pytest.mark.parametrize(
    ("name", "begins"),
    [
        ("humanoid", "7d183a5dea39"),
        ("humanoid_strong", "500ccdd60e63"),
        pytest.param("g1", "70f9146a0708", marks=G1),
    ],
)
def test_bundled_robots_have_the_digest_of_their_earlier_checkpoints(
    name: str, begins: str
) -> None:
    """Change it only with the robot: checkpoints and walkers of before are refused."""
    found = load_robot(description(name))
    assert description_sha256(found.description, found.joint_names).startswith(begins)
