"""The folder of flows, tasks, storage, configs and bundled clips.

In a checkout it is the root of the repository. In an installed package it is `robojackson/_app`, so
that only `robojackson` can be imported from site-packages. `import robojackson` needs neither; the
command line and Prefect's workers put the folder on their own process's path.
"""

import os
import sys
from pathlib import Path

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


def use_app_folder() -> dict[str, str]:
    """Make the flows importable in this process and its children; a pull step of the deployments.

    Runs again without effect. A folder `./configs` keeps its place when the working directory
    changes.

    Returns:
        `directory`: the app folder, where a worker then runs the flow.
    """
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
