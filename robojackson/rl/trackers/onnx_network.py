"""An ONNX network as a function of numpy arrays, run by onnxruntime on one thread."""

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from robojackson.errors import BadPolicy, MissingDependency

if TYPE_CHECKING:
    from onnxruntime import InferenceSession, NodeArg

INSTALL = "pip install 'robojackson[trackers]'"
QUIET = 4
"""Log level of onnxruntime: fatal messages only, since its errors are raised anyway."""


class OnnxNetwork:
    """A network with one input (N, inputs) and one output (N, outputs), both float32.

    Args:
        inputs, outputs: Sizes that the caller needs.

    Raises:
        MissingDependency: onnxruntime is not installed.
        BadPolicy: the file is damaged, not ONNX, or has other sizes.
    """

    def __init__(self, path: Path, inputs: int, outputs: int) -> None:
        self._session = _session(path)
        found = [[_width(v) for v in values] for values in
                 (self._session.get_inputs(), self._session.get_outputs())]  # fmt: skip
        if found != [[inputs], [outputs]]:
            raise BadPolicy(
                f"{path}: a network of {_sizes(found[0])} inputs and {_sizes(found[1])} outputs; "
                f"one of {inputs} and {outputs} is needed"
            )
        self._input = self._session.get_inputs()[0].name

    def __call__(self, values: Float[np.ndarray, "N D"]) -> Float[np.ndarray, "N A"]:
        """Evaluate the network for N inputs at once.

        Raises:
            BadPolicy: the network cannot be run with a batch.
        """
        try:
            (result,) = self._session.run(None, {self._input: values.astype(np.float32)})
        except Exception as cause:  # onnxruntime has no common base of its errors
            raise BadPolicy(f"the network cannot be run: {_line(cause)}") from cause
        return np.asarray(result, float)


def has_runtime() -> bool:
    """Return whether onnxruntime is installed."""
    return find_spec("onnxruntime") is not None


def require_runtime() -> None:
    """Raise an error with the installation command if onnxruntime is missing.

    Raises:
        MissingDependency: onnxruntime is not installed.
    """
    if not has_runtime():
        raise MissingDependency(f"onnxruntime is not installed: {INSTALL}")


def _session(path: Path) -> "InferenceSession":
    require_runtime()
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = QUIET
    try:
        return onnxruntime.InferenceSession(
            path.read_bytes(), options, providers=["CPUExecutionProvider"]
        )
    except OSError as cause:
        raise BadPolicy(f"{path}: cannot be read ({cause.strerror})") from cause
    except Exception as cause:  # onnxruntime has no common base of its errors
        raise BadPolicy(f"{path}: not an ONNX network that can be run ({_line(cause)})") from cause


def _width(value: "NodeArg") -> int | None:
    """Return the length of a row of an input or output, None if it is not a matrix or has no
    size."""
    return value.shape[1] if len(value.shape) == 2 and isinstance(value.shape[1], int) else None


def _sizes(widths: list[int | None]) -> str:
    return " + ".join("?" if width is None else str(width) for width in widths) or "no"


def _line(cause: Exception) -> str:
    return " ".join(str(cause).split())[:160]
