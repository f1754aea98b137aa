"""Compiled programs outlive the process, change no result, and come from this user alone."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from robojackson.rl.tqc.compiled_programs import compiled_folder, is_private

PROGRAM = """
import sys, warnings
import jax, jax.numpy as jnp
from jax import monitoring
from robojackson.rl.tqc.compiled_programs import keep_compiled_programs
found = []
monitoring.register_event_listener(lambda name, **_: found.append(name))
keep_compiled_programs()
squares = jax.jit(lambda x: jnp.tanh(x @ x.T).sum(axis=0))
with warnings.catch_warnings(record=True) as said:
    value = squares(jnp.arange(12.0).reshape(3, 4) / 10)
print(sum("cache_hits" in name for name in found), value.tolist(), len(said))
"""


def computed(cache: Path) -> tuple[int, np.ndarray, int]:
    """Run the program in a process of its own: hits, its value, warnings."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith("JAX_COMPILATION")}
    environment = {**kept, "XDG_CACHE_HOME": str(cache), "JAX_PLATFORMS": "cpu"}
    command = [sys.executable, "-W", "always", "-c", PROGRAM]
    said = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert "persistent compilation cache" not in said.stderr
    hits, rest = said.stdout.strip().split(" ", 1)
    value, warned = rest.rsplit(" ", 1)
    return int(hits), np.array(json.loads(value)), int(warned)


def test_a_second_process_reads_what_the_first_compiled(tmp_path: Path) -> None:
    first, second = computed(tmp_path), computed(tmp_path)
    assert first[0] == 0
    assert second[0] > 0
    np.testing.assert_array_equal(first[1], second[1])


def test_a_broken_file_is_compiled_again(tmp_path: Path) -> None:
    first = computed(tmp_path)
    files = list((tmp_path / "robojackson" / "compiled").rglob("*-cache"))
    assert files
    for file in files:
        file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    again = computed(tmp_path)
    assert again[0] == 0
    np.testing.assert_array_equal(first[1], again[1])


def test_a_folder_in_which_others_may_write_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = compiled_folder()
    folder.mkdir(parents=True)
    folder.chmod(0o777)
    assert not is_private(folder)
    assert computed(tmp_path)[0] == 0
    assert not list(folder.iterdir())
    folder.chmod(0o700)
    assert is_private(folder)


def test_a_cache_that_cannot_be_written_stops_nothing(tmp_path: Path) -> None:
    (tmp_path / "robojackson").write_text("a file where the folder should be")
    assert computed(tmp_path)[0] == 0
