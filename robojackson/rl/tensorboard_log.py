"""Scalars for TensorBoard, written with its own package: no torch, no tensorflow."""

import math
import time
from collections.abc import Mapping
from pathlib import Path

from robojackson.errors import MissingDependency

LOGS = "tensorboard"
"""Folder of the logs of a training."""


class ScalarLog:
    """One event file in a folder.

    Raises:
        MissingDependency: TensorBoard is not installed.
    """

    def __init__(self, folder: Path) -> None:
        try:
            from tensorboard.summary.writer.event_file_writer import EventFileWriter
        except ImportError as error:
            raise MissingDependency(
                "logs for TensorBoard need its package: pip install tensorboard, "
                "or leave tensorboard off"
            ) from error
        folder.mkdir(parents=True, exist_ok=True)
        self._writer = EventFileWriter(str(folder))

    def add(self, step: int, values: Mapping[str, float]) -> None:
        """Log the finite values at a step."""
        from tensorboard.compat.proto.event_pb2 import Event
        from tensorboard.compat.proto.summary_pb2 import Summary

        scalars = [
            Summary.Value(tag=name, simple_value=value)
            for name, value in values.items()
            if math.isfinite(value)
        ]
        self._writer.add_event(
            Event(wall_time=time.time(), step=step, summary=Summary(value=scalars))
        )
        self._writer.flush()
