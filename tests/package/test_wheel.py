"""The installed package: what can be imported, what runs, what it says where Prefect is missing."""

import json
import zipfile
from pathlib import Path

import pytest

from robojackson.cli.console import APP_PACKAGES
from tests.package.conftest import ROOT, Installed

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("package")]
OURS = ("tasks", "flows", "storage", "configs", "clips", "tests", "tools", "benchmarks")
BLOCKED = """
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {names!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Blocked())
"""


def test_the_wheel_has_one_package_at_its_top(installed: Installed) -> None:
    names = zipfile.ZipFile(installed.wheel).namelist()
    tops = {name.partition("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"robojackson"}


def test_what_runs_is_in_the_wheel(installed: Installed) -> None:
    names = set(zipfile.ZipFile(installed.wheel).namelist())
    shipped = [
        *ROOT.glob("flows/**/*.py"), *ROOT.glob("tasks/**/*.py"), *ROOT.glob("storage/**/*.py"),
        *ROOT.glob("configs/**/*.yaml"), *ROOT.glob("configs/*.py"), *ROOT.glob("clips/*.mp4"),
        ROOT / "prefect.yaml",
    ]  # fmt: skip
    library = [*ROOT.glob("robojackson/**/*.py"), *ROOT.glob("robojackson/report/pages/*.html")]
    assert len(shipped) > 80
    expected = {f"robojackson/_app/{path.relative_to(ROOT).as_posix()}" for path in shipped}
    expected |= {path.relative_to(ROOT).as_posix() for path in library}
    assert expected - names == set()
    assert "robojackson/py.typed" in names


@pytest.mark.parametrize("name", OURS)
def test_nothing_else_of_ours_can_be_imported(
    name: str, installed: Installed, tmp_path: Path
) -> None:
    done = installed.run("python", "-c", f"import {name}", cwd=tmp_path, code=1)
    assert f"No module named {name!r}" in done.stderr


def test_the_library_is_that_of_the_wheel(installed: Installed, tmp_path: Path) -> None:
    code = (
        "import sys, robojackson as rj, os; rj.load_robot(); print(rj.__file__);"
        "print([p for p in sys.path if '_app' in p], os.environ.get('PYTHONPATH'))"
    )
    file, path = installed.run("python", "-c", code, cwd=tmp_path).stdout.split("\n")[:2]
    assert Path(file).is_relative_to(installed.root)
    assert path == "[] None"


def test_a_stage_needs_neither_prefect_nor_the_app(installed: Installed, tmp_path: Path) -> None:
    (tmp_path / "blocked").mkdir()
    names = set(APP_PACKAGES)
    (tmp_path / "blocked" / "sitecustomize.py").write_text(BLOCKED.format(names=names))
    extra = {"PYTHONPATH": str(tmp_path / "blocked")}
    stage = ("robojackson", "robots", "--json")
    listed = json.loads(installed.run(*stage, cwd=tmp_path, **extra).stdout)
    assert {"humanoid", "g1"} <= {robot["robot"] for robot in listed["robots"]}
    for command in ("dance", "server", "deploy", "refresh"):
        refused = installed.run("robojackson", command, cwd=tmp_path, code=1, **extra)
        assert "pip install 'robojackson[app]'" in refused.stderr
        assert len(refused.stderr.strip().splitlines()) == 1


def test_configs_of_the_user_win(installed: Installed, tmp_path: Path) -> None:
    (tmp_path / "configs").mkdir()
    (tmp_path / "configs" / "base.yaml").write_text("minutes: nonsense\n")
    done = installed.run("robojackson", "retarget", "x", "-o", "y", cwd=tmp_path, code=1)
    assert "configs/base.yaml" in done.stderr
    assert "minutes" in done.stderr


@pytest.mark.timeout(400)
def test_a_whole_dance_runs_from_the_wheel(installed: Installed, tmp_path: Path) -> None:
    words = ("dance", "--config", "smoke", "--trainer", "sb3", "--force", "--json")
    made = json.loads(installed.run("robojackson", *words, cwd=tmp_path).stdout)
    assert Path(made["page"]).is_file()
    assert Path(made["video"]).is_file()
