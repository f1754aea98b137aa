"""Fixtures that several folders of tests share: a store of one's own, and one Prefect server."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).parents[1]
MOST_WORKERS = 4
"""A worker takes up to 3.5 GB of memory."""

settings.register_profile("any-machine", deadline=None)
settings.load_profile("any-machine")
os.environ.setdefault("OMP_NUM_THREADS", "1")
# What JAX compiles is kept for the child processes that train, and for the next run of the tests.
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(ROOT / ".pytest_cache" / "jax"))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")


def pytest_xdist_auto_num_workers() -> int:
    """Return how many processes `-n auto` starts: one a core that we may use, within limits."""
    return min(len(os.sched_getaffinity(0)), MOST_WORKERS)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what needs more than a machine has by itself, unless `-m` asks for it by name."""
    marks = str(config.getoption("-m"))
    left_out = [marker for marker in ("network", "cluster", "browser") if marker not in marks]
    outside = [item for item in items if any(item.get_closest_marker(m) for m in left_out)]
    if outside:
        config.hook.pytest_deselected(items=outside)
        items[:] = [item for item in items if item not in outside]


@pytest.fixture
def store_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty store that `Store.from_environment` finds, in this process and its
    children."""
    folder = tmp_path / "store"
    monkeypatch.setenv("ROBOJACKSON_STORE", str(folder))
    return folder


@pytest.fixture(scope="session")
def prefect_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Yield one temporary Prefect server for the whole session; it takes seconds to start."""
    home = tmp_path_factory.mktemp("prefect")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PREFECT_HOME", str(home))
        patch.setenv("PREFECT_SERVER_ANALYTICS_ENABLED", "false")
        patch.setenv("PREFECT_SERVER_REGISTER_BLOCKS_ON_START", "false")
        patch.setenv("DO_NOT_TRACK", "1")
        from prefect.testing.utilities import prefect_test_harness

        with prefect_test_harness(server_startup_timeout=120):
            yield


@pytest.fixture
def records(prefect_server: None, store_folder: Path) -> Iterator[None]:
    """Yield an empty store for the records of stages, and a server for their runs."""
    from prefect.settings import (
        PREFECT_FLOWS_HEARTBEAT_FREQUENCY,
        PREFECT_LOGGING_LEVEL,
        temporary_settings,
    )

    expected = {
        PREFECT_FLOWS_HEARTBEAT_FREQUENCY: None,
        PREFECT_LOGGING_LEVEL: "ERROR",
    }
    with temporary_settings(expected):
        yield


@pytest.fixture(scope="session")
def short_clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the first second of the hip shake."""
    from robojackson.clips.trim import trim

    out = tmp_path_factory.mktemp("clip") / "hips.mp4"
    return trim(Path(__file__).parents[1] / "clips" / "hip_shake.mp4", 0.0, 1.0, out)
