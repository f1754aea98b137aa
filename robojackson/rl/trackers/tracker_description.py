"""Content of `configs/trackers/<name>.yaml`: source of a network, and how it drives its robot.

Names of hinges are bound to a robot by `equipment.equip`. Metres, radians, seconds.
"""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field, model_validator

from robojackson.config import config_dataclass
from robojackson.errors import ConflictingValues
from robojackson.robot.description import Digest, Positive, Weight


@config_dataclass
class TrackerFile:
    """The file of a network; `robojackson trackers add NAME` downloads it where it does not ship.

    Attributes:
        url: Address of the file, of one commit; null for one that ships with RoboJackson.
        name: Name of the file in the store, or among the assets.
        size: Size, bytes.
        sha256: Digest of its content; another file is refused.
    """

    name: Annotated[str, Field(pattern=r"^[\w.-]+$")]
    size: Annotated[int, Field(ge=1)]
    sha256: Digest
    url: Annotated[str, Field(pattern=r"^https?://")] | None = None


@config_dataclass
class TrackerDescription:
    """A network that follows any reference motion with one robot.

    Attributes:
        name: Name of the tracker.
        robot: Name of the robot that it drives.
        network: Layout of its observation and action: `twist2`; `policy`, a policy file of ours; or
            `regulator`, linear-quadratic feedback without a network. The last two take gains and
            scales from their file or robot: nothing is given from `action_scale` on.
        file: Source of the network; null for `regulator`, which has none.
        root_state: Place and velocity of the root in the input of `regulator`: `exact`, as a
            simulation knows them, or `estimated` from the robot's own measurements
            (`rl.sim.leg_odometry`).
        fallback: Whether to select it by default only if no other tracker of its robot that may
            be selected so is installed.
        by_default: Whether it may be selected where no tracker is named.
        homepage: Address of its authors' description.
        licence: Licence of the file.
        trained_on: Training motions by its authors.
        control_dt: Seconds a control step.
        timestep: Seconds a physics step, where the PD law with these gains is not stable at the
            robot's own; the robot's when null.
        action_scale: Radians that an action of 1 moves a hinge's target from the default pose.
        action_limit: Largest magnitude of an action, unitless.
        joints: Hinges in the order of observation and action.
        default_pose: Hinge, or pattern with `*`, -> angle that an action of 0 holds, radians;
            default zero. Here and below the last matching pattern applies.
        stiffness: Hinge -> proportional gain of the PD law that it was trained with, Nm/rad.
        damping: Hinge -> derivative gain, Nm s/rad.
        unmeasured_speeds: Hinges, or patterns, whose speeds are zero in its input.
    """

    name: str
    robot: str
    network: Literal["twist2", "policy", "regulator"]
    licence: str
    trained_on: str
    homepage: str
    control_dt: Positive
    file: TrackerFile | None = None
    root_state: Literal["exact", "estimated"] = "exact"
    fallback: bool = False
    by_default: bool = True
    action_scale: Positive = 1.0
    action_limit: Positive = 1.0
    joints: tuple[str, ...] = ()
    stiffness: Mapping[str, Positive] = Field(default_factory=dict)
    damping: Mapping[str, Weight] = Field(default_factory=dict)
    default_pose: Mapping[str, float] = Field(default_factory=dict)
    unmeasured_speeds: tuple[str, ...] = ()
    timestep: Positive | None = None

    @model_validator(mode="after")
    def _complete(self) -> "TrackerDescription":
        if self.file is None and self.network != "regulator":
            raise ConflictingValues(f"network {self.network!r} needs a file", "network", "file")
        if self.network != "regulator" and self.root_state != "exact":
            raise ConflictingValues(
                f"network {self.network!r} does not see place and velocity of the root",
                "network",
                "root_state",
            )
        if self.network == "twist2" and not self.joints:
            raise ConflictingValues("network 'twist2' needs the joints", "network", "joints")
        return self

    def why_not(self, robot: str) -> str:
        """Return the words with which another robot than its own is refused."""
        return f"tracker {self.name!r} drives robot {self.robot!r}, not {robot!r}"
