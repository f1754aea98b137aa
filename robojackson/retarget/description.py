"""The description of a robot that a user edits: `configs/robots/<name>.yaml`.

Names are bound to a MuJoCo model by `robot.load_robot`. Metres, radians, seconds.
"""

from collections.abc import Mapping

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass as config_dataclass

KEYPOINTS: tuple[str, ...] = (
    "pelvis", "left_hip", "right_hip", "left_knee", "right_knee", "left_foot", "right_foot",
    "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_hand", "right_hand",
    "head",
)  # fmt: skip
_STRICT = ConfigDict(extra="forbid")


@config_dataclass(frozen=True, config=_STRICT)
class ContactPoint:
    """A ball under the robot that may touch the floor.

    Attributes:
        site: Keypoint at the centre of the ball.
        radius: Metres.
        body: Body that carries it; its geoms are left out of the floor collision term.
        side: Foot of the human that it follows, left or right.
    """

    site: str
    radius: float
    body: str
    side: str


@config_dataclass(frozen=True, config=_STRICT)
class RobotDescription:
    """What `configs/robots/<name>.yaml` holds.

    Attributes:
        name: Name of the robot.
        mjcf: A file, or `package:path` inside an installed package.
        root_body: Body with the free joint.
        sites: Keypoint -> body and position in the body, metres.
        weights: Keypoint -> weight of its squared error; zero where it is not named.
        contacts: Balls under the feet, by name.
        rest_pose: Hinge -> rest angle, radians; zero where it is not named.
        max_joint_speed: Speed limit of the hinges in a reference motion, rad/s.
        control_dt: Seconds a control step.
        gear_scale: Factor on the torque of all motors.
    """

    name: str
    mjcf: str
    root_body: str
    sites: Mapping[str, tuple[str, tuple[float, float, float]]]
    weights: Mapping[str, float]
    contacts: Mapping[str, ContactPoint]
    rest_pose: Mapping[str, float] = Field(default_factory=dict)
    max_joint_speed: float = Field(default=12.0, gt=0)
    control_dt: float = Field(default=0.015, gt=0)
    gear_scale: float = Field(default=1.0, gt=0)
