"""The stock robot, seeded numbers, and poses all over its joint ranges."""

from tests.fixtures.robots import poses as poses
from tests.fixtures.robots import rng as rng
from tests.fixtures.robots import robot as robot
