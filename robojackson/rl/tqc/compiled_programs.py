"""Keep what XLA compiles in the user's cache, so that the next process need not compile it."""

import hashlib
import os
import platform
import warnings
from pathlib import Path

import jax

from robojackson.files.local_folder import user_cache

_PROCESSOR = Path("/proc/cpuinfo")
_FOLDER = "jax_compilation_cache_dir"
_ALL_PROGRAMS: dict[str, float] = {
    "jax_persistent_cache_min_compile_time_secs": 0.0,
    "jax_persistent_cache_min_entry_size_bytes": -1,
}
"""Small ones, too: JAX keeps only what took a second."""


def keep_compiled_programs() -> None:
    """Let JAX read and write compiled programs in the user's cache.

    A folder that `JAX_COMPILATION_CACHE_DIR` names stays. Nothing is kept where the cache cannot be
    written or is not this user's alone: who may write there may run code as this user. A broken
    file in it is compiled again.
    """
    if jax.config.values[_FOLDER]:
        return
    folder = compiled_folder()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        private = is_private(folder)
    except OSError:
        return
    if not private:
        return
    warnings.filterwarnings("ignore", "Error (reading|writing) persistent compilation cache")
    for name, value in {_FOLDER: str(folder), **_ALL_PROGRAMS}.items():
        jax.config.update(name, value)  # type: ignore[no-untyped-call]


def compiled_folder() -> Path:
    """Return the folder of this kind of processor: what runs on one may not run on another."""
    kind = hashlib.sha256(_instructions().encode()).hexdigest()[:12]
    return user_cache() / "compiled" / kind


def is_private(folder: Path) -> bool:
    """Return whether the folder is this user's and no other user may write in it."""
    if not hasattr(os, "getuid"):
        return True
    state = folder.stat()
    return state.st_uid == os.getuid() and not state.st_mode & 0o022


def _instructions() -> str:
    """Return the name of the machine's processor and, on Linux, its instruction sets."""
    name = f"{platform.machine()} {platform.processor()}"
    if not _PROCESSOR.is_file():
        return name
    lines = _PROCESSOR.read_text(errors="replace").splitlines()
    sets = next((line for line in lines if line.startswith(("flags", "Features"))), "")
    return f"{name} {' '.join(sorted(sets.split()))}"
