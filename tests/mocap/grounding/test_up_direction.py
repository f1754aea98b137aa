"""Laws of the direction of up."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.body.feet import foot_points
from robojackson.body.forward_kinematics import forward
from robojackson.body.skeleton import REST_JOINTS
from robojackson.geometry.frames import CAMERA_TO_WORLD
from robojackson.mocap.grounding import up_direction as ground
from robojackson.mocap.grounding.scene_lines import SceneEvidence
from robojackson.mocap.temporal.ground_evidence import GroundEvidence

FRAMES = 60
CONFIG = ground.GravityConfig()


def standing_in_camera(tilt: Rotation) -> tuple[np.ndarray, np.ndarray]:
    """Return points and feet of a person at rest before a camera that is turned by `tilt`."""
    local = np.broadcast_to(np.eye(3), (FRAMES, 24, 3, 3)).copy()
    pose = forward(local, REST_JOINTS[None], np.zeros((FRAMES, 3)))
    upright = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
    turn = (tilt * upright).as_matrix()
    feet = foot_points(pose, REST_JOINTS)
    return pose.points @ turn.T + [0, 0, 4], feet @ turn.T + [0, 0, 4]


@pytest.mark.parametrize("axis", ["x", "z"])
@pytest.mark.parametrize("degrees", [-20.0, 0.0, 12.0])
def test_up_is_found_for_a_tilted_camera(axis: str, degrees: float) -> None:
    tilt = Rotation.from_euler(axis, degrees, degrees=True)
    points, feet = standing_in_camera(tilt)
    found = ground.find_up(points, feet, 30.0, CONFIG)
    error = np.degrees(np.arccos(np.clip(found.up @ tilt.apply(ground.CAMERA_UP), -1, 1)))
    assert error < 3.5


def test_an_absurd_up_gives_way_to_the_camera() -> None:
    points, feet = standing_in_camera(Rotation.from_euler("z", 80, degrees=True))
    found = ground.find_up(points, feet, 30.0, CONFIG)
    assert found.source == "camera"
    assert np.array_equal(found.up, ground.CAMERA_UP)


def evidence(degrees: float, sd_deg: float) -> GroundEvidence:
    """Return a network's up that is pitched by `degrees`."""
    up = Rotation.from_euler("x", degrees, degrees=True).apply(ground.CAMERA_UP)
    return GroundEvidence(up, np.radians(sd_deg), np.radians(sd_deg))


@pytest.mark.parametrize(("sd_deg", "least", "most"), [(0.3, 28.0, 31.0), (60.0, 0.0, 3.0)])
def test_the_network_counts_as_much_as_it_is_sure(sd_deg: float, least: float, most: float) -> None:
    """Balance finds a level camera, the network one that is pitched by 30 degrees."""
    points, feet = standing_in_camera(Rotation.identity())
    found = ground.find_up(points, feet, 30.0, CONFIG, evidence(30.0, sd_deg))
    assert least <= found.tilt_deg <= most
    assert found.source == "network"


def test_the_spread_of_gravity_grows_where_balance_and_network_disagree() -> None:
    points, feet = standing_in_camera(Rotation.identity())
    near, far = (
        ground.find_up(points, feet, 30.0, CONFIG, evidence(angle, 2.0)) for angle in (3.0, 30.0)
    )
    assert near.sd_deg is not None
    assert far.sd_deg is not None
    assert near.sd_deg < 5.0
    assert far.sd_deg > 14.0
    assert ground.find_up(points, feet, 30.0, CONFIG).sd_deg is None


def test_a_steep_camera_needs_the_network() -> None:
    """Balance alone may not find a camera that looks down by 60 degrees; both together may."""
    tilt = Rotation.from_euler("x", -60, degrees=True)
    points, feet = standing_in_camera(tilt)
    up = tilt.apply(ground.CAMERA_UP)
    network = GroundEvidence(up, np.radians(2.0), np.radians(4.0))
    assert ground.find_up(points, feet, 30.0, CONFIG).source == "camera"
    found = ground.find_up(points, feet, 30.0, CONFIG, network)
    assert np.degrees(np.arccos(np.clip(found.up @ up, -1.0, 1.0))) < 8.0


def test_level_camera_gives_the_projects_frame_change() -> None:
    assert np.allclose(ground.camera_to_world(ground.CAMERA_UP), CAMERA_TO_WORLD)


def test_camera_to_world_is_a_rotation_that_lifts_up_to_z() -> None:
    up = Rotation.from_euler("xz", [15, -25], degrees=True).apply(ground.CAMERA_UP)
    turn = ground.camera_to_world(up)
    assert np.allclose(turn @ turn.T, np.eye(3))
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert np.allclose(turn @ up, [0, 0, 1])


@pytest.mark.parametrize(
    ("sd_deg", "source", "sure"),
    [(1.0, "scene", True), (8.0, "scene", False), (14.0, "network", False)],
)
def test_the_scene_decides_where_it_shows_up_closely(
    sd_deg: float, source: str, sure: bool
) -> None:
    """Balance and network find a level camera, the scene one that is rolled by 20 degrees."""
    points, feet = standing_in_camera(Rotation.identity())
    up = Rotation.from_euler("z", 20, degrees=True).apply(ground.CAMERA_UP)
    scene = SceneEvidence(up, np.radians(sd_deg), 900.0, 0.05)
    found = ground.find_up(points, feet, 30.0, CONFIG, evidence(0.0, 2.0), scene)
    assert (found.source, found.sure) == (source, sure)
    assert found.tilt_deg == pytest.approx(20.0 if source == "scene" else 0.0, abs=3.5)
