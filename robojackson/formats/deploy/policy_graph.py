"""The policy as ONNX, its residual on the reference folded in: target = default + scale * action.

Two files with one function. `mjlab` has the inputs and outputs of mjlab's and BeyondMimic's
exporters: `obs` (1, D) and `time_step` (1, 1) in; `actions` and the motion at that step out.
`plain` has `obs` and `actions` alone, as Unitree's C++ runner reads it. The observation is mjlab's
without state estimation, unscaled.

The policy adds a residual to the reference's next angles and sees its last residual. A runner knows
only its own last action: the graph finds the row of the motion that the command is, and subtracts
the angles of the row before from the action. It does not use `time_step`, which runners count
differently.
"""

from typing import Any, Literal

import numpy as np

from robojackson.errors import MissingDependency
from robojackson.formats.deploy.deployed_policy import DeployedPolicy, Link

OPSET, IR_VERSION = 17, 8
MOTION = ("joint_pos", "joint_vel", "body_pos_w", "body_quat_w", "body_lin_vel_w", "body_ang_vel_w")
Kind = Literal["mjlab", "plain"]


def policy_graph(
    policy: DeployedPolicy, motion: dict[str, np.ndarray], metadata: dict[str, str], kind: Kind
) -> bytes:
    """Return the content of the ONNX file.

    Args:
        motion: The arrays `MOTION`, a row a step, bodies as in `policy.bodies`.
        metadata: Metadata of the file.

    Raises:
        MissingDependency: the onnx package is not installed.
    """
    graph = _Graph()
    _policy_nodes(graph, policy, motion)
    inputs = [("obs", [1, policy.observation_size])]
    outputs = [("actions", [1, len(policy.joints)])]
    if kind == "mjlab":
        inputs.append(("time_step", [1, 1]))
        last = graph.constant(np.array([len(motion["joint_pos"]) - 1]), np.int64)
        whole = graph.add("Cast", "time_step", to=7)
        row = graph.add("Min", graph.add("Reshape", whole, graph.integers(1)), last)
        for name in MOTION:
            graph.add("Gather", graph.constant(motion[name]), row, out=name, axis=0)
            outputs.append((name, [1, *motion[name].shape[1:]]))
    return graph.model(inputs, outputs, metadata)


class _Graph:
    """Nodes and constants of a graph in construction; every tensor has one row."""

    def __init__(self) -> None:
        try:
            import onnx
        except ImportError as error:
            raise MissingDependency(
                "ONNX files need the onnx package: pip install 'robojackson[onnx]'"
            ) from error
        self._onnx = onnx
        self._nodes: list[Any] = []
        self._constants: list[Any] = []

    def add(self, operator: str, *inputs: str, out: str = "", **attributes: Any) -> str:
        """Append a node; return the name of its output."""
        name = out or f"v{len(self._nodes)}"
        self._nodes.append(self._onnx.helper.make_node(operator, inputs, [name], **attributes))
        return name

    def constant(self, values: Any, kind: Any = np.float32) -> str:
        """Append a constant; return its name."""
        name = f"c{len(self._constants)}"
        array = np.ascontiguousarray(values, kind)
        self._constants.append(self._onnx.numpy_helper.from_array(array, name))
        return name

    def integers(self, *values: int) -> str:
        """Append a list of integers: a shape, axes, or indices."""
        return self.constant(np.array(values), np.int64)

    def columns(self, name: str, indices: Any) -> str:
        """Take columns of a row."""
        return self.add("Gather", name, self.integers(*indices), axis=1)

    def model(
        self,
        inputs: list[tuple[str, list[int]]],
        outputs: list[tuple[str, list[int]]],
        metadata: dict[str, str],
    ) -> bytes:
        """Return the finished file."""
        helper, real = self._onnx.helper, self._onnx.TensorProto.FLOAT
        ends = [
            [helper.make_tensor_value_info(name, real, shape) for name, shape in each]
            for each in (inputs, outputs)
        ]
        graph = helper.make_graph(self._nodes, "policy", *ends, self._constants)
        opsets = [helper.make_opsetid("", OPSET)]
        model = helper.make_model(graph, opset_imports=opsets, ir_version=IR_VERSION)
        helper.set_model_props(model, metadata)
        self._onnx.checker.check_model(model)
        result: bytes = model.SerializeToString()
        return result


def _policy_nodes(graph: _Graph, policy: DeployedPolicy, motion: dict[str, np.ndarray]) -> None:
    """Add the nodes from `obs` to `actions`."""
    terms, at = {}, 0
    for name, size in policy.terms:
        terms[name] = graph.columns("obs", range(at, at + size))
        at += size
    count = len(policy.joints)
    angles = graph.columns("obs", range(count))
    speeds = graph.columns("obs", range(count, 2 * count))
    default, scale = graph.constant(policy.default[None]), graph.constant(policy.action_scale[None])
    row = _row_of(graph, terms["command"], motion)
    measured = graph.add("Add", terms["joint_pos"], default)
    turn = _root_turn(graph, policy.chain, terms["motion_anchor_ori_b"], measured, angles)
    last = _last_residual(graph, policy, terms["actions"], row, default, scale)
    seen = [graph.add("Sub", angles, default), speeds, turn]
    seen += [terms["base_ang_vel"], terms["joint_pos"], terms["joint_vel"], last]
    flowing = graph.add("Concat", *seen, axis=1)
    flowing = graph.add("Mul", flowing, graph.constant(policy.input_scale[None]))
    bounds = [graph.constant(np.array(sign * policy.input_clip)) for sign in (-1, 1)]
    flowing = graph.add("Clip", flowing, *bounds)
    for index, (weight, bias) in enumerate(policy.layers):
        flowing = graph.add("Gemm", flowing, graph.constant(weight), graph.constant(bias))
        flowing = graph.add("Relu" if index < len(policy.layers) - 1 else "Tanh", flowing)
    lead = graph.add("Gather", graph.constant(policy.lead), row, axis=0)
    apart = graph.add("Sub", graph.add("Add", angles, lead), default)
    graph.add("Add", graph.add("Div", apart, scale), flowing, out="actions")


