"""The door for robot models: an MJCF or URDF and the files that it names, before MuJoCo opens them.

Every file that it names is a plain file of modest size; what MuJoCo makes of it is finite.
"""

import re
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
MOST_FILES, MOST_COPIES = 1000, 10_000
COPIES = re.compile(r"count\s*=\s*[\"']([^\"']*)")
NUMBERS = (
    *("body_pos", "body_quat", "body_mass", "body_inertia", "geom_pos", "geom_size", "jnt_axis"),
    *("jnt_range", "site_pos", "dof_damping", "dof_armature", "actuator_gear", "qpos0"),
)
LARGEST = 1e6
"""Of any of these, SI units; an infinite range of a joint is MuJoCo's."""


def files_of(path: Path) -> list[Path]:
    """Return a model and every file that it names, as MuJoCo finds them."""
    found, folders, texts = [path], [path.parent], [path]
    for text in texts:  # grows while it is read
        try:
            tree = ElementTree.parse(text)
        except ElementTree.ParseError:  # MuJoCo reads what is no strict XML, too
            continue
        for compiler in tree.iter("compiler"):
            folders += [path.parent / compiler.get(name, "") for name in FOLDERS]
        for element in (each for each in tree.iter() if each.get("file")):
            places = [folder / element.get("file", "") for folder in folders]
            file = next((place for place in places if place.exists()), None)
            if file is not None and file not in found and len(found) < MOST_FILES:
                found.append(file)
                texts += [file] if element.tag in PARTS else []
    return found


def require_model_files(path: Path, place: str) -> None:
    """Refuse a model that names devices, huge files or endless copies.

    Args:
        place: How errors begin.

    Raises:
        BadConfiguration: the line names the file.
    """
    for file in files_of(path):
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
    for name in NUMBERS:
        values = getattr(model, name)
        if not (np.abs(values) < LARGEST).all():
            raise BadConfiguration(
                f"{place}: {name} holds numbers that are not finite, or too large"
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
            model = mujoco.MjModel.from_xml_path(str(path))
    except FAULTS as cause:
        raise BadConfiguration(f"{path}: {first_line(cause)}") from cause
    require_sound(model, str(path))
    return model


def first_line(error: Exception) -> str:
    """Return MuJoCo's reason in one line."""
    lines = str(error).splitlines() or [type(error).__name__]
    return "not enough memory for this model" if isinstance(error, MemoryError) else lines[0]


def silence_mujoco() -> None:
    """Keep MuJoCo's warnings out of the terminal and of a MUJOCO_LOG.TXT where the user stands.

    A simulation that diverges, as a robot that just learns to stand does, is counted in
    `data.warning`, which ends the episode.
    """
    config = mujoco.MjLogConfig.get()
    config.logto_console = config.logto_file = False
    mujoco.MjLogConfig.set(config)
