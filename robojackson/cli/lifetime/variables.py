"""Check the environment: raise for variables that would break a library, before it loads.

Imports only the standard library, since this runs before everything else.
"""

import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from urllib.parse import urlsplit

from robojackson.errors import BadConfiguration

GRAPHICS = ("", "disable", "disabled", "off", "false", "0", "egl", "osmesa", "glfw", "on", "true")
PLATFORMS = ("", "cpu", "cuda", "gpu", "rocm", "tpu", "metal")
STORES = ("file", "s3", "s3a", "gs", "gcs", "abfs", "az", "memory")
OSMESA = "osmesa"
LOG_LEVELS = ("DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL")
MOST_THREADS = 4096
SECRET = re.compile(r"//[^/@]*@")
"""User and password in an address."""


def check_environment(given: Mapping[str, str]) -> None:
    """Raise for variables whose values no library of ours can use.

    Raises:
        BadConfiguration: the line names the variable, its value and what is allowed.
    """
    for name, fault in CHECKS.items():
        value = given.get(name)
        if value and (reason := fault(value)):
            shown = SECRET.sub("//***@", value)
            raise BadConfiguration(f"{name} is {shown!r:.200}: {reason}")


def _one_of(*allowed: str) -> Callable[[str], str]:
    def fault(value: str) -> str:
        wrong = set(value.lower().split(",")) - set(allowed)
        return f"expected one of {', '.join(filter(None, allowed))}" if wrong else ""

    return fault


def _backend(value: str) -> str:
    """Return the fault of a graphics backend: MuJoCo takes one word, not a list."""
    return _one_of(*GRAPHICS)(value.replace(",", " ")) or _without_library(value)


def _platform(value: str) -> str:
    return _one_of("", "egl", OSMESA, "glx", "x11", "linux")(value) or _without_library(value)


def _without_library(value: str) -> str:
    """Return the fault of OSMesa where its library is missing, which PyOpenGL does not name."""
    if value.lower() != OSMESA or _has_osmesa():
        return ""
    return (
        "OSMesa's library is not installed: unset the variable (EGL needs no screen either), or "
        "apt-get install libosmesa6"
    )


def _has_osmesa() -> bool:
    import ctypes.util

    try:
        ctypes.CDLL(ctypes.util.find_library("OSMesa") or "libOSMesa.so")
    except OSError:
        return False
    return True


def _level(value: str) -> str:
    levels = f"expected one of {', '.join(LOG_LEVELS)}"
    return "" if value.upper() in LOG_LEVELS or value.isdigit() else levels


def _flags(value: str) -> str:
    """Return the fault of XLA's flags: XLA ends the process for an unknown flag and skips other
    words."""
    dashed = [word for word in value.split() if word.startswith("-")]
    wrong = not dashed or any(not word.startswith("--xla") for word in dashed)
    return "flags of XLA begin with --xla" if wrong else ""


def _threads(value: str) -> str:
    first = value.split(",")[0].strip()
    is_right = first.isdecimal() and 0 < int(first) <= MOST_THREADS
    return "" if is_right else "expected a number of threads"


def _flag(value: str) -> str:
    return _one_of("0", "1", "true", "false", "yes", "no", "on", "off")(value)


def _address(value: str) -> str:
    fault = "expected an address such as http://127.0.0.1:4200/api"
    try:
        parts = urlsplit(value)
        parts.port  # noqa: B018 (raises for an invalid port)
    except ValueError:
        return fault
    return "" if parts.scheme in ("http", "https") and parts.hostname else fault


def _store(value: str) -> str:
    scheme, colon, rest = value.partition("://")
    if (rest or value).startswith("~"):
        return "a shell expands ~ only outside of quotation marks; write the whole path"
    if not colon:
        return _folder(value)
    if scheme not in STORES:
        return f"expected a folder, or an address of {', '.join(STORES)}"
    if scheme == "file":
        return _folder(rest)
    return "" if rest.strip("/") else "the address names no bucket"


def _folder(value: str) -> str:
    try:
        path = Path(value).expanduser()
        found = next((each for each in (path, *path.absolute().parents) if each.exists()), None)
    except (OSError, ValueError, RuntimeError) as cause:
        return getattr(cause, "strerror", None) or "no folder can have this name"
    if found is not None and not found.is_dir():
        return f"{found} is not a folder"
    return "" if value.isprintable() else "it holds characters that cannot be printed"


def _existing(value: str) -> str:
    return _folder(value) or ("" if Path(value).is_dir() else "there is no such folder")


CHECKS: Mapping[str, Callable[[str], str]] = {
    "ROBOJACKSON_STORE": _store,
    "ROBOJACKSON_CONFIGS": _existing,
    "MUJOCO_GL": _backend,
    "PYOPENGL_PLATFORM": _platform,
    "JAX_PLATFORMS": _one_of(*PLATFORMS),
    "JAX_PLATFORM_NAME": _one_of(*PLATFORMS),
    "JAX_ENABLE_X64": _flag,
    "JAX_DEBUG_NANS": _flag,
    "XLA_FLAGS": _flags,
    "OMP_NUM_THREADS": _threads,
    "PREFECT_HOME": _folder,
    "PREFECT_API_URL": _address,
    "PREFECT_LOGGING_LEVEL": _level,
    "PREFECT_LOGGING_ROOT_LEVEL": _level,
    "XDG_CACHE_HOME": _folder,
}
"""Functions that return the fault of a variable's value; empty where there is none."""


def quieten(environment: "os._Environ[str]") -> None:
    """Set variables with one right value: matplotlib draws to files, whatever the shell's
    setting."""
    environment["MPLBACKEND"] = "agg"
