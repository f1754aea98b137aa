"""When a dance was refreshed last for a robot, and what came of it: one JSON for each."""

import json
import logging
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Any

from configs.dance_book import Dance
from robojackson.files.json_types import to_json
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.run_names import slug_of
from storage.store import Store

log = logging.getLogger(__name__)

KIND = "refresh"
"""Beginning of the ids of its runs in the catalogue."""
FOLDER = "refresh"
SLACK = 0.1
"""Share of the days between two searches that a nightly run may come early."""


def is_due(store: Store, dance: Dance, robot: str, began: datetime) -> bool:
    """Return whether the refresh before this one began long enough ago; after a note that cannot
    be read, it is due.

    Args:
        robot: Name of the robot that the motions are for.
        began: Beginning of this refresh, with a time zone.
    """
    key = _key(dance, robot)
    if not store.exists(key):
        return True
    try:
        facts = json.loads(store.read(key))
        last = datetime.fromisoformat(facts.get("started_at") or facts["finished_at"])
        return began - last >= timedelta(days=dance.every_days * (1 - SLACK))
    except (ValueError, KeyError, TypeError, AttributeError) as cause:
        log.warning("%s cannot be read (%s): the dance is due", store.address(key), cause)
        return True


def note(
    store: Store, dance: Dance, robot: str, began: datetime, result: Mapping[str, Any]
) -> None:
    """Store the result and the times of a refresh."""
    times = {"started_at": began.isoformat(), "finished_at": datetime.now(UTC).isoformat()}
    facts = {**times, "dance": dance.name, "robot": robot, **result}
    store.put(_key(dance, robot), to_json(facts))


def _key(dance: Dance, robot: str) -> str:
    """Return the key of a note; that of the usual robot names none, as before there were others."""
    folder = FOLDER if robot == PipelineConfig().robot else f"{FOLDER}/{slug_of(robot)}"
    return f"{folder}/{slug_of(dance.name)}.json"
