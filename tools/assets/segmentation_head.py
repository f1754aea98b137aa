"""Remove the segmentation head of MediaPipe's landmark networks.

The networks also draw a mask of the person, 256 x 256, which costs a quarter of their time and
which nothing here reads. PoseLandmarker selects the outputs by their position, so the mask's output
stays, as a constant of one element; all other outputs are the same to the last bit.
"""

from typing import Any

import numpy as np
from mediapipe.tasks.metadata import schema_py_generated as tflite_schema

MASK_SHAPE = (1, 256, 256, 1)


def remove_segmentation_head(graph: Any) -> None:
    """Remove the operators that only the mask needs, and their weights, from a `ModelT`.

    Raises:
        ValueError: the network has no output that is a mask.
    """
    network = graph.subgraphs[0]
    mask = next((o for o in network.outputs if _shape(network.tensors[o]) == MASK_SHAPE), None)
    if mask is None:
        raise ValueError(f"no output of shape {MASK_SHAPE}")
    kept = _operators_for(network, [output for output in network.outputs if output != mask])
    network.operators = [network.operators[index] for index in sorted(kept)]
    read = {tensor for operator in network.operators for tensor in operator.inputs}
    for index, tensor in enumerate(network.tensors):
        if index not in read and tensor.buffer:
            graph.buffers[tensor.buffer].data = None
    constant = tflite_schema.BufferT()
    constant.data = np.zeros(np.dtype(np.float32).itemsize, np.uint8)
    graph.buffers.append(constant)
    network.tensors[mask].buffer = len(graph.buffers) - 1
    network.tensors[mask].shape = np.ones(len(MASK_SHAPE), np.int32)


def _shape(tensor: Any) -> tuple[int, ...]:
    return tuple(int(length) for length in tensor.shape)


def _operators_for(network: Any, outputs: list[int]) -> set[int]:
    """Return the indices of the operators that compute some of the outputs."""
    producer = {
        output: index
        for index, operator in enumerate(network.operators)
        for output in operator.outputs
    }
    needed: set[int] = set()
    waiting = [producer[output] for output in outputs]
    while waiting:
        index = waiting.pop()
        if index not in needed:
            needed.add(index)
            waiting += [producer[i] for i in network.operators[index].inputs if i in producer]
    return needed
