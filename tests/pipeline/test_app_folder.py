"""Where flows and configs are, and what a pull step does to a worker's process."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from robojackson.pipeline import app_folder

ROOT = Path(__file__).parents[2]
CODE = """
import os, sys
from robojackson.pipeline.app_folder import use_app_folder
first, second = use_app_folder(), use_app_folder()
assert first == second
configs = os.environ.get("ROBOJACKSON_CONFIGS")
print(first["directory"], sys.path[0], os.environ["PYTHONPATH"], configs)
import flows.dance
"""


def run(folder: Path) -> list[str]:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("ROBOJACKSON")}
    environment["PYTHONPATH"] = str(ROOT)
    done = subprocess.run(
        [sys.executable, "-c", CODE], cwd=folder, env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_in_a_checkout_it_is_the_root() -> None:
    assert app_folder.app_folder() == ROOT
    assert app_folder.is_checkout()


@pytest.mark.slow
def test_it_comes_first_once_for_the_process_and_its_children(tmp_path: Path) -> None:
    directory, first, inherited, configs = run(tmp_path)
    assert directory == first == inherited == str(ROOT)
    assert configs == "None"


@pytest.mark.medium
def test_the_users_configs_keep_their_place(tmp_path: Path) -> None:
    (tmp_path / "configs").mkdir()
    assert run(tmp_path)[3] == str(tmp_path / "configs")


def test_every_deployment_pulls_by_it() -> None:
    steps = yaml.safe_load((ROOT / "prefect.yaml").read_text())["pull"]
    (name,) = (key for step in steps for key in step)
    module, _, function = name.rpartition(".")
    assert module == app_folder.__name__
    assert callable(getattr(app_folder, function))
