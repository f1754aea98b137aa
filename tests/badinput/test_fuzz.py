"""Every reader that we wrote, on altered files: it returns, or raises an error of ours; nothing else.

    FUZZ_EXAMPLES=20000 python -m pytest tests/badinput/test_fuzz.py -p no:cacheprovider

Findings become cases of the corpus.
"""

import io
import os
import pickle
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors.numpy import save

from robojackson.clips.web.untrusted_text import clean_text, safe_name, web_address
from robojackson.errors import RoboJacksonError
from robojackson.files import table_door
from robojackson.files.foreign_file import parse_json
from robojackson.formats import (
    aist,
    amass,
    beyondmimic,
    bvh,
    gmr,
    gvhmr,
    hybrik_output,
    keyframes,
    locomujoco,
    omniretarget,
    smpl_csv,
    unitree_csv,
)
from robojackson.formats.containers import bvh_tree, npz_archive, safe_pickle, torch_archive
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.policy import Policy, load_policy
from robojackson.rl.tqc.network_arrays import load_networks
from robojackson.robot.description import RobotDescription
from tests.badinput.robot_files import YAML
from tests.files.test_tables import a_reference, a_sequence, a_track
from tests.formats.test_human_formats import aist_file
from tests.mocap.test_imported_motion import res_pk

EXAMPLES = int(os.environ.get("FUZZ_EXAMPLES", "40"))
FUZZED = settings(
    max_examples=EXAMPLES,
    deadline=None,
    derandomize="FUZZ_EXAMPLES" not in os.environ,
    suppress_health_check=list(HealthCheck),
    database=None,
)
SEQUENCE = a_sequence(np.random.default_rng(0))
ARRAYS = {"poses": np.zeros((4, 72)), "trans": np.zeros((4, 3)), "mocap_framerate": np.array(30.0)}
TRACK, REFERENCE = (make(np.random.default_rng(0)) for make in (a_track, a_reference))
ROOTS = {"root_pos": np.zeros((4, 3)), "root_rot": np.ones((4, 4))}
QPOS = {"qpos": np.zeros((4, 9)), "qvel": np.zeros((4, 8))}
BEYONDMIMIC = {
    "fps": np.array([50]), "joint_pos": np.zeros((4, 2)),
    "body_pos_w": np.zeros((4, 3, 3)), "body_quat_w": np.ones((4, 3, 4)),
}  # fmt: skip
KEYFRAMES = (
    b'<mujocoinclude><keyframe><key time="0" qpos="0 0 1" qvel="0 0 0"/>'
    b'<key time="0.1" qpos="0 0 1" qvel="0 0 0"/></keyframe></mujocoinclude>'
)


def _parquet() -> bytes:
    sink = io.BytesIO()
    pq.write_table(pa.table({"a": [1.0, 2.0], "b": ["x", "y"]}), sink)
    return sink.getvalue()


SEEDS: dict[str, tuple[bytes, Callable[[bytes], object]]] = {
    "bvh": (bvh.write(SEQUENCE), bvh.read),
    "bvh tree": (
        b"HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT b\n{\n"
        b"OFFSET 0 1 0\nCHANNELS 0\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n}\nMOTION\nFrames: 2\n"
        b"Frame Time: 0.1\n0 0 0\n1 2 3\n",
        bvh_tree.parse,
    ),
    "csv": (smpl_csv.write(SEQUENCE), smpl_csv.read),
    "npz": (npz_archive.pack(ARRAYS), lambda data: npz_archive.unpack(data, ("poses",), "f")),
    "amass": (npz_archive.pack(ARRAYS), amass.read),
    "pickle": (pickle.dumps(ARRAYS, 4), lambda data: safe_pickle.load(data, "f")),
    "joblib": (pickle.dumps(ARRAYS, 2), lambda data: safe_pickle.load_joblib(data, "f")),
    "torch": (torch_archive.save(ARRAYS), lambda data: torch_archive.load(data, "f")),
    "table": (_parquet(), lambda data: table_door.read_parquet(data, "f")),
    "smpl": (SEQUENCE.to_bytes(), lambda data: SmplSequence.from_bytes(data, "f")),
    "landmarks": (TRACK.to_bytes(), lambda data: LandmarkTrack.from_bytes(data, "f")),
    "reference": (REFERENCE.to_bytes(), lambda data: ReferenceMotion.from_bytes(data, "f")),
    "aist": (aist_file(), aist.read),
    "gvhmr": (gvhmr.write(SEQUENCE), gvhmr.read),
    "hybrik": (pickle.dumps(res_pk()), hybrik_output.read),
    "gmr": (pickle.dumps({**ROOTS, "fps": 30, "dof_pos": np.zeros((4, 2))}), gmr.read),
    "beyondmimic": (npz_archive.pack(BEYONDMIMIC), beyondmimic.read),
    "locomujoco": (npz_archive.pack({**QPOS, "frequency": np.array(50.0)}), locomujoco.read),
    "omniretarget": (npz_archive.pack({**QPOS, "fps": np.array(30)}), omniretarget.read),
    "unitree csv": (b"0,0,1,0,0,0,1,.5\n" * 4, unitree_csv.read),
    "keyframes": (KEYFRAMES, keyframes.read),
}
edits = st.lists(
    st.tuples(st.floats(0, 1), st.integers(0, 40), st.binary(max_size=12)), min_size=1, max_size=6
)


