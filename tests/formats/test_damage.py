"""Bytes changed at random: a file is read or refused in one line, whatever they are."""

import pickle
import warnings
from functools import cache

import numpy as np
import pytest

from robojackson.errors import RoboJacksonError
from robojackson.formats import amass, bvh, gvhmr, smpl_csv
from robojackson.formats.registry import recognise
from tests.fixtures.person import person
from tests.formats.test_human_formats import aist_file, gvhmr_file
from tests.formats.test_safe_pickle import joblib_file
from tests.mocap.test_imported_motion import res_pk

TRIALS, BEGINNING = 60, 3000


@cache
def file_of(kind: str) -> bytes:
    return {
        "amass": lambda: amass.write(person()),
        "bvh": lambda: bvh.write(person()),
        "csv": lambda: smpl_csv.write(person()),
        "gvhmr": lambda: gvhmr.write(person()),
        "gvhmr of torch": gvhmr_file,
        "aist": aist_file,
        "hybrik": lambda: pickle.dumps(res_pk()),
        "niki": lambda: joblib_file(res_pk()),
    }[kind]()


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """Return the file with a few bytes changed, often near the beginning, and sometimes cut off."""
    changed = bytearray(data)
    reach = min(len(data), BEGINNING) if rng.random() < 0.5 else len(data)
    for _ in range(rng.integers(1, 6)):
        changed[rng.integers(reach)] = rng.integers(256)
    if rng.random() < 0.2:
        del changed[rng.integers(len(changed)) :]
    return bytes(changed)


@pytest.mark.parametrize(
    "kind", ["amass", "bvh", "csv", "gvhmr", "gvhmr of torch", "aist", "hybrik", "niki"]
)
def test_a_damaged_file_is_read_or_refused_in_one_line(kind: str) -> None:
    rng = np.random.default_rng(0)
    calls = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(TRIALS):
            data = damaged(file_of(kind), rng)
            try:
                recognise(data, "file").read(data)
            except RoboJacksonError as cause:
                calls.append(len(str(cause)))
    assert 0 < max(calls) < 2000
