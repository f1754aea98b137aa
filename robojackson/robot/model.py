"""The robot: the MuJoCo model that a description is bound to by name.

Every body, joint and site of the description must resolve or `UnknownName` lists the known ones
(`mj_name2id` gives -1 for an unknown name, and `xpos[-1]` is the left forearm). Metres, radians,
seconds.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.errors import BadConfiguration
from robojackson.files.file_tree import FileTree
from robojackson.robot.actuation import Actuation, actuation_of, per_hinge
from robojackson.robot.body_states import foot_bodies, own_mass
from robojackson.robot.checks import check_model, check_names, check_soles, check_symmetry
from robojackson.robot.description import (
    KEYPOINTS,
    TOES,
    ContactPoint,
    RobotDescription,
    RobotSource,
)
from robojackson.robot.mjcf import compiled, mjcf_path, model_sha256, site_of
from robojackson.robot.names import known, where
from robojackson.robot.physics import MOST_SUBSTEPS, substeps_of

__all__ = [
    "KEYPOINTS", "TOES", "ContactPoint", "Robot", "RobotDescription", "RobotSource", "known",
    "load_robot", "where",
]  # fmt: skip


@dataclass(frozen=True, repr=False)
class Robot:
    """A loaded and validated robot; hinges are in the order of qpos.

    Attributes:
        description: What it was made from.
        model: The MuJoCo model with the keypoint sites.
        sha256: Digest of the MJCF file and of those that it names.
        joint_names, body_names, keypoint_names, contact_names: World body left out.
        keypoint_sites: Site index a keypoint.
        keypoint_weights: Weight a keypoint.
        contact_keypoints: Column of the keypoint that each contact ball belongs to.
        contact_offsets: Centre of each ball beside that keypoint, in the frame of its body, metres.
        contact_radii: Metres.
        contact_bodies: Body index of each contact ball.
        contact_arms: Centre of each ball beside its keypoint in the rest pose, world, metres.
        toe_arms: The same of the toe keypoints beside the feet's; empty where it has none.
        lower, upper: Hinge limits, radians.
        rest: Hinge rest angles, radians.
        stand: Hinge angles of the default stand, radians.
        actuation: Torque limits, gains and action scales a hinge.
        substeps: Physics substeps a control step.
        lengths: Distance of every pair of keypoints in the zero pose, metres.
    """

    description: RobotDescription
    model: mujoco.MjModel
    sha256: str
    joint_names: tuple[str, ...]
    body_names: tuple[str, ...]
    keypoint_names: tuple[str, ...]
    contact_names: tuple[str, ...]
    keypoint_sites: Int[np.ndarray, " K"]
    keypoint_weights: Float[np.ndarray, " K"]
    contact_keypoints: Int[np.ndarray, " C"]
    contact_offsets: Float[np.ndarray, "C 3"]
    contact_radii: Float[np.ndarray, " C"]
    contact_bodies: Int[np.ndarray, " C"]
    contact_arms: Float[np.ndarray, "C 3"]
    toe_arms: Mapping[str, Float[np.ndarray, "3"]]
    lower: Float[np.ndarray, " J"]
    upper: Float[np.ndarray, " J"]
    rest: Float[np.ndarray, " J"]
    stand: Float[np.ndarray, " J"]
    actuation: Actuation
    substeps: int
    lengths: Mapping[tuple[str, str], float] = field(default_factory=dict)

    def __repr__(self) -> str:
        motors = int(self.actuated.sum())
        return (
            f"Robot({self.description.name!r}, {len(self.joint_names)} hinges, {motors} motors, "
            f"{own_mass(self.model).sum():.1f} kg)"
        )

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the compiled model with its keypoint sites as MuJoCo's binary file (.mjb).

        Returns:
            The path; MuJoCo's viewer opens it.

        Raises:
            StoreError: the file cannot be written.
        """
        file, content = Path(path), np.zeros(mujoco.mj_sizeModel(self.model), np.uint8)
        mujoco.mj_saveModel(self.model, None, content)
        FileTree(file.parent).write(file.name, content.tobytes())
        return file

    @property
    def torque_limit(self) -> Float[np.ndarray, " J"]:
        """Torque limit a hinge, Nm; infinite without a motor."""
        return self.actuation.torque_limit

    @cached_property
    def actuated(self) -> Bool[np.ndarray, " J"]:
        """Which hinges have a motor."""
        result: np.ndarray = np.isfinite(self.torque_limit)
        return result

    @cached_property
    def foot_bodies(self) -> Int[np.ndarray, " F"]:
        """The bodies of the contact balls and those that are welded to them as one foot."""
        return foot_bodies(self.model, self.contact_bodies)

    @cached_property
    def standing(self) -> Float[np.ndarray, " nq"]:
        """The qpos of the rest pose, upright above the origin, root at its height in the MJCF."""
        qpos = self.model.qpos0.copy()
        qpos[7:] = np.clip(self.rest, self.lower, self.upper)
        result: np.ndarray = qpos
        return result

    @cached_property
    def sole_depth(self) -> float:
        """How far the soles are below the feet's keypoints in the rest pose, metres."""
        balls, names = self.description.contacts.values(), self.keypoint_names
        height = _posed(self.model, self.rest).site_xpos[self.keypoint_sites, 2]
        feet = height[[names.index(f"{ball.side}_foot") for ball in balls]]
        above = self.contact_radii - self.contact_arms[:, 2]  # of the keypoint of each ball
        return float((above + (feet - height[self.contact_keypoints])).mean())