def altered(seed: bytes, changes: list[tuple[float, int, bytes]]) -> bytes:
    """Return the file with pieces replaced: (place 0..1, bytes removed, bytes inserted)."""
    data = bytearray(seed)
    for share, gone, comes in changes:
        place = int(share * len(data))
        data[place : place + gone] = comes
    return bytes(data)


@pytest.mark.medium
@pytest.mark.parametrize("name", SEEDS)
@given(changes=edits)
@FUZZED
def test_an_altered_file_is_read_or_refused(
    name: str, changes: list[tuple[float, int, bytes]]
) -> None:
    seed, reader = SEEDS[name]
    try:
        reader(altered(seed, changes))
    except RoboJacksonError as cause:
        assert str(cause)


WORDS = st.sampled_from([
    *("HIERARCHY", "ROOT", "JOINT", "End", "Site", "{", "}", "OFFSET", "CHANNELS", "MOTION", "Frames:"),
    *("Frame", "Time:", "0", "1", "-1", "3", "6", "nan", "1e999", "Xrotation", "Yposition", "a", "b"),
])  # fmt: skip


@given(words=st.lists(WORDS, max_size=60))
@FUZZED
def test_words_of_a_bvh_in_any_order(words: list[str]) -> None:
    try:
        bvh.read(" ".join(["HIERARCHY", *words]).encode())
    except RoboJacksonError as cause:
        assert str(cause)


@given(program=st.binary(max_size=60))
@FUZZED
def test_any_pickle_is_read_or_refused(program: bytes) -> None:
    with pytest.raises(RoboJacksonError):
        safe_pickle.load(b"\x80\x04" + program + b"\x00", "f")


yaml_pieces = st.sampled_from([
    *("a", "detector", "mocap", ":", ": ", "- ", "[", "]", "{", "}", ", ", "&x ", "*x", "!!", "!!python/",
      "\n", "  ", "\t", "|", ">", "'", '"', "#", "?", "1", "1e9", ".nan", "null", "~", "<<", "---", "%YAML"),
])  # fmt: skip


@given(pieces=st.lists(yaml_pieces, max_size=30))
@FUZZED
def test_any_yaml_is_read_or_refused(
    pieces: list[str], tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = _scratch(tmp_path_factory) / "c.yaml"
    file.write_text("".join(pieces))
    try:
        load(PipelineConfig, file)
    except RoboJacksonError as cause:
        assert str(cause)


@given(changes=edits)
@FUZZED
def test_an_altered_policy_is_read_or_refused(
    changes: list[tuple[float, int, bytes]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    layers = ((np.ones((3, 4), np.float32), np.ones(4, np.float32)),)
    file = _scratch(tmp_path_factory) / "p.safetensors"
    file.write_bytes(altered(Policy(layers, {"robot": "humanoid"}).to_bytes(), changes))
    try:
        load_policy(file)
    except RoboJacksonError as cause:
        assert str(cause)


@given(changes=edits)
@FUZZED
def test_an_altered_networks_file_is_read_or_refused(
    changes: list[tuple[float, int, bytes]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    arrays = {"actor.0.weight": np.ones((3, 4), np.float32), "actor.0.bias": np.ones(4, np.float32)}
    file = _scratch(tmp_path_factory) / "n.safetensors"
    seed = save(arrays, {"robojackson-networks-1": "{}"})
    file.write_bytes(altered(seed, changes))
    with pytest.raises(RoboJacksonError):
        load_networks(file)


@given(changes=edits)
@FUZZED
def test_an_altered_description_of_a_robot_is_read_or_refused(
    changes: list[tuple[float, int, bytes]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = _scratch(tmp_path_factory) / "r.yaml"
    file.write_bytes(altered(YAML.encode(), changes))
    try:
        load(RobotDescription, file)
    except RoboJacksonError as cause:
        assert str(cause)


@given(text=st.text(max_size=200))
@FUZZED
def test_words_of_the_web_are_clean(text: str) -> None:
    assert clean_text(text).isprintable()
    assert safe_name(text)
    assert "\n" not in web_address(text)
    with suppress(ValueError):
        parse_json(text)


def _scratch(factory: pytest.TempPathFactory) -> Path:
    folder = factory.getbasetemp() / "fuzz"
    folder.mkdir(exist_ok=True)
    return folder
