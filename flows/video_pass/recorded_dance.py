"""A dance whose every stage is recorded, answered from the records. No Prefect in memory.

Starting a flow takes seven to ten seconds, nearly all of it Prefect's imports and its temporary
server.
"""

import asyncio
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flows.video_pass.dance_stages import make_dance
from robojackson.clips.video import list_videos
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load
from storage.leftovers import sweep
from storage.store import Store
from tasks.runtime.stage import NotRecorded, records_only

REFRESH = "PREFECT_TASKS_REFRESH_CACHE"
"""Prefect's variable that has every task run although it is recorded."""
TRUE = ("1", "true", "yes", "on", "y", "t")


def replay(
    source: Path,
    config: str,
    overrides: Mapping[str, Any],
    start_s: float | None = None,
    end_s: float | None = None,
) -> dict[str, Any] | None:
    """Return the answer of the flow `dance`, or None where a stage would have to run.

    Args:
        source: A video or a folder of them.
        config, overrides: Configuration of the pipeline and its overrides.
        start_s, end_s: Range of the video, seconds.
    Raises:
        RoboJacksonError: what the flow would raise from the same records.
    """
    if os.environ.get(REFRESH, "").lower() in TRUE:
        return None
    store = Store.from_environment()
    settings = load(PipelineConfig, config, overrides)
    sweep(store, work=False)
    try:
        with records_only():
            paths = list_videos(source)
            return asyncio.run(make_dance(store, paths, settings, start_s, end_s)).answer
    except NotRecorded:
        return None
