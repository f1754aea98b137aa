"""What is in the repository, and what is not: machine paths, doubled test names, three OpenCVs."""

import os
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from importlib.metadata import distributions
from pathlib import Path

import cv2
import pytest
import yaml

ROOT = Path(__file__).parents[2]
NOT_OURS = {"store", "backup", "build", "node_modules", "__pycache__"}
TEXT = {".py", ".md", ".toml", ".yaml", ".yml", ".txt", ".cfg", ".html", ".css", ".example", ""}
MACHINE_PATH = re.compile(r"(?<![\w.$}])/(?:work|home|root|Users)/\w")
INDEX_HOST = re.compile(r"https?://\S*(?:/simple\b|pypi|whl/|npm)|--(?:extra-)?index-url[= ]+http")


def text_files() -> Iterator[Path]:
    """Yield everything that may be committed and can be read; of hidden folders only `.ci`."""
    for folder, inner, names in os.walk(ROOT):
        inner[:] = [
            name
            for name in inner
            if name not in NOT_OURS and (name == ".ci" or not name.startswith("."))
        ]
        ours = sorted(name for name in names if name != ".git")  # of a worktree, a file
        for path in (Path(folder) / name for name in ours):
            if path.suffix in TEXT and path.stat().st_size < 1_000_000:
                yield path


def lines_with(pattern: re.Pattern[str]) -> list[str]:
    calls = []
    for path in text_files():
        for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
            if pattern.search(line):
                calls.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()[:80]}")
    return calls


def test_no_file_names_a_path_of_a_machine() -> None:
    assert lines_with(MACHINE_PATH) == []


def test_no_file_names_a_package_index() -> None:
    assert lines_with(INDEX_HOST) == []


def test_the_headless_opencv_is_the_only_one() -> None:
    names = {str(found.metadata["Name"]).lower() for found in distributions()}
    assert {n for n in names if n.startswith("opencv")} == {"opencv-python-headless"}


def test_the_opencv_that_is_imported_has_no_windows() -> None:
    gui = re.search(r"GUI:\s+(\S+)", cv2.getBuildInformation())
    assert gui is not None
    assert gui.group(1) == "NONE"


def test_test_files_have_different_names() -> None:
    names = Counter(path.name for path in (ROOT / "tests").rglob("test_*.py"))
    assert [name for name, count in names.items() if count > 1] == []


def test_pinned_tools_have_one_version() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    dev = project["project"]["optional-dependencies"]["dev"]
    pinned = {line.split("==")[0]: line.split("==")[1] for line in dev if "==" in line}
    constraints = dict(
        line.split("==") for line in (ROOT / "constraints.txt").read_text().split() if "==" in line
    )
    assert {"ruff", "mypy"} <= set(pinned)
    assert {name: constraints[name] for name in pinned} == pinned


@pytest.mark.parametrize("name", ["docker-compose.yml", "prefect.yaml"])
def test_a_yaml_file_is_valid(name: str) -> None:
    assert isinstance(yaml.safe_load((ROOT / name).read_text()), dict)


def test_every_image_of_the_compose_file_has_a_fixed_version() -> None:
    services = yaml.safe_load((ROOT / "docker-compose.yml").read_text())["services"]
    tags = {name: service["image"].rpartition(":")[2] for name, service in services.items()}
    assert {
        name for name, tag in tags.items() if not re.match(r"(?:RELEASE\.)?\d+[.-]\d+", tag)
    } == set()


def test_the_compose_file_asks_the_environment_for_every_password() -> None:
    text = (ROOT / "docker-compose.yml").read_text()
    words = re.findall(
        r"(?:PASSWORD: |AUTH_STRING: |SECRET_ACCESS_KEY: |://[a-z]+:)\"?([^\s\d]\S*)", text
    )
    assert len(words) >= 2
    assert [w for w in words if not re.match(r"\$\{\w+_(?:PASSWORD|AUTH):\?", w)] == []


def test_entry_points_of_deployments_are_modules() -> None:
    deployments = yaml.safe_load((ROOT / "prefect.yaml").read_text())["deployments"]
    points = [deployment["entrypoint"] for deployment in deployments]
    assert [p for p in points if "/" in p or ":" in p or p.endswith(".py")] == []
