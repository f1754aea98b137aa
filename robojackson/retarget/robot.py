"""The robot: the MuJoCo model that a description is bound to by name.

Every body, joint and site of the description must resolve or `UnknownName` lists the known ones
(`mj_name2id` gives -1 for an unknown name, and `xpos[-1]` is the left forearm). Keypoints are sites
without mass, so the dynamics of the MJCF stay untouched. Metres, radians, seconds.
"""

import hashlib
import importlib.util
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.errors import BadConfiguration, UnknownName
from robojackson.retarget.description import KEYPOINTS, ContactPoint, RobotDescription

__all__ = ["KEYPOINTS", "ContactPoint", "Robot", "RobotDescription", "known", "load_robot", "where"]

_SYMMETRY_M = 1e-3


@dataclass(frozen=True)
class Robot:
    """A loaded and validated robot; hinges are in the order of qpos.

    Attributes:
        description: What it was made from.
        model: The MuJoCo model with the keypoint sites.
        sha256: Digest of the MJCF file.
        joint_names, body_names, keypoint_names, contact_names: World body left out.
        keypoint_sites: Site index a keypoint.
        keypoint_weights: Weight a keypoint.
        contact_keypoints: Column of the keypoint at the centre of each contact ball.
        contact_radii: Metres.
        contact_bodies: Body index of each contact ball.
        lower, upper: Hinge limits, radians.
        rest: Hinge rest angles, radians.
        torque_limit: Torque limit a hinge, Nm; infinite without a motor.
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
    contact_radii: Float[np.ndarray, " C"]
    contact_bodies: Int[np.ndarray, " C"]
    lower: Float[np.ndarray, " J"]
    upper: Float[np.ndarray, " J"]
    rest: Float[np.ndarray, " J"]
    torque_limit: Float[np.ndarray, " J"]
    lengths: Mapping[tuple[str, str], float] = field(default_factory=dict)

    @cached_property
    def actuated(self) -> Bool[np.ndarray, " J"]:
        """Which hinges have a motor."""
        return np.isfinite(self.torque_limit)

    @cached_property
    def standing(self) -> Float[np.ndarray, " nq"]:
        """qpos of the rest pose, upright above the origin, root at its height in the MJCF."""
        qpos = self.model.qpos0.copy()
        qpos[7:] = np.clip(self.rest, self.lower, self.upper)
        return qpos


def load_robot(description: RobotDescription) -> Robot:
    """Compile the MJCF with the keypoint sites and bind every name.

    Raises:
        UnknownName: A body, joint or keypoint that does not exist.
        BadConfiguration: A file that MuJoCo cannot load or a robot that is not a free root with
            hinges and mirrored sides.
    """
    path = _mjcf_path(description)
    spec = _read_spec(path, description)
    bodies = [body.name for body in spec.bodies if body.name != "world"]
    _add_sites(spec, description, bodies)
    model = spec.compile()
    model.actuator_gear[:] *= description.gear_scale
    _check_joints(model, description)
    robot = _bind(model, description, hashlib.sha256(path.read_bytes()).hexdigest())
    _check_symmetry(robot)
    return robot


def where(description: RobotDescription, key: str) -> str:
    """The place in the configuration that an error message names."""
    return f"configs/robots/{description.name}.yaml: {key}"


def known(kind: str, name: str, names: Iterable[str], place: str) -> str:
    """The name itself, or UnknownName."""
    names = list(names)
    if name not in names:
        raise UnknownName(kind, name, place, names)
    return name


def _mjcf_path(description: RobotDescription) -> Path:
    package, colon, inside = description.mjcf.partition(":")
    if colon and len(package) > 1:
        found = importlib.util.find_spec(package)
        if found is None or found.origin is None:
            raise BadConfiguration(
                f"{where(description, 'mjcf')}: package {package!r} is not installed"
            )
        return Path(found.origin).parent / inside
    return Path(description.mjcf)


def _read_spec(path: Path, description: RobotDescription) -> mujoco.MjSpec:
    if not path.is_file():
        raise BadConfiguration(f"{where(description, 'mjcf')}: no such file: {path}")
    try:
        return mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise BadConfiguration(
            f"{where(description, 'mjcf')}: {str(error).splitlines()[0]}"
        ) from error


def _add_sites(spec: mujoco.MjSpec, description: RobotDescription, bodies: list[str]) -> None:
    missing = [key for key in KEYPOINTS if key not in description.sites]
    if missing:
        raise BadConfiguration(f"{where(description, 'sites')}: missing {', '.join(missing)}")
    taken = {site.name for site in spec.sites}
    for key, (body, position) in description.sites.items():
        known("keypoint", key, KEYPOINTS, where(description, "sites"))
        known("body", body, bodies, where(description, f"sites.{key}"))
        if key in taken:
            raise BadConfiguration(f"{where(description, 'sites')}: the MJCF has a site {key!r}")
        spec.body(body).add_site(name=key, pos=list(position), size=[0.02, 0.02, 0.02])


def _check_joints(model: mujoco.MjModel, description: RobotDescription) -> None:
    """One free joint, first, on the root body; every other joint a limited hinge."""
    bodies = _names(model.nbody, model.body)
    root = known("body", description.root_body, bodies, where(description, "root_body"))
    free = int(mujoco.mjtJoint.mjJNT_FREE)
    hinge = int(mujoco.mjtJoint.mjJNT_HINGE)
    if model.jnt_type[0] != free or model.jnt_bodyid[0] != model.body(root).id:
        raise BadConfiguration(f"{where(description, 'root_body')}: {root!r} has no free joint")
    for index in range(1, model.njnt):
        if model.jnt_type[index] != hinge or not model.jnt_limited[index]:
            name = model.joint(index).name
            raise BadConfiguration(f"{where(description, 'mjcf')}: {name!r} is no limited hinge")


def _bind(model: mujoco.MjModel, description: RobotDescription, sha256: str) -> Robot:
    joints = _names(model.njnt, model.joint)[1:]
    bodies = _names(model.nbody, model.body)[1:]
    contacts = description.contacts
    for name, point in contacts.items():
        known("body", point.body, bodies, where(description, f"contacts.{name}.body"))
        known("keypoint", point.site, KEYPOINTS, where(description, f"contacts.{name}.site"))
        known("side", point.side, ("left", "right"), where(description, f"contacts.{name}.side"))
    for key in description.weights:
        known("keypoint", key, KEYPOINTS, where(description, "weights"))
    for joint in description.rest_pose:
        known("joint", joint, joints, where(description, "rest_pose"))
    return Robot(
        description=description,
        model=model,
        sha256=sha256,
        joint_names=joints,
        body_names=bodies,
        keypoint_names=KEYPOINTS,
        contact_names=tuple(contacts),
        keypoint_sites=np.array([model.site(key).id for key in KEYPOINTS]),
        keypoint_weights=np.array([description.weights.get(key, 0.0) for key in KEYPOINTS]),
        contact_keypoints=np.array([KEYPOINTS.index(c.site) for c in contacts.values()]),
        contact_radii=np.array([c.radius for c in contacts.values()]),
        contact_bodies=np.array([model.body(c.body).id for c in contacts.values()]),
        lower=model.jnt_range[1:, 0].copy(),
        upper=model.jnt_range[1:, 1].copy(),
        rest=np.array([description.rest_pose.get(joint, 0.0) for joint in joints]),
        torque_limit=_torque_limits(model),
        lengths=_lengths(model),
    )


def _names(count: int, accessor: object) -> tuple[str, ...]:
    return tuple(accessor(index).name for index in range(count))  # type: ignore[operator]


def _torque_limits(model: mujoco.MjModel) -> Float[np.ndarray, " J"]:
    """Gear times control range; the smaller force range where one is set."""
    limit = np.full(model.njnt - 1, np.inf)
    for index in range(model.nu):
        if model.actuator_trntype[index] != int(mujoco.mjtTrn.mjTRN_JOINT):
            continue
        force = (
            np.abs(model.actuator_gear[index, 0]) * np.abs(model.actuator_ctrlrange[index]).max()
        )
        if model.actuator_forcelimited[index]:
            force = min(force, np.abs(model.actuator_forcerange[index]).max())
        limit[model.actuator_trnid[index, 0] - 1] = force
    return limit


def _lengths(model: mujoco.MjModel) -> dict[tuple[str, str], float]:
    """Distances between all pairs of keypoints in the zero pose, metres."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    at = {key: data.site(key).xpos.copy() for key in KEYPOINTS}
    return {(a, b): float(np.linalg.norm(at[a] - at[b])) for a in KEYPOINTS for b in KEYPOINTS}


def _check_symmetry(robot: Robot) -> None:
    def mirrored(key: str) -> str:
        swap = {"left": "right", "right": "left"}
        side, _, rest = key.partition("_")
        return f"{swap[side]}_{rest}" if side in swap else key

    bones = (("hip", "knee"), ("knee", "foot"), ("shoulder", "elbow"), ("elbow", "hand"))
    for a, b in ((f"left_{a}", f"left_{b}") for a, b in bones):
        left, right = robot.lengths[a, b], robot.lengths[mirrored(a), mirrored(b)]
        if abs(left - right) > _SYMMETRY_M:
            raise BadConfiguration(
                f"{where(robot.description, 'sites')}: {a} to {b} is {left:.4f} m on the left and "
                f"{right:.4f} m on the right; they must be mirrored"
            )
