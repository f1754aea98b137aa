"""A file that is no network, or another one, is one line; a batch is its rows."""

from pathlib import Path

import numpy as np
import pytest

from robojackson.errors import BadPolicy, MissingDependency
from robojackson.rl.trackers import onnx_network
from robojackson.rl.trackers.onnx_network import OnnxNetwork
from tests.fixtures.stand_in_tracker import write_network


def test_a_batch_is_what_its_rows_are_one_by_one(tmp_path: Path) -> None:
    network = OnnxNetwork(write_network(tmp_path / "n.onnx", 12, 5), 12, 5)
    values = np.random.default_rng(0).normal(size=(7, 12))
    rows = np.concatenate([network(row[None]) for row in values])
    np.testing.assert_allclose(network(values), rows, atol=1e-6)
    assert np.ptp(rows) > 0


@pytest.mark.parametrize(("inputs", "outputs"), [(13, 5), (12, 6)])
def test_other_sizes_are_refused_in_one_line(tmp_path: Path, inputs: int, outputs: int) -> None:
    path = write_network(tmp_path / "n.onnx", 12, 5)
    with pytest.raises(BadPolicy, match=f"12 inputs and 5 outputs; one of {inputs} and {outputs}"):
        OnnxNetwork(path, inputs, outputs)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_truncated_file_is_refused_in_one_line(tmp_path: Path, share: float) -> None:
    path = write_network(tmp_path / "n.onnx", 12, 5)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(BadPolicy, match=r"n\.onnx") as caught:
        OnnxNetwork(path, 12, 5)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(BadPolicy, match="cannot be read"):
        OnnxNetwork(tmp_path / "n.onnx", 12, 5)


def test_without_onnxruntime_the_error_is_the_command_that_brings_it(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(onnx_network, "find_spec", lambda name: None)
    with pytest.raises(MissingDependency, match=r"pip install 'robojackson\[trackers\]'"):
        OnnxNetwork(write_network(tmp_path / "n.onnx", 12, 5), 12, 5)
