"""The files that cases are made of: the motions of the bundled clip and a policy, made once."""

import fcntl
import json
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from tests.fixtures.commands import environment

ROOT = Path(__file__).parents[2]
CLIP = ROOT / "clips" / "hip_shake.mp4"
BASE = ROOT / "build" / "badinput" / "base"
MADE = (
    ("smpl.parquet", ("mocap", str(CLIP), "-o", ".")),
    ("reference.parquet", ("retarget", "smpl.parquet", "-o", ".")),
    ("policy.safetensors", ("train", "reference.parquet", "-o", "t", "--steps", "300")),
    ("amass.npz", ("export", "smpl.parquet", "--to", "amass", "-o", "amass.npz")),
    ("motion.bvh", ("export", "smpl.parquet", "--to", "bvh", "-o", "motion.bvh")),
    ("motion.csv", ("export", "smpl.parquet", "--to", "csv", "-o", "motion.csv")),
    ("gvhmr.pt", ("export", "smpl.parquet", "--to", "gvhmr", "-o", "gvhmr.pt")),
)


COMMANDS = """
import json, sys
from flows.cli.commands import app
for words in json.loads(sys.argv[1]):
    try:
        app(words)
    except SystemExit as end:
        if end.code:
            raise
"""
"""Several commands in one process: to start each takes longer than what most of them do."""


def base() -> Path:
    """Return the folder with all of them; existing ones stay. One process at a time makes them."""
    BASE.mkdir(parents=True, exist_ok=True)
    with (BASE / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        _make()
    return BASE


def _make() -> None:
    missing = [words for name, words in MADE if not (BASE / name).is_file()]
    if missing:
        command = [sys.executable, "-c", COMMANDS, json.dumps(missing)]
        subprocess.run(command, cwd=BASE, env=environment(), check=True, capture_output=True)
    for name in ("policy.safetensors", "networks.safetensors"):
        if not (BASE / name).is_file():
            shutil.copy(BASE / "t" / name, BASE / name)
    if not (BASE / "aist.pkl").is_file():
        with np.load(BASE / "amass.npz") as motion:
            found = {"smpl_poses": motion["poses"][:, :72], "smpl_trans": motion["trans"]}
        (BASE / "aist.pkl").write_bytes(pickle.dumps({**found, "smpl_scaling": np.ones(1)}))
