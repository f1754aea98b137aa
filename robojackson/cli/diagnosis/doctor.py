"""Report what is installed and what is missing, with the command that installs each part.
Imports no Prefect."""

import ctypes
import shlex
import sys
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, distributions, requires, version
from typing import Any

from robojackson.cli.console import lines
from robojackson.cli.lifetime.interruption import program
from robojackson.clips.web import javascript_runtimes
from robojackson.pipeline.app_folder import is_checkout

PYTHONS = ((3, 11), (3, 12), (3, 13))
"""The versions that pyproject.toml allows and the tests run on."""
GRAPHICS = {
    "libEGL.so.1": "libegl1",
    "libGLESv2.so.2": "libgles2",
    "libOpenGL.so.0": "libopengl0",
}
REQUIRED = (
    "mediapipe",
    "mujoco",
    "gymnasium",
    "torch",
    "stable-baselines3",
    "sb3-contrib",
    "prefect",
    "fastapi",
    "numpy",
    "scipy",
    "pyarrow",
    "pydantic",
    "opencv-python-headless",
    "av",
    "yt-dlp",
    "duckdb",
)
OPTIONAL = {"sbx-rl": "fast", "s3fs": "s3", "prefect-dask": "dask", "prefect-ray": "ray"}
"""Packages to the extras that install them."""
CUDA = ("nvidia-", "cuda-")
"""Beginnings of what torch requires in its build for CUDA."""
OTHER_OPENCV = ("opencv-python", "opencv-contrib-python", "opencv-contrib-python-headless")
MODELS = ("lite", "full", "heavy")
NEEDED_MODELS = ("lite", "full")


def examine() -> dict[str, Any]:
    """Return versions, system libraries and pose models; `missing` and `optional` hold remedies."""
    packages = {name: installed(name) for name in (*REQUIRED, *OPTIONAL)}
    libraries = {name: loads(name) for name in GRAPHICS}
    models = {size: model(size) for size in MODELS}
    missing = unsupported(sys.version_info[:2])
    python_supported = not missing
    missing += [f"{name}: {_again()}" for name in REQUIRED if packages[name] is None]
    missing += _system_line(libraries)
    missing += [words for size, words in models.items() if words and size in NEEDED_MODELS]
    hiding = [
        f"{name} hides the headless OpenCV: pip uninstall {name}, then reinstall "
        "opencv-python-headless with --no-deps --force-reinstall"
        for name in OTHER_OPENCV
        if installed(name)
    ]
    works = imports_opencv()
    missing += [] if works else hiding
    optional = hiding if works else []
    optional += [f"{name}: {_extra(of)}" for name, of in OPTIONAL.items() if packages[name] is None]
    optional += _torch_line()
    optional += [words for size, words in models.items() if words and size not in NEEDED_MODELS]
    engine = javascript_runtimes.usable()
    optional += [] if engine else [javascript_runtimes.ADVICE]
    return {
        "ok": not missing,
        "python": sys.version.split()[0],
        "python_supported": python_supported,
        "packages": packages,
        "libraries": libraries,
        "models": {size: not words for size, words in models.items()},
        "javascript": engine,
        "missing": missing,
        "optional": optional,
    }


def doctor_lines(found: Mapping[str, Any]) -> list[str]:
    """Return the lines about `examine`'s findings: one for each missing part, then a verdict."""
    advice = ("missing", "optional")
    rows = [*lines({key: value for key, value in found.items() if key not in advice})]
    rows += [f"{key:<8}  {each}" for key in advice for each in found[key]]
    count = len(found["missing"])
    if count:
        return [*rows, f"{count} required item{'s are' if count > 1 else ' is'} missing."]
    following = shlex.join([program(), "dance"])
    return [*rows, "Everything required is installed.", f"next: {following}"]


def unsupported(version: tuple[int, int]) -> list[str]:
    """Return nothing, or the line that names a supported Python."""
    if version in PYTHONS:
        return []
    known = ", ".join("{}.{}".format(*pair) for pair in PYTHONS)
    return [
        "Python {}.{} is not supported (supported: {}): ".format(*version, known)
        + "run `make setup PYTHON=python{}.{}`".format(*PYTHONS[-1])
    ]


def installed(name: str) -> str | None:
    """Return the version of a package, None where it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def imports_opencv() -> bool:
    """Return whether OpenCV can be imported: packages that hide the headless one need a display's
    libraries, and bring their own where these are there."""
    try:
        import cv2  # noqa: F401
    except ImportError:
        return False
    return True


def _extra(name: str) -> str:
    """Return the command that installs an extra: into a checkout's environment, or beside a
    wheel."""
    if is_checkout():
        return f".venv/bin/pip install -e '.[{name}]'"
    return f"pip install 'robojackson[{name}]'"


def _again() -> str:
    return "run `make` again" if is_checkout() else _extra("app,fast")


def _torch_line() -> list[str]:
    """Return how to replace torch's build for CUDA by the small one; nothing where it is small."""
    needed = requires("torch") or [] if installed("torch") else []
    if not any(each.startswith(CUDA) for each in needed):
        return []
    how = "`make clean`, then `make setup` with TORCH_INDEX set to their address"
    return [
        "torch is its build for CUDA, 4 GB larger than PyTorch's wheels for CPUs, and nothing here "
        f"uses CUDA: {how if is_checkout() else 'install torch from their index'}"
    ]


def opencv_builds() -> list[str]:
    """Return the OpenCV packages in this environment; there should be one."""
    names = {str(d.metadata["Name"]).lower() for d in distributions() if d.metadata["Name"]}
    return sorted(name for name in names if name.startswith("opencv"))


def loads(name: str) -> bool:
    """Return whether the system has a shared library."""
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def model(size: str) -> str:
    """Return nothing, or how to get the pose model of that size."""
    from robojackson.clips.pose_detector import model_path
    from robojackson.errors import MissingDependency

    try:
        model_path(size)
    except MissingDependency as cause:
        return str(cause)
    return ""


def _system_line(libraries: dict[str, bool]) -> list[str]:
    packages = [GRAPHICS[name] for name, found in libraries.items() if not found]
    line = " ".join(("apt-get install --no-install-recommends", *packages, "libgl1-mesa-dri"))
    return [f"system libraries: {line}"] if packages else []