def load_robot(description: RobotDescription) -> Robot:
    """Compile the MJCF with the keypoint sites and bind every name.

    Raises:
        UnknownName: A body, joint or keypoint that does not exist.
        BadConfiguration: A file that MuJoCo cannot load, or a robot that is not a free root with
            hinges, mirrored sides and level soles.
    """
    path = mjcf_path(description)
    model = compiled(description, path)
    check_model(model, description)
    return _bind(model, description, model_sha256(path))


def _bind(model: mujoco.MjModel, description: RobotDescription, sha256: str) -> Robot:
    joints = _names(model.njnt, model.joint)[1:]
    bodies = _names(model.nbody, model.body)[1:]
    check_names(description, bodies, joints)
    keys = KEYPOINTS + tuple(toe for toe in TOES if toe in description.sites)
    rest = _pose(description, "rest_pose", joints)
    lengths = _lengths(_posed(model, np.zeros_like(rest)), keys)
    check_symmetry(description, lengths)
    contacts = description.contacts
    balls = list(contacts.values())
    arms = _contact_arms(model, description, rest)
    return Robot(
        description=description,
        model=model,
        sha256=sha256,
        joint_names=joints,
        body_names=bodies,
        keypoint_names=keys,
        contact_names=tuple(contacts),
        keypoint_sites=np.array([site_of(model, key) for key in keys]),
        keypoint_weights=np.array([description.weights.get(key, 0.0) for key in keys]),
        contact_keypoints=np.array([keys.index(ball.site) for ball in balls]),
        contact_offsets=np.array([ball.offset for ball in balls], float),
        contact_radii=np.array([ball.radius for ball in balls]),
        contact_bodies=np.array([model.body(ball.body).id for ball in balls]),
        contact_arms=arms,
        toe_arms=_toe_arms(_posed(model, rest), keys),
        lower=model.jnt_range[1:, 0].copy(),
        upper=model.jnt_range[1:, 1].copy(),
        rest=rest,
        stand=_pose(description, "stand_pose", joints),
        actuation=actuation_of(model, description, joints),
        substeps=_substeps(model, description),
        lengths=lengths,
    )


def _names(count: int, accessor: object) -> tuple[str, ...]:
    return tuple(accessor(index).name for index in range(count))  # type: ignore[operator]


def _pose(
    description: RobotDescription, key: str, joints: tuple[str, ...]
) -> Float[np.ndarray, " J"]:
    named: Mapping[str, float] = getattr(description, key)
    result: np.ndarray = np.nan_to_num(per_hinge(named, joints, where(description, key)))
    return result


def _substeps(model: mujoco.MjModel, description: RobotDescription) -> int:
    timestep = float(model.opt.timestep)
    count = substeps_of(description.control_dt, timestep)
    if count is None:
        raise BadConfiguration(
            f"{where(description, 'control_dt')}: {1e3 * description.control_dt:g} ms is no whole "
            f"number of physics steps of {1e3 * timestep:g} ms, 1 to {MOST_SUBSTEPS}"
        )
    return count


def _posed(model: mujoco.MjModel, hinges: Float[np.ndarray, " J"]) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[7:] = hinges
    mujoco.mj_kinematics(model, data)
    return data


def _lengths(data: mujoco.MjData, keys: tuple[str, ...]) -> dict[tuple[str, str], float]:
    """Return the distances between all pairs of keypoints, metres."""
    at = {key: data.site_xpos[site_of(data.model, key)].copy() for key in keys}
    return {(a, b): float(np.linalg.norm(at[a] - at[b])) for a in keys for b in keys}


def _contact_arms(
    model: mujoco.MjModel, description: RobotDescription, rest: np.ndarray
) -> Float[np.ndarray, "C 3"]:
    """Return the centres of the balls beside their keypoints in the rest pose; the soles must be
    level."""
    data = _posed(model, rest)
    balls = list(description.contacts.values())
    turns = [data.body(ball.body).xmat.reshape(3, 3) for ball in balls]
    arms = np.array([turn @ ball.offset for turn, ball in zip(turns, balls, strict=True)])
    at = data.site_xpos[[site_of(model, ball.site) for ball in balls]] + arms
    check_soles(description, at[:, 2] - [ball.radius for ball in balls])
    return arms


def _toe_arms(data: mujoco.MjData, keys: tuple[str, ...]) -> dict[str, Float[np.ndarray, "3"]]:
    return {
        toe: data.site_xpos[site_of(data.model, toe)]
        - data.site_xpos[site_of(data.model, toe.replace("toe", "foot"))]
        for toe in keys[len(KEYPOINTS) :]
    }
