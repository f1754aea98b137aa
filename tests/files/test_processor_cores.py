"""A process uses the cores that its affinity and the quotas of its control groups leave it."""

import os
from pathlib import Path

import pytest

from robojackson.files.processor_cores import cores

HERE = 8


@pytest.fixture(autouse=True)
def eight_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: set(range(HERE)), raising=False)


def written(folder: Path, files: dict[str, str]) -> Path:
    """Write a tree of control groups; return its folder."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(f"{text}\n")
    return folder


@pytest.mark.parametrize(
    ("quota", "expected"),
    [
        ("200000 100000", 2),
        ("250000 100000", 3),
        ("5000 100000", 1),
        ("9900000 100000", HERE),
        ("max 100000", HERE),
        ("", HERE),
    ],
)
def test_a_containers_quota_is_rounded_up(quota: str, expected: int, tmp_path: Path) -> None:
    groups = written(tmp_path, {"cpu.max": quota})
    assert cores(groups, tmp_path / "none") == expected


@pytest.mark.parametrize("controller", ["cpu", "cpu,cpuacct"])
@pytest.mark.parametrize(("quota", "expected"), [(150_000, 2), (-1, HERE)])
def test_quotas_of_older_control_groups_count(
    controller: str, quota: int, expected: int, tmp_path: Path
) -> None:
    files = {"cpu.cfs_quota_us": f"{quota}", "cpu.cfs_period_us": "100000"}
    groups = written(tmp_path, {f"{controller}/{name}": text for name, text in files.items()})
    assert cores(groups, tmp_path / "none") == expected


def test_the_smallest_quota_of_all_groups_around_a_process_counts(tmp_path: Path) -> None:
    files = {
        "groups/a/cpu.max": "300000 100000",
        "groups/a/b/cpu.max": "max 100000",
        "groups/other/cpu.max": "100000 100000",
        "own": "3:memory:/other\n0::/a/b",
    }
    folder = written(tmp_path, files)
    assert cores(folder / "groups", folder / "own") == 3


def test_without_control_groups_the_affinity_counts(tmp_path: Path) -> None:
    assert cores(tmp_path, tmp_path / "none") == HERE
