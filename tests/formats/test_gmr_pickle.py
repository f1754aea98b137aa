"""Reading a foreign pickle runs nothing."""

import os
import pickle
import pickletools
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from robojackson.errors import BadTable
from robojackson.formats import gmr
from robojackson.motion.reference_motion import ReferenceMotion


class Trap:
    """What runs a function where it is unpickled."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        self.call = function, arguments

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        return self.call


def motion(**more: Any) -> dict[str, Any]:
    frames = 4
    content = {
        "fps": 30,
        "root_pos": np.zeros((frames, 3)),
        "root_rot": np.tile([0.0, 0.0, 0.0, 1.0], (frames, 1)),
        "dof_pos": np.zeros((frames, 5)),
        "local_body_pos": None,
        "link_body_list": None,
    }
    return content | more


def traps(mark: Path) -> dict[str, Any]:
    order = f"touch {mark}"
    code = f"open({str(mark)!r}, 'w')"
    return {
        "a shell": Trap(os.system, order),
        "an expression": Trap(eval, code),
        "a file": Trap(open, str(mark), "w"),
        "inside an array": np.array([Trap(os.system, order)], dtype=object),
        "a getattr": Trap(getattr, "text", "format"),
    }


@pytest.mark.parametrize("kind", traps(Path("x")))
@pytest.mark.parametrize("protocol", [2, 4, 5])
def test_a_pickle_that_calls_something_is_refused(kind: str, protocol: int, tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    data = pickle.dumps(motion(extra=traps(mark)[kind]), protocol=protocol)
    with pytest.raises(BadTable, match="refused, it asks for"):
        gmr.read(data)
    assert not mark.exists()


@pytest.mark.parametrize("kind", ["a shell", "an expression", "a file", "inside an array"])
def test_the_traps_are_sharp(kind: str, tmp_path: Path) -> None:
    """Python's own reader runs them, or the test above would prove nothing."""
    mark = tmp_path / "mark"
    pickle.loads(pickle.dumps(motion(extra=traps(mark)[kind])))
    assert mark.exists()


@pytest.mark.parametrize("protocol", [3, 4, 5])
def test_gmrs_own_files_are_read(protocol: int) -> None:
    """As its script writes them: float64 arrays, a float rate, no bodies."""
    back = gmr.read(pickle.dumps(motion(fps=np.float64(30.0)), protocol=protocol))
    assert (back.fps, back.qpos.shape) == (30.0, (4, 12))
    np.testing.assert_array_equal(back.qpos[:, 3:7], np.tile([1.0, 0.0, 0.0, 0.0], (4, 1)))


@pytest.mark.parametrize("cut", [1, 40, 200])
def test_a_pickle_that_is_cut_off_is_reported(cut: int) -> None:
    with pytest.raises(BadTable):
        gmr.read(pickle.dumps(motion())[:-cut])


@pytest.mark.parametrize("kind", ["O", "V8", "M8[s]", "f8,O"])
def test_arrays_of_anything_but_numbers_are_refused(kind: str) -> None:
    with pytest.raises(BadTable, match="refused, it asks for an array of"):
        gmr.read(pickle.dumps(motion(extra=np.zeros(2, kind))))


def test_what_is_written_needs_no_inner_name_of_numpy(
    swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    """NumPy 1.23 knows no `numpy._core`."""
    data = gmr.write(swaying, model)
    words = {argument for _, argument, _ in pickletools.genops(data) if isinstance(argument, str)}
    assert {word for word in words if word.startswith("numpy")} == {"numpy"}


def test_a_pickle_without_the_root_names_it() -> None:
    content = motion()
    del content["root_pos"]
    with pytest.raises(BadTable, match="root_pos"):
        gmr.read(pickle.dumps(content))
