"""Whole pass on the Unitree G1, whose model `robojackson robots add g1` brings."""

import asyncio
import shutil
from pathlib import Path

import pytest

from flows.dance import dance
from tests.fixtures.robots import G1, G1_FOLDER


@pytest.mark.slow
@G1
def test_the_flow_dances_on_the_unitree_g1(
    prefect_server: None, short_clip: Path, store_folder: Path
) -> None:
    shutil.copytree(G1_FOLDER, store_folder / "robots" / "g1")
    overrides = {
        "train.trainer": "sb3",
        "train.steps": 300,
        "train.track.control.feedback_path": "reference",
    }
    text = asyncio.run(dance(str(short_clip), "smoke", overrides, robot="g1"))
    assert text["robot"] == "g1"
    assert Path(text["page"]).is_file()
    kept = list((store_folder / "feedback").glob("*.npz"))
    assert len(kept) == 1, "training and evaluation computed the same feedback"
