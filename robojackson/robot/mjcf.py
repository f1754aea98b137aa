"""The MuJoCo model of a robot description: the MJCF, keypoint sites, and a floor if it has none.

The sites have no mass, so the dynamics of the MJCF stay untouched. Where the MJCF has a site of the
same name already, ours is `keypoint/NAME`.
"""

import hashlib
import importlib.util
from pathlib import Path

import mujoco

from robojackson.errors import BadConfiguration
from robojackson.files.memory_limit import limited_memory
from robojackson.files.store_files import copy_folder_here, files_here, is_whole
from robojackson.robot.description import KEYPOINTS, TOES, RobotDescription
from robojackson.robot.model_files import (
    FAULTS,
    files_of,
    first_line,
    named_spec,
    require_model_files,
    require_sound,
    silence_mujoco,
)
from robojackson.robot.names import known, where
from robojackson.robot.physics import add_floor, apply_physics

ADDED = "store"
"""Prefix of an `mjcf` that `robojackson robots add` unpacks."""
FOLDER = "robots"
"""Where a store has the models of added robots, a folder each."""
_OURS = "keypoint/"


def site_of(model: mujoco.MjModel, key: str) -> int:
    """Return the index of a keypoint's site."""
    ours = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, f"{_OURS}{key}")
    return int(model.site(key).id if ours < 0 else ours)


def robots_folder() -> Path:
    """Return where added robots are on this machine: inside the store, or in its cache where
    it is no folder."""
    return files_here() / FOLDER


def added_key(description: RobotDescription) -> str:
    """Return the key of the folder in a store where `robojackson robots add` puts the model of a
    robot."""
    shared = description.source.shared_folder if description.source else ""
    return f"{FOLDER}/{shared or description.name}"


def added_folder(description: RobotDescription) -> Path:
    """Return where the model of an added robot is on this machine."""
    return files_here() / added_key(description)


def mjcf_path(description: RobotDescription) -> Path:
    """Return the file of a description.

    Raises:
        BadConfiguration: It is not there, or not the one that was pinned.
    """
    package, colon, inside = description.mjcf.partition(":")
    if not colon or len(package) == 1 or not package.replace(".", "").isidentifier():
        path = Path(description.mjcf)
    elif package == ADDED:
        return _added(description, inside)
    else:
        path = _in_package(description, package, inside)
    if not path.is_file():
        raise BadConfiguration(f"{where(description, 'mjcf')}: no such file: {path}")
    return path


def _added(description: RobotDescription, inside: str) -> Path:
    name, path = description.name, added_folder(description) / inside
    pinned = description.source.model_sha256 if description.source else None
    if not is_whole(path, pinned):  # another machine may have added it
        copy_folder_here(added_key(description), inside, pinned)
    if not path.is_file():
        raise BadConfiguration(
            f"robot {name!r}: its model is not here ({path}); run: robojackson robots add {name}"
        )
    if not is_whole(path, pinned):
        raise BadConfiguration(
            f"robot {name!r}: {path} has been altered; run: robojackson robots add {name}"
        )
    return path


def _in_package(description: RobotDescription, package: str, inside: str) -> Path:
    found = importlib.util.find_spec(package) if package.isidentifier() else None
    if found is None or found.origin is None:
        raise BadConfiguration(
            f"{where(description, 'mjcf')}: package {package!r} is not installed"
        )
    folder = Path(found.origin).parent
    if not (folder / inside).resolve().is_relative_to(folder.resolve()):
        raise BadConfiguration(f"{where(description, 'mjcf')}: {inside} is not in {package!r}")
    return folder / inside


def compiled(description: RobotDescription, path: Path) -> mujoco.MjModel:
    """Return the model with the keypoint sites, a floor, and scaled motors."""
    try:
        spec = described_spec(description, path)
        with limited_memory():
            model = spec.compile()
    except FAULTS as error:
        raise _unreadable(description, error) from error
    model.actuator_gear[:] *= description.gear_scale
    require_sound(model, where(description, "mjcf"))
    return model


def described_spec(description: RobotDescription, path: Path) -> mujoco.MjSpec:
    """Return the MJCF with keypoint sites, a floor and the physics of the description."""
    silence_mujoco()
    spec = read_spec(path, description)
    bodies = [body.name for body in spec.bodies if body.name != "world"]
    _add_sites(spec, description, bodies)
    add_floor(spec)
    apply_physics(spec, description)
    return spec


def model_sha256(path: Path) -> str:
    """Return the digest of an MJCF; where it includes other files or has meshes, of all of them."""
    digests = [hashlib.sha256(file.read_bytes()) for file in files_of(path)]
    if len(digests) == 1:
        return digests[0].hexdigest()
    return hashlib.sha256(b"".join(digest.digest() for digest in digests)).hexdigest()


def read_spec(path: Path, description: RobotDescription) -> mujoco.MjSpec:
    """Return the MJCF as it is, but that its bodies and joints all have names.

    Raises:
        BadConfiguration: MuJoCo cannot read it.
    """
    require_model_files(path, where(description, "mjcf"))
    try:
        with limited_memory():
            return named_spec(path)
    except FAULTS as error:
        raise _unreadable(description, error) from error


def _unreadable(description: RobotDescription, error: Exception) -> BadConfiguration:
    return BadConfiguration(f"{where(description, 'mjcf')}: {first_line(error)}")


def _add_sites(spec: mujoco.MjSpec, description: RobotDescription, bodies: list[str]) -> None:
    missing = [key for key in KEYPOINTS if key not in description.sites]
    if set(TOES) & set(description.sites):
        missing += [toe for toe in TOES if toe not in description.sites]
    if missing:
        raise BadConfiguration(f"{where(description, 'sites')}: missing {', '.join(missing)}")
    taken = {site.name for site in spec.sites}
    for key, (body, position) in description.sites.items():
        known("keypoint", key, KEYPOINTS + TOES, where(description, "sites"))
        known("body", body, bodies, where(description, f"sites.{key}"))
        name = f"{_OURS}{key}" if key in taken else key
        spec.body(body).add_site(name=name, pos=list(position), size=[0.02, 0.02, 0.02])
