"""A deploy pack of the stock robot, whose policy has random weights."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from robojackson.api.deploy_pack import write_deploy_pack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.policy import Policy
from robojackson.robot.model import Robot
from tests.fixtures.deploy_policies import bare_packages, random_policy, swaying, with_head_on
from tests.fixtures.robots import stock


@dataclass(frozen=True)
class Pack:
    """A pack and what it was made from."""

    folder: Path
    robot: Robot
    reference: ReferenceMotion
    policy: Policy


def made(folder: Path, robot: Robot, cyclic: bool = True, feedforward: float = 0.0) -> Pack:
    """Write a policy, its motion and its pack."""
    reference = swaying(robot, cyclic)
    policy = random_policy(robot, reference, feedforward=feedforward)
    policy.save(folder / "policy.safetensors")
    reference.save(folder / "reference.parquet")
    write_deploy_pack(folder / "policy.safetensors", folder / "pack", robot=robot)
    return Pack(folder / "pack", robot, reference, policy)


@pytest.fixture(scope="session")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with numpy, onnxruntime and mujoco, without RoboJackson."""
    return bare_packages(tmp_path_factory.mktemp("bare"))


@pytest.fixture(scope="session")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Pack:
    """Return a pack of Humanoid-v5, whose motors are in another order than its hinges."""
    return made(tmp_path_factory.mktemp("deploy"), stock())


@pytest.fixture(scope="session")
def hipped(tmp_path_factory: pytest.TempPathFactory) -> Pack:
    """Return a pack with three hinges between the root and the anchor, a motion that ends, and
    lead."""
    robot = with_head_on(stock(), "pelvis")
    return made(tmp_path_factory.mktemp("hipped"), robot, cyclic=False, feedforward=0.5)
