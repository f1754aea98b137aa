"""Where flows and configs are, and what a pull step does to a worker's process."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from robojackson.errors import BadConfiguration
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
    ((name, given),) = (pair for step in steps for pair in step.items())
    assert given == {"for_worker": True}
    module, _, function = name.rpartition(".")
    assert module == app_folder.__name__
    assert callable(getattr(app_folder, function))


@pytest.fixture
def wheel(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Return the app folder of a package that was installed from a wheel."""
    monkeypatch.setenv("PYTHONPATH", os.environ.get("PYTHONPATH", ""))
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setattr(app_folder, "PACKAGE", tmp_path / "site-packages" / "robojackson")
    bundled = app_folder.PACKAGE / app_folder.BUNDLED
    bundled.mkdir(parents=True)
    return bundled


@pytest.mark.parametrize("given", [None, "", "store", "file://store"])
def test_a_worker_of_a_wheel_keeps_no_results_in_the_package(
    given: str | None, wheel: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its runs work in the app folder, so that a relative store would lie there."""
    monkeypatch.delenv("ROBOJACKSON_STORE", raising=False)
    if given is not None:
        monkeypatch.setenv("ROBOJACKSON_STORE", given)
    with pytest.raises(BadConfiguration, match="absolute path of a folder in ROBOJACKSON_STORE"):
        app_folder.use_app_folder(for_worker=True)
    assert app_folder.use_app_folder()["directory"] == str(wheel)  # a command works in its own


@pytest.mark.parametrize("given", ["/srv/store", "file:///srv/store", "s3://bucket"])
def test_a_worker_of_a_wheel_runs_with_a_store_that_has_a_place(
    given: str, wheel: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROBOJACKSON_STORE", given)
    assert app_folder.use_app_folder(for_worker=True)["directory"] == str(wheel)


def test_a_worker_of_a_checkout_uses_its_store(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROBOJACKSON_STORE", raising=False)
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setenv("PYTHONPATH", os.environ.get("PYTHONPATH", ""))
    assert app_folder.use_app_folder(for_worker=True)["directory"] == str(ROOT)
