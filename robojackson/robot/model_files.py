"""The door for robot models: an MJCF or URDF and the files that it names, before MuJoCo opens them.

Every file that it names is a plain file of modest size, and nothing else is opened to find that
out; what MuJoCo makes of it is finite.
"""

import re
from collections.abc import Collection
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from robojackson.errors import BadConfiguration
from robojackson.files.foreign_file import require_file
from robojackson.files.memory_limit import limited_memory

FOLDERS = ("assetdir", "meshdir", "texturedir")
PARTS = ("include", "model")
"""Elements whose file is MJCF again."""
FAULTS = (ValueError, RuntimeError, MemoryError, mujoco.FatalError)
"""What MuJoCo raises for a model that it cannot read."""
MOST_FILES, MOST_PARTS, MOST_COPIES = 1000, 100, 10_000
"""Largest number of files of a model, of those that are MJCF (MuJoCo reads them by recursion), and
of copies."""
COPIES, FILES = (re.compile(rf"\b{word}\s*=\s*[\"']([^\"']*)") for word in ("count", "file"))
NUMBERS = (
    *(
        "body_pos",
        "body_quat",
        "body_mass",
        "body_inertia",
        "geom_pos",
        "geom_size",
        "geom_friction",
    ),
    *("jnt_axis", "jnt_range", "jnt_stiffness", "site_pos", "dof_damping", "dof_armature"),
    *("dof_frictionloss", "actuator_gear", "actuator_gainprm", "actuator_biasprm", "qpos0"),
)
OPTIONS = ("gravity", "wind", "magnetic", "density", "viscosity", "timestep")
LARGEST = 1e6
"""Of any of these, SI units; an infinite range of a joint is MuJoCo's."""
SHORTEST_STEP_S = 1e-6
FAILED_INSIDE = "Caught an unknown exception"
"""MuJoCo's words for a failure of the C++ library, such as a ceiling of memory."""
XML_FAULT = re.compile(r"^XML parse error .*\n.*Line number=(\d+)")
"""How MuJoCo reports a file that is no XML."""


def files_of(path: Path) -> list[Path]:
    """Return a model and every file that it names, as MuJoCo finds them."""
    return _files_and_parts(path)[0]


def _files_and_parts(path: Path) -> tuple[list[Path], list[Path]]:
    """Return all files of a model, and those of them that are MJCF."""
    found, folders, parts = [path], [path.parent], [path]
    for part in parts:  # grows while it is read
        for tag, name in _named_in(part, path.parent, folders):
            for folder in folders:  # MuJoCo reads from one of them
                file = folder / name
                if file.exists() and file not in found and len(found) < MOST_FILES:
                    found.append(file)
                    parts += [file] if tag in PARTS else []
    return found, parts


def _named_in(part: Path, root: Path, folders: list[Path]) -> list[tuple[str, str]]:
    """Return (element, name) of the files that one MJCF names; add its folders to `folders`."""
    if not part.is_file():  # a pipe has no end
        return []
    try:
        tree = ElementTree.parse(part)
    except ElementTree.ParseError:  # MuJoCo reads what is no strict XML, too
        return [(PARTS[0], name) for name in FILES.findall(part.read_text(errors="replace"))]
    for compiler in tree.iter("compiler"):
        folders += [root / compiler.get(name, "") for name in FOLDERS]
    named = [(each.tag, name) for each in tree.iter() if (name := each.get("file"))]
    meshes = [(each.tag, name) for each in tree.iter() if (name := each.get("filename"))]
    for tag, name in meshes:  # of URDF, in a package; MuJoCo takes the last part
        plain = name.partition("://")[2] or name
        named += [(tag, plain), (tag, plain.rsplit("/", 1)[-1])]
    return named


