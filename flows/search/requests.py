"""What `find` and `refresh` are asked for, checked before Prefect is imported."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

from configs.dance_book import Dance, DanceBook
from configs.find_config import FindConfig
from robojackson.clips.sources import folder, is_local
from robojackson.clips.sources import source as source_of
from robojackson.clips.web.untrusted_text import clean_text
from robojackson.pipeline.yaml_loader import build, load

ALL = 10_000
"""Files of a folder are all judged: nobody counted who watched them."""


def find_dance(query: str, source: str, address: str, top: int | None, config: FindConfig) -> Dance:
    """The dance to look for; a query that `configs/dances.yaml` knows means that dance.

    Raises:
        UnknownName: there is no such source.
        BadConfiguration: there is nothing to look for.
        SearchFailed: the folder or list is not there, or holds nothing.
    """
    search = source_of(source).search
    query = query.strip()
    words = {"name": clean_text(query, 60) or source, "query": query}
    dance = build(Dance, words | {"source": source, "address": address}, "find")
    if source == "youtube":
        dance = replace(load(DanceBook, "dances").find(query), source=source, address=address)
    if is_local(source):
        search(query, address, 1, config.web, datetime.now(UTC))
    return replace(dance, top=top or (ALL if source == folder.NAME else None))


def check_refresh(dances: Sequence[str] | None, config: str, overrides: Mapping[str, Any]) -> None:
    """Raise what the nightly flow would raise much later.

    Raises:
        UnknownName, BadConfiguration: a dance or the configuration cannot be used.
    """
    load(FindConfig, config, overrides)
    load(DanceBook, "dances").pick(dances)
