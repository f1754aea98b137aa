"""The folder of flows, tasks, storage, configs and bundled clips.

In a checkout it is the root of the repository. In an installed package it is `robojackson/_app`, so
that only `robojackson` can be imported from site-packages. `import robojackson` needs neither; the
command line and Prefect's workers put the folder on their own process's path.
"""

import os
import sys
from pathlib import Path

from robojackson.errors import BadConfiguration
from robojackson.files.local_folder import folder_of
from robojackson.files.store_files import VARIABLE as STORE

PACKAGE = Path(__file__).parents[1]
BUNDLED = "_app"
CONFIGS = "ROBOJACKSON_CONFIGS"
"""Variable: the user's folder of YAML files, which win over the shipped ones."""


def app_folder() -> Path:
    """Return the folder that holds `flows`, `configs`, `clips` and prefect.yaml."""
    bundled = PACKAGE / BUNDLED
    return bundled if bundled.is_dir() else PACKAGE.parent


def is_checkout() -> bool:
    """Return whether the package is used from a checkout and not from site-packages."""
    return (app_folder() / "pyproject.toml").is_file()


def use_app_folder(for_worker: bool = False) -> dict[str, str]:
    """Make the flows importable in this process and its children; a pull step of the deployments.

    Runs again without effect. A folder `./configs` keeps its place when the working directory
    changes.

    Args:
        for_worker: Whether a worker will run a flow in the app folder.
    Returns:
        `directory`: the app folder, where a worker then runs the flow.
    Raises:
        BadConfiguration: the worker's results would be among the files of the installed package.
    """
    if for_worker and not is_checkout():
        _require_store()
    folder = str(app_folder())
    if CONFIGS not in os.environ and Path("configs").is_dir():
        os.environ[CONFIGS] = str(Path("configs").absolute())
    if folder in sys.path:
        sys.path.remove(folder)
    sys.path.insert(0, folder)
    inherited = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    os.environ["PYTHONPATH"] = os.pathsep.join(
        [folder, *(each for each in inherited if each and each != folder)]
    )
    return {"directory": folder}


def _require_store() -> None:
    """Raise where a path of the store depends on the working directory."""
    given = os.environ.get(STORE, "")
    folder = folder_of(given)
    if not given or (folder is not None and not folder.is_absolute()):
        raise BadConfiguration(
            f"{STORE} is {given or 'not set'}, and a worker runs in {app_folder()}: its results "
            "would be among the package's files; start the worker with the absolute path of a "
            f"folder in {STORE}, or with an address"
        )
