"""Without its segmentation head a network keeps what its other outputs need, and nothing else."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tools.assets.segmentation_head import (
    MASK_SHAPE,
    remove_segmentation_head,
    tflite_schema,
)

ASSETS = Path(__file__).resolve().parents[2] / "robojackson" / "assets"
IMAGE, SHARED, MASK, LANDMARKS, SHARED_WEIGHT, MASK_WEIGHT = range(6)
SHAPES = ((1, 256, 256, 3), (1, 64), MASK_SHAPE, (1, 195), (4,), (4,))


def a_network() -> Any:
    """Return image -> shared -> mask and landmarks, as the objects of a TensorFlow Lite model."""
    network = tflite_schema.SubGraphT()
    network.tensors, network.operators = [], []
    for index, shape in enumerate(SHAPES):
        tensor = tflite_schema.TensorT()
        tensor.shape, tensor.buffer = np.array(shape, np.int32), index
        network.tensors.append(tensor)
    for sources, output in (
        ([IMAGE, SHARED_WEIGHT], SHARED),
        ([SHARED, MASK_WEIGHT], MASK),
        ([SHARED], LANDMARKS),
    ):
        operator = tflite_schema.OperatorT()
        operator.inputs, operator.outputs = sources, [output]
        network.operators.append(operator)
    network.inputs, network.outputs = [IMAGE], [MASK, LANDMARKS]
    graph = tflite_schema.ModelT()
    graph.buffers = [tflite_schema.BufferT() for _ in SHAPES]
    for weight in (SHARED_WEIGHT, MASK_WEIGHT):
        graph.buffers[weight].data = np.ones(16, np.uint8)
    graph.subgraphs = [network]
    return graph


def test_operators_that_only_the_mask_needs_are_gone() -> None:
    graph = a_network()
    remove_segmentation_head(graph)
    left = [operator.outputs for operator in graph.subgraphs[0].operators]
    assert left == [[SHARED], [LANDMARKS]]


def test_weights_of_the_mask_alone_are_gone() -> None:
    graph = a_network()
    remove_segmentation_head(graph)
    assert graph.buffers[MASK_WEIGHT].data is None
    assert len(graph.buffers[SHARED_WEIGHT].data) == 16


def test_outputs_keep_their_positions() -> None:
    graph = a_network()
    remove_segmentation_head(graph)
    network = graph.subgraphs[0]
    assert network.outputs == [MASK, LANDMARKS]
    assert list(network.tensors[MASK].shape) == [1, 1, 1, 1]
    assert len(graph.buffers[network.tensors[MASK].buffer].data) == 4


def test_a_network_without_a_mask_is_refused() -> None:
    graph = a_network()
    graph.subgraphs[0].outputs = [LANDMARKS]
    with pytest.raises(ValueError, match="no output of shape"):
        remove_segmentation_head(graph)


@pytest.mark.parametrize("size", ["lite", "full"])
def test_shipped_networks_draw_no_mask(size: str) -> None:
    with zipfile.ZipFile(ASSETS / f"pose_landmarker_{size}.task") as bundle:
        content = bundle.read("pose_landmarks_detector.tflite")
    network = tflite_schema.Model.GetRootAsModel(content, 0).Subgraphs(0)
    outputs = [network.Tensors(network.Outputs(index)) for index in range(network.OutputsLength())]
    assert [list(output.ShapeAsNumpy()) for output in outputs] == [
        [1, 195], [1, 1], [1, 1, 1, 1], [1, 64, 64, 39], [1, 117],
    ]  # fmt: skip
