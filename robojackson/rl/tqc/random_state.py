"""The state of random number generators as JSON, so that a resumed run does not repeat itself.

Stable-Baselines3 draws its replay samples from numpy's global generator; ours are `Generator`s.
"""

import json
from pathlib import Path

import numpy as np


def save_random(path: Path, generators: dict[str, np.random.Generator]) -> None:
    """Write the state of named generators and of numpy's global one."""
    states = {name: generator.bit_generator.state for name, generator in generators.items()}
    shared = np.random.get_state(legacy=False)  # noqa: NPY002
    assert isinstance(shared, dict)
    shared["state"]["key"] = shared["state"]["key"].tolist()
    path.write_text(json.dumps({"generators": states, "numpy": shared}))


def load_random(path: Path, generators: dict[str, np.random.Generator]) -> None:
    """Restore generators from `save_random`'s file."""
    saved = json.loads(path.read_text())
    for name, generator in generators.items():
        generator.bit_generator.state = saved["generators"][name]
    saved["numpy"]["state"]["key"] = np.array(saved["numpy"]["state"]["key"], np.uint32)
    np.random.set_state(saved["numpy"])  # noqa: NPY002
