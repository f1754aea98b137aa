"""What the deploy packs of a policy and of a tracker have in common."""

import logging
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Int

from robojackson.api.arguments import FilePath
from robojackson.errors import BadConfiguration, BadPolicy, StoreError
from robojackson.files.file_tree import results_in
from robojackson.files.foreign_file import read_json
from robojackson.formats.deploy.deployed_machine import DeployedMachine, places_in_mjcf
from robojackson.formats.deploy.licence_passport import Ingredient, together
from robojackson.formats.deploy.pack_files import OF_SOME
from robojackson.formats.deploy.pack_readme import Figures
from robojackson.motion.reference_motion import ReferenceMotion, poses_sha256
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.sim.motors import Motors, gains
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot

log = logging.getLogger(__name__)

REFERENCE, EVALUATION = "reference.parquet", "evaluation.json"
SETTINGS = "deploy.yaml"


def motor_of_hinge(robot: Robot) -> Int[np.ndarray, " J"]:
    """Return the motor of every hinge.

    Raises:
        BadPolicy: the robot has hinges without a motor.
    """
    hinge, count = Motors.of(robot.model).hinge, len(robot.joint_names)
    if sorted(hinge.tolist()) != list(range(count)):
        raise BadPolicy(
            f"robot {robot.description.name!r} has {len(hinge)} motors for {count} hinges: a "
            "deploy pack needs one motor a hinge"
        )
    result: np.ndarray = np.argsort(hinge)
    return result


def machine_of(robot: Robot, reference: ReferenceMotion, control: ControlConfig) -> DeployedMachine:
    """Return robot and motion in the order of the hinges.

    Raises:
        BadPolicy: the robot has hinges without a motor.
    """
    motor = motor_of_hinge(robot)
    stiffness, damping = (each[motor] for each in gains(robot, control))
    return DeployedMachine(
        model=robot.model,
        reference=reference,
        root=robot.description.root_body,
        default=robot.standing[7:],
        stiffness=stiffness,
        damping=damping,
        torque_limit=Motors.of(robot.model).limit[motor],
        speed_limit=robot.actuation.speed_limit,
        fall_tilt=Fall.of(robot).tilt,
        places=places_in_mjcf(robot),
    )


def beside(policy: Path, given: FilePath | None, name: str, option: str) -> Path:
    """Return the file given, or the one of that name beside the policy or one folder up.

    Raises:
        StoreError: there is none.
    """
    places = [Path(given)] if given else [f / name for f in (policy.parent, policy.parent.parent)]
    path = next((place for place in places if place.is_file()), None)
    if path is None:
        raise StoreError(
            f"no {name} at {' or '.join(map(str, places))}: give it with {option} FILE"
        )
    return path


def own_evaluation(
    of: str,
    command: str,
    folder: Path,
    given: FilePath | None,
    motion: ReferenceMotion,
    fits: Callable[[Figures], bool],
) -> Figures | None:
    """Return the figures of an evaluation that is given or lies in a folder; None where neither is
    of what goes into the pack.

    Args:
        of: What goes into the pack.
        command: The command that evaluates it.
        motion: The motion of the pack; evaluations of before December 2026 do not name theirs.
        fits: Whether an evaluation is of it.

    Raises:
        StoreError, BadConfiguration: the given file is missing, no evaluation or of something else.
    """
    found = _evaluation_in(folder, given)
    if found is None:
        return None
    own = poses_sha256(motion)
    theirs = str(found.get("reference_sha256", own))
    if not fits(found):
        fault = f"not an evaluation of {of}"
    elif theirs != own:
        fault = f"an evaluation on another motion (sha256 {theirs[:12]}, here {own[:12]})"
    else:
        return found
    reason = (
        f"{given or folder / EVALUATION} is {fault}: make one with `{command} --passport -o DIR`"
    )
    if given is not None:
        raise BadConfiguration(reason)
    log.warning("no figures in the pack: %s", reason)
    return None


def _evaluation_in(folder: Path, given: FilePath | None) -> Figures | None:
    """Return the figures of an evaluation; None where none is given and none is in the folder."""
    path = Path(given) if given else folder / EVALUATION
    path = path / EVALUATION if path.is_dir() else path
    if given is None and not path.is_file():
        return None
    found = read_json(path, BadConfiguration)
    if not isinstance(found, dict):
        raise BadConfiguration(f"{path}: not what `robojackson evaluate` writes")
    return found


def write_pack(
    folder: Path,
    files: Mapping[str, bytes],
    ingredients: list[Ingredient],
    evaluation: Figures | None,
) -> Figures:
    """Write the files of a pack, in place of those of an earlier one; return what was written, its
    passport and its licences.

    Raises:
        StoreError: they cannot be written, or the folder holds such files and is no pack.
    """
    replaces = (folder / SETTINGS).is_file()
    if not replaces:
        _require_free(folder, files)
    with results_in(folder) as tree:
        # The settings first, by which the folder is a pack, should this be interrupted.
        for name in sorted(files, key=lambda name: name != SETTINGS):
            tree.write(name, files[name])
        for name in OF_SOME - set(files) if replaces else ():
            tree.remove(name)
    rows = (evaluation or {}).get("passport") or []
    weakest = min(rows, key=_strict_of, default=None)
    return {
        "files": sorted(files),
        "passport_cases": len(rows),
        "weakest_case": weakest and weakest["case"],
        "weakest_strict_success": weakest and _strict_of(weakest),
        "licences": together(ingredients),
        "unknown_licences": sorted({one.kind for one in ingredients if not one.is_known}),
    }


def _require_free(folder: Path, names: Iterable[str]) -> None:
    """Refuse a folder in which a pack would replace files of something else."""
    for name in sorted(names):
        if (folder / name).exists():
            raise StoreError(
                f"{folder / name}: of something else, since {folder} has no {SETTINGS}, and a pack "
                "here would replace it; give another folder (-o)"
            )


def _strict_of(row: Figures) -> float:
    """Return strict success of a row of the passport."""
    return float(row["strict_success"])
