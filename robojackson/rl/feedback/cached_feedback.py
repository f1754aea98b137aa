"""The linear feedback that drives a robot along its reference, without learning.

`regulator` computes it once for a motion, robot and control law; the result is cached beside the
added robots, because it takes a few seconds of processor time for every second of motion.
"""

import hashlib
import io
import json
import tokenize
import zlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import fields, replace
from pathlib import Path
from zipfile import BadZipFile

import mujoco
import numpy as np

from robojackson.errors import StoreError
from robojackson.files.file_tree import FileTree
from robojackson.motion.reference_motion import ReferenceMotion, poses_sha256
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.feedback import sampled_regulator
from robojackson.rl.feedback.feedback_law import Feedback
from robojackson.rl.feedback.nominal_path import Gains, Progress, no_progress
from robojackson.rl.feedback.path_trial import LARGEST_MOVE
from robojackson.rl.feedback.regulator import regulator, settings
from robojackson.rl.feedback.search_log import SearchLog
from robojackson.rl.feedback.standing_feet import Feet
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.motors import (
    actuation_facts,
    feedback_path,
    feedback_share,
    residual_scale,
)
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation, resolved
from robojackson.robot.description import description_sha256
from robojackson.robot.mjcf import robots_folder
from robojackson.robot.model import Robot

FOLDER = "feedback"
ARRAYS = tuple(one.name for one in fields(Gains))
ROUNDED, SINGLE = ("gain", "offset"), np.float32
"""Arrays that are kept in single precision."""
DAMAGED = (
    *(OSError, EOFError, ValueError, KeyError, SyntaxError, NotImplementedError, RuntimeError),
    *(BadZipFile, zlib.error, tokenize.TokenError),
)
"""What reading a damaged file raises: it is computed again."""
VARIED = (
    *("body_mass", "body_ipos", "body_inertia", "geom_friction", "pair_friction", "dof_armature"),
)
"""Arrays of a model that `variation` changes."""
NAMED_FACTOR = 4.0
"""`robust_action_factor` by which gains are named, which do not depend on it: that of the G1 when
the first were kept."""
LARGEST = 2.0
"""Largest offset of a target by the feedback, in full actions of a policy: small enough that a
policy of a few minutes can correct it."""


def feedback_of(
    robot: Robot,
    references: Sequence[ReferenceMotion],
    control: ControlConfig,
    progress: Progress = no_progress,
) -> Feedback | None:
    """Return the feedback along motions; None where the control law has none.

    Args:
        progress: Called with a name, the steps that are done, and all; log lines without it.
    """
    share = feedback_share(robot.description, control)
    if not share or control.law != "pd":
        return None
    found = [_cached(robot, motion, control, progress) for motion in references]
    joined = Gains(*(np.concatenate([getattr(one, name) for one in found])
                     for name in ARRAYS))  # fmt: skip
    action = residual_scale(robot, ControlConfig())
    scaled = replace(joined, gain=share * joined.gain, offset=share * joined.offset)
    most = LARGEST if feedback_path(robot, control) == "reference" else LARGEST_MOVE
    return Feedback(scaled, most * action, Feet(robot))


def keep_feedback(
    robot: Robot, motion: ReferenceMotion, control: ControlConfig, gains: Gains
) -> None:
    """Keep the gains of a motion that were computed elsewhere, for `feedback_of`."""
    _keep(_path(robot, motion, control), _single(gains))


def _path(robot: Robot, motion: ReferenceMotion, control: ControlConfig) -> Path:
    return robots_folder().parent / FOLDER / f"{_digest(robot, motion, control)}.npz"


