"""The episodes of a training as a table that is saved now and then while rows come in."""

import time
from collections.abc import Mapping
from typing import Any

from robojackson.files.file_tree import FileTree
from robojackson.pipeline.record_log import RecordLog
from robojackson.pipeline.table_schemas import EPISODE_RECORD

SAVE_SECONDS = 20.0
"""Least time between two writes, seconds."""


class EpisodeLog:
    """The file `episodes.parquet` of a training.

    Args:
        files: Folder of the training.
        common: Columns that are the same in every row.
        resumes: Whether the rows of an earlier sitting come first.
    """

    def __init__(self, files: FileTree, common: Mapping[str, object], resumes: bool) -> None:
        self._log = RecordLog(files, "episodes.parquet", EPISODE_RECORD, common, resumes)
        self._saved = time.monotonic()

    def __len__(self) -> int:
        return len(self._log)

    @property
    def rows(self) -> list[dict[str, Any]]:
        """All rows, of earlier sittings too."""
        return self._log.rows

    def add(self, rows: list[dict[str, float]]) -> None:
        """Append rows, and save at most every `SAVE_SECONDS`."""
        self._log.append(rows)
        if time.monotonic() - self._saved > SAVE_SECONDS:
            self.save()

    def save(self) -> None:
        """Write the file with all rows so far."""
        self._log.save()
        self._saved = time.monotonic()