def _row_of(graph: _Graph, command: str, motion: dict[str, np.ndarray]) -> str:
    """Return the index (1,) of the motion's row that is nearest to the command."""
    table = np.concatenate([motion["joint_pos"], motion["joint_vel"]], axis=1)
    away = graph.add("Sub", graph.constant(table), command)
    square = graph.add("ReduceSum", graph.add("Mul", away, away), graph.integers(1), keepdims=1)
    return graph.add("Reshape", graph.add("ArgMin", square, axis=0), graph.integers(1))


def _last_residual(
    graph: _Graph, policy: DeployedPolicy, actions: str, row: str, default: str, scale: str
) -> str:
    """Return the residual of the policy one step ago; zero before the first step, where the action
    is zero."""
    before = graph.add("Gather", graph.constant(targets_before(policy)), row, axis=0)
    apart = graph.add("Div", graph.add("Sub", default, before), scale)
    residual = graph.add("Add", apart, actions)
    bounds = [graph.constant(np.array(value)) for value in (-1.0, 1.0)]
    residual = graph.add("Clip", residual, *bounds)
    size = graph.add("ReduceSum", graph.add("Abs", actions), graph.integers(1), keepdims=1)
    begun = graph.add("Greater", size, graph.constant(np.zeros((1, 1))))
    return graph.add("Where", begun, residual, graph.constant(np.zeros((1, len(policy.joints)))))


def targets_before(policy: DeployedPolicy) -> np.ndarray:
    """Return the reference's targets one step before each row; in a repeated row, its own."""
    reference = policy.reference
    table = np.concatenate([reference.qpos[:, 7:], reference.qvel[:, 6:]], axis=1)
    targets = np.asarray(reference.qpos, float)[:, 7:] + policy.lead
    before: np.ndarray = np.roll(targets, 1, axis=0)
    if not reference.cyclic:
        before[0] = targets[0]
    held = np.flatnonzero(np.all(table[1:] == table[:-1], axis=1))
    before[held], before[held + 1] = targets[held], targets[held + 1]
    return before


def _root_turn(
    graph: _Graph, chain: tuple[Link, ...], anchor: str, measured: str, target: str
) -> str:
    """Return the first two columns (1, 6) of the reference's root in the robot's, from the anchors'
    rotations and the angles of the hinges between: rotations of the anchors are those of the roots
    times W."""
    first, second = graph.columns(anchor, (0, 2, 4)), graph.columns(anchor, (1, 3, 5))
    if not chain:
        return graph.add("Concat", first, second, axis=1)
    third = _cross(graph, first, second)
    rows = graph.add("Concat", first, second, third, axis=0)
    between = graph.add("Transpose", rows, perm=[1, 0])
    here, there = (_turned(graph, chain, angles) for angles in (measured, target))
    back = graph.add("Transpose", there, perm=[1, 0])
    turn = graph.add("MatMul", graph.add("MatMul", here, between), back)
    columns = graph.add("Transpose", turn, perm=[1, 0])
    flat = graph.add("Reshape", columns, graph.integers(1, 9))
    return graph.columns(flat, range(6))


def _turned(graph: _Graph, chain: tuple[Link, ...], angles: str) -> str:
    """Return the rotation of the anchor in the root (3, 3), by Rodrigues' formula."""
    result = graph.constant(np.eye(3))
    for link in chain:
        result = graph.add("MatMul", result, graph.constant(link.turn))
        if link.hinge is None:
            continue
        x, y, z = link.axis
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        angle = graph.add("Sub", graph.columns(angles, [link.hinge]), graph.constant([[link.zero]]))
        sine, cosine = graph.add("Sin", angle), graph.add("Cos", angle)
        rest = graph.add("Sub", graph.constant([[1.0]]), cosine)
        turn = graph.add("Mul", sine, graph.constant(cross))
        turn = graph.add("Add", turn, graph.add("Mul", rest, graph.constant(cross @ cross)))
        turn = graph.add("Add", turn, graph.constant(np.eye(3)))
        result = graph.add("MatMul", result, turn)
    return result


def _cross(graph: _Graph, first: str, second: str) -> str:
    """Return the cross product of two rows (1, 3)."""
    ahead, back = (1, 2, 0), (2, 0, 1)
    one = graph.add("Mul", graph.columns(first, ahead), graph.columns(second, back))
    other = graph.add("Mul", graph.columns(first, back), graph.columns(second, ahead))
    return graph.add("Sub", one, other)