def _cached(
    robot: Robot, motion: ReferenceMotion, control: ControlConfig, progress: Progress
) -> Gains:
    """Return the regulator of a motion, from the cache or computed."""
    path = _path(robot, motion, control)
    if path.is_file():
        with suppress(*DAMAGED), np.load(path, allow_pickle=False) as arrays:
            found = Gains(*(arrays[name].astype(float) for name in ARRAYS))
            if _fits(found, robot, motion):
                return found
    heard = SearchLog(len(motion) * motion.dt) if progress is no_progress else progress
    gains = _single(regulator_of(robot, motion, control, heard))
    _keep(path, gains)
    return gains


def _single(gains: Gains) -> Gains:
    """Return gains rounded as they are kept, so that the run that computes them and those that read
    them are the same to the bit."""
    rounded = {name: getattr(gains, name).astype(SINGLE).astype(float) for name in ROUNDED}
    return replace(gains, **rounded)


def _fits(gains: Gains, robot: Robot, motion: ReferenceMotion) -> bool:
    """Return whether gains have the shapes of a motion of the robot, and finite numbers."""
    steps, model = len(motion), robot.model
    sizes = {
        "gain": (steps, model.nu, 2 * model.nv),
        "offset": (steps, model.nu),
        "qpos": (steps, model.nq),
        "qvel": (steps, model.nv),
        "places": (steps, Feet(robot).count, 3),
    }
    arrays = {name: getattr(gains, name) for name in sizes}
    return all(arrays[name].shape == size for name, size in sizes.items()) and all(
        np.isfinite(array).all() for name, array in arrays.items() if name != "places"
    )


def _keep(path: Path, gains: Gains) -> None:
    content = io.BytesIO()
    arrays = {name: getattr(gains, name) for name in ARRAYS}
    arrays |= {name: arrays[name].astype(SINGLE) for name in ROUNDED}
    np.savez_compressed(content, **arrays)
    with suppress(StoreError):  # a read-only store: computed again next time
        FileTree(path.parent).write(path.name, content.getvalue())


def regulator_of(
    robot: Robot,
    motion: ReferenceMotion,
    control: ControlConfig,
    progress: Progress = no_progress,
) -> Gains:
    """Compute the regulator of a motion under a control law."""
    plain = replace(control, feedback=0.0)
    sim = Simulation(robot, plain, 1)
    clip = Clip(motion, lead_of(robot, motion, control))
    action = residual_scale(robot, ControlConfig())
    if feedback_path(robot, control) == "reference":
        return regulator(sim, clip, action, Feet(robot).count, progress)[0]
    return sampled_regulator.sampled_regulator(robot, sim, clip, action, progress=progress)


def _digest(robot: Robot, motion: ReferenceMotion, control: ControlConfig) -> str:
    """Return a digest of the gains' inputs, as a name.

    The digest of the poses is that of policies, and leaves out how far a cycle travels and the
    speeds, on which the gains at its seam and the nominal states depend.
    """
    law = resolved(replace(control, feedback=0.0), robot)
    named = {name: getattr(law, name) for name in ("substeps", "feedforward", "feedback_path")}
    motors = actuation_facts(robot, control)
    del motors["action_scale"]  # of the policy: the feedback is bounded by the robot's own
    described = replace(robot.description, robust_action_factor=NAMED_FACTOR)
    facts = [poses_sha256(motion), robot.sha256, named, actuation_facts(robot, ControlConfig()),
             motors, settings(), description_sha256(described, robot.joint_names),
             robot.contact_names, mujoco.__version__]  # fmt: skip
    if law.feedback_path == "sampled":
        facts.append(sampled_regulator.settings())
    digest = hashlib.sha256(json.dumps(facts, sort_keys=True).encode())
    for moved in (motion.cycle_offset, motion.qvel):
        digest.update(np.ascontiguousarray(moved, float).tobytes())
    model = robot.model
    for name in VARIED:  # a varied robot has the same name and file
        digest.update(np.ascontiguousarray(getattr(model, name)).tobytes())
    digest.update(f"{model.opt.timestep} {model.opt.integrator}".encode())
    return digest.hexdigest()[:32]
