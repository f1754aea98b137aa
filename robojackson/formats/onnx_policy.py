"""A policy as an ONNX file, for runtimes without RoboJackson: observation in, action out.

Input `observation` (N, D) float32, output `action` (N, nu) float32 in -1..1. The file's metadata
holds the facts of the training as JSON.
"""

import json

import numpy as np

from robojackson.errors import MissingDependency
from robojackson.formats.format import PolicyExporter, PolicyNetwork

OPSET = 17
IR_VERSION = 8


def write(policy: PolicyNetwork) -> bytes:
    """Return the content of the file.

    Raises:
        MissingDependency: the onnx package is not installed.
    """
    try:
        from onnx import TensorProto, helper, numpy_helper
    except ImportError as error:
        raise MissingDependency(
            "ONNX files need the onnx package: pip install 'robojackson[onnx]'"
        ) from error
    nodes, weights, flowing = [], [], "observation"
    last = len(policy.layers) - 1
    for i, (weight, bias) in enumerate(policy.layers):
        names = f"weight{i}", f"bias{i}"
        for name, array in zip(names, (weight, bias), strict=True):
            weights.append(numpy_helper.from_array(np.ascontiguousarray(array, np.float32), name))
        nodes.append(helper.make_node("Gemm", [flowing, *names], [f"linear{i}"]))
        flowing = "action" if i == last else f"hidden{i}"
        kind = "Tanh" if i == last else "Relu"
        nodes.append(helper.make_node(kind, [f"linear{i}"], [flowing]))
    actions = policy.layers[-1][1].shape[0]
    seen = helper.make_tensor_value_info(
        "observation", TensorProto.FLOAT, ["N", policy.observation_size]
    )
    done = helper.make_tensor_value_info("action", TensorProto.FLOAT, ["N", actions])
    graph = helper.make_graph(nodes, "policy", [seen], [done], weights)
    opsets = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(graph, opset_imports=opsets, ir_version=IR_VERSION)
    helper.set_model_props(model, {"facts": json.dumps(dict(policy.facts), sort_keys=True)})
    result: bytes = model.SerializeToString()
    return result


EXPORT = PolicyExporter("onnx", write)