def require_model_files(path: Path, place: str) -> None:
    """Refuse a model that names devices, huge files or endless copies.

    Args:
        place: First words of its errors.

    Raises:
        BadConfiguration: the line names the file.
    """
    files, parts = _files_and_parts(path)
    if len(parts) > MOST_PARTS:
        raise BadConfiguration(f"{place}: more than {MOST_PARTS} files that include one another")
    for file in files:
        try:
            require_file(file, BadConfiguration)
        except BadConfiguration as cause:
            raise BadConfiguration(f"{place}: {cause}") from cause
        if file.suffix.lower() in (".xml", ".mjcf", ".urdf"):
            text = file.read_text(errors="replace")
            numbers = (word for found in COPIES.findall(text) for word in found.split())
            copies = [float(word) for word in numbers if re.fullmatch(r"\d+(\.\d+)?", word)]
            if np.prod(copies or [1.0]) > MOST_COPIES:
                raise BadConfiguration(f"{place}: {file}: more than {MOST_COPIES:,} copies")


def require_sound(model: mujoco.MjModel, place: str) -> None:
    """Refuse a compiled model whose numbers are not finite, or beyond what a robot can have.

    Raises:
        BadConfiguration: the line names the numbers.
    """
    checked = {name: getattr(model, name) for name in NUMBERS}
    checked |= {f"option {name}": getattr(model.opt, name) for name in OPTIONS}
    for name, values in checked.items():
        if not (np.abs(values) < LARGEST).all():
            raise BadConfiguration(
                f"{place}: {name} holds numbers that are not finite, or too large"
            )
    for name in (name for name in dir(model) if not name.startswith("_")):
        values = getattr(model, name)
        if isinstance(values, np.ndarray) and values.dtype.kind == "f" and np.isnan(values).any():
            raise BadConfiguration(f"{place}: {name} holds NaN")
    if not model.opt.timestep >= SHORTEST_STEP_S:
        raise BadConfiguration(
            f"{place}: a time step of {model.opt.timestep:g} s; at least {SHORTEST_STEP_S:g} s"
        )


def read_model(path: Path) -> mujoco.MjModel:
    """Return a model as it is, compiled.

    Raises:
        BadConfiguration: MuJoCo cannot read it, or its format is not accepted.
    """
    require_model_files(path, str(path))
    silence_mujoco()
    try:
        with limited_memory():
            model = named_spec(path).compile()
    except FAULTS as cause:
        raise BadConfiguration(f"{path}: {first_line(cause)}") from cause
    require_sound(model, str(path))
    return model


def named_spec(path: Path) -> mujoco.MjSpec:
    """Return a model as it is, but that its bodies and joints all have names.

    One without a name becomes `body_7` or `joint_7`, by its place in the file, so that files and
    descriptions can name it; a free joint, which they do not name, stays as it is.
    """
    spec = mujoco.MjSpec.from_file(str(path))
    for kind, parts in (("body", spec.bodies), ("joint", spec.joints)):
        taken = {part.name for part in parts}
        for place, part in enumerate(parts):
            if not part.name and not (kind == "joint" and _is_free(part)):
                part.name = free_name(f"{kind}_{place}", taken)
                taken.add(part.name)
    return spec


def _is_free(joint: mujoco.MjsJoint) -> bool:
    """Return whether a joint of a spec is a free one."""
    return bool(joint.type == mujoco.mjtJoint.mjJNT_FREE)


def free_name(name: str, taken: Collection[str]) -> str:
    """Return a name, with as many underscores behind it as make it no name that is taken."""
    while name in taken:
        name += "_"
    return name


def first_line(error: Exception) -> str:
    """Return MuJoCo's reason in one line."""
    lines = str(error).splitlines() or [type(error).__name__]
    if found := XML_FAULT.search(str(error)):
        return f"not XML, which MJCF and URDF are, from line {found[1]} on"
    is_full = isinstance(error, MemoryError) or FAILED_INSIDE in lines[0]
    return "not enough memory for this model" if is_full else lines[0]


def silence_mujoco() -> None:
    """Keep MuJoCo's warnings out of the terminal and of a MUJOCO_LOG.TXT where the user stands.

    A simulation that diverges, as a robot that just learns to stand does, is counted in
    `data.warning`, which ends the episode.
    """
    config = mujoco.MjLogConfig.get()
    config.logto_console = config.logto_file = False
    mujoco.MjLogConfig.set(config)
