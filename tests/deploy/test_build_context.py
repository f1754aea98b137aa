"""What `docker build` gets: all that runs in the image, and no test, document or secret.

The list is computed by the Docker SDK's reading of .dockerignore, over the files of the checkout
and others that a checkout may have.
"""

import ast
import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml
from docker.utils import exclude_paths

from flows.search.dance_source import DEFAULT
from tests.fixtures import checkout
from tools.stack.service import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES = PROJECT["tool"]["setuptools"]["packages"]
NEVER = {"tests", "docs", "benchmarks", "examples", "store", "backup", "build", "dist"}
JUNK = (
    *(".env", ".git/config", ".venv/bin/python", ".venv/.stamp", ".coverage", "MUJOCO_LOG.TXT"),
    *("store/motion/0a/x.parquet", "store/prefect/prefect.db", "backup/backups/x.json"),
    *("robojackson/__pycache__/errors.cpython-311.pyc", "flows/__pycache__/cli.pyc"),
    *("robojackson/rl/__pycache__/x.pyc", "robojackson.egg-info/PKG-INFO", "build/lib/x.py"),
    *(".mypy_cache/x.json", ".pytest_cache/x", "node_modules/x/index.js", "id_rsa", "notes.txt"),
)
"""What a working checkout has beside the files of the repository."""
WATCH = """
import sys
root, venv = sys.argv.pop(1), sys.argv.pop(1)
def watch(event, args):
    path = args[0] if event == "open" else None
    if isinstance(path, str) and path.startswith(root + "/") and not path.startswith(venv + "/"):
        print("OUTSIDE", path, file=sys.stderr)
sys.addaudithook(watch)
"""
COMMAND = (
    WATCH + "import runpy; runpy.run_module('robojackson', run_name='__main__', alter_sys=True)"
)
ENTRIES = (
    WATCH
    + """
import importlib
for name in sys.argv[1:]:
    module, _, flow = name.rpartition(".")
    assert callable(getattr(importlib.import_module(module), flow)), name
"""
)


@pytest.fixture(scope="module")
def context(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    """Return the files that a build would get."""
    root = tmp_path_factory.mktemp("checkout")
    for path in (*checkout.walked(ROOT, (".ci",)), *map(Path, JUNK)):
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).touch()
    lines = (ROOT / ".dockerignore").read_text().splitlines()
    patterns = [line for line in lines if line and not line.startswith("#")]
    found = exclude_paths(str(root), patterns, dockerfile=".dockerignore")
    return {path for path in found if (root / path).is_file()} - {".dockerignore"}


@pytest.fixture(scope="module")
def image(context: set[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files that the image has under /app."""
    root = tmp_path_factory.mktemp("app")
    for name in context:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, root / name)
    return root


def test_no_test_document_benchmark_or_secret_is_in_it(context: set[str]) -> None:
    assert [name for name in context if Path(name).parts[0] in NEVER] == []
    assert context & set(JUNK) == set()
    assert [name for name in context if name.startswith(".") or "__pycache__" in name] == []


def test_of_the_tools_only_the_one_that_builds_is_in_it(context: set[str]) -> None:
    assert {name for name in context if name.startswith("tools/")} == {"tools/bootstrap.sh"}


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_is_in_it_with_its_data(package: str, context: set[str]) -> None:
    folder = ROOT / package.removeprefix("robojackson._app").lstrip(".").replace(".", "/")
    patterns = ["*.py", *PROJECT["tool"]["setuptools"]["package-data"].get(package, [])]
    needed = {path for pattern in patterns for path in folder.glob(pattern) if path.is_file()}
    assert needed
    assert {path.relative_to(ROOT).as_posix() for path in needed} <= context


def test_what_the_build_reads_is_in_it(context: set[str]) -> None:
    project = PROJECT["project"]
    read = {project["readme"], *project["license-files"], "pyproject.toml", "constraints.txt"}
    assert read <= context


def test_every_clip_that_a_user_can_name_is_in_it(context: set[str]) -> None:
    moves = (ROOT / "configs" / "moves").glob("*.yaml")
    named = {yaml.safe_load(path.read_text()).get("clip") for path in moves} - {None}
    entries = yaml.safe_load((ROOT / "prefect.yaml").read_text())["deployments"]
    named |= {str(e.get("parameters", {}).get("source", "")) for e in entries} - {""}
    named.add(f"clips/{DEFAULT}")
    assert len(named) > 3
    assert named <= context


def test_no_ground_truth_of_tests_is_in_it(context: set[str]) -> None:
    assert [n for n in context if n.endswith(("_gt.npz", ".trc")) or "heldout" in n] == []


@pytest.mark.medium
def test_nothing_in_it_imports_what_stays_out(context: set[str]) -> None:
    wrong = []
    for name in (name for name in context if name.endswith(".py")):
        for node in ast.walk(ast.parse((ROOT / name).read_text(encoding="utf-8"))):
            modules = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            modules += [a.name for a in node.names] if isinstance(node, ast.Import) else []
            outside = {m.split(".")[0] for m in modules} & {"tests", "benchmarks", "tools"}
            wrong += [f"{name} imports {module}" for module in outside]
    assert wrong == []


def run(image: Path, script: str, *words: str) -> str:
    """Run Python in the image's folder; nothing of the checkout but its packages may be opened."""
    given = {
        "HOME": str(image / "home"),
        "PATH": os.environ["PATH"],
        "PYTHONPATH": str(image),
        "PYTHONDONTWRITEBYTECODE": "1",
        "PREFECT_HOME": str(image / "home" / "prefect"),
        "DO_NOT_TRACK": "1",
    }
    command = [sys.executable, "-c", script, str(ROOT), str(ROOT / ".venv"), *words]
    done = subprocess.run(
        command, cwd=image, env=given, capture_output=True, text=True, check=False
    )
    outside = sorted({line for line in done.stderr.splitlines() if line.startswith("OUTSIDE")})
    assert outside == []
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def test_the_command_runs_on_it_alone(image: Path) -> None:
    assert "a robot that dances it" in run(image, COMMAND, "--help")


@pytest.mark.medium
def test_the_doctor_finds_everything_there(image: Path) -> None:
    report = json.loads(run(image, COMMAND, "doctor", "--json"))
    assert report["missing"] == []


@pytest.mark.medium
def test_every_deployment_is_importable_from_it_alone(image: Path) -> None:
    entries = yaml.safe_load((image / "prefect.yaml").read_text())["deployments"]
    run(image, ENTRIES, *sorted({entry["entrypoint"] for entry in entries}))


def test_the_image_has_no_tools_of_developers() -> None:
    """The extras that it is built with; `dev` is not among them."""
    dockerfile = (ROOT / "Dockerfile").read_text()
    assert "EXTRAS=app,fast,s3,trackers sh tools/bootstrap.sh dependencies" in dockerfile
    bootstrap = (ROOT / "tools" / "bootstrap.sh").read_text()
    assert "EXTRAS=${EXTRAS:-app,fast,s3,dev}" in bootstrap
