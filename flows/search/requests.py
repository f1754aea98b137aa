"""Requests to `find` and `refresh`, checked before Prefect is imported."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

from configs.dance_book import Dance, DanceBook
from configs.find_config import FindConfig
from robojackson.clips.sources import folder, is_local, page_of, urls
from robojackson.clips.sources import source as source_of
from robojackson.clips.web.cookie_file import require_cookies
from robojackson.clips.web.reachability import require_reachable
from robojackson.clips.web.untrusted_text import clean_text, web_address
from robojackson.errors import SearchFailed
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.yaml_loader import build, load
from robojackson.robot.model import load_robot
from storage import candidate_catalogue
from storage.store import Store

log = logging.getLogger(__name__)
YOUTUBE = "youtube"
ALL = 10_000
"""Files of a folder are all assessed: they have no view counts."""


def find_dance(
    query: str, source: str | None, address: str, top: int | None, config: FindConfig
) -> Dance:
    """Return the dance to look for; without a source and an address, a query that the user's
    dances know means that dance, with its own source, address and number of videos.

    Args:
        top: How many videos are assessed; None is the dance's own number.
    Raises:
        UnknownName: there is no such source.
        BadConfiguration: there is nothing to look for.
        SearchFailed: the folder or list is not there, or holds nothing.
    """
    dance = _requested(query.strip(), source, address)
    search = source_of(dance.source).search
    if dance.source == folder.NAME:
        folder.videos(dance.full_query, dance.address)
    elif is_local(dance.source):
        search(dance.full_query, dance.address, 1, config.web, datetime.now(UTC))
    return replace(dance, top=top or dance.top)


def _requested(query: str, source: str | None, address: str) -> Dance:
    """Return a dance of the book, or one that is made of the words."""
    where = source or YOUTUBE
    source_of(where)
    if source is None and not address and query:
        return load(DanceBook, "dances").find(query)
    words = {"name": clean_text(query, 60) or where, "query": query}
    dance = build(Dance, words | {"source": where, "address": address}, "find")
    if where == YOUTUBE:
        return replace(load(DanceBook, "dances").find(query), source=where, address=address)
    return replace(dance, top=ALL if where == folder.NAME else None)


def require_online(dance: Dance, config: FindConfig) -> None:
    """Raise where the site of a dance's source cannot be reached, before Prefect is started.

    Raises:
        SearchFailed: one line with the reason and what to do.
        BadConfiguration: the cookie file cannot be read.
    """
    if dance.source != folder.NAME:
        require_cookies(config.web.cookies_file)
    page = page_of(dance.source, dance.full_query, dance.address)
    if dance.source == "site" and not page:
        raise SearchFailed("site: no address; give one such as https://host/search?q={query}")
    if page:
        require_reachable(page, config.web.proxy)


def require_findable(words: str, store: Store) -> None:
    """Raise where a dance that is given by its name can neither be searched nor was found before,
    or a video that is given by its address can neither be reached nor was downloaded before.

    Raises:
        SearchFailed, BadConfiguration: as `require_online`.
    """
    settings = load(FindConfig, "finding")
    if address := web_address(words):
        _require_video(address, settings, store)
        return
    dance = load(DanceBook, "dances").find(words.strip())
    try:
        require_online(dance, settings)
    except SearchFailed:
        if candidate_catalogue.champion(store, dance.name) is None:
            raise


def _require_video(address: str, settings: FindConfig, store: Store) -> None:
    """Raise where a video can neither be reached nor was downloaded before."""
    require_cookies(settings.web.cookies_file)
    try:
        require_reachable(address, settings.web.proxy)
    except SearchFailed:
        from tasks.download_video import WebVideo, stored_video

        (found,) = urls.search("", address, 1, settings.web, datetime.now(UTC))
        if stored_video(store, WebVideo.of(found)) is None:
            raise
        log.warning("%s cannot be reached: its stored video is used", found.url)


def check_refresh(
    dances: Sequence[str] | None, config: str, overrides: Mapping[str, Any], robot: str | None
) -> None:
    """Raise what the nightly flow would raise much later.

    Raises:
        UnknownName, BadConfiguration: a dance, the configuration or the robot cannot be used.
    """
    require_cookies(load(FindConfig, config, overrides).web.cookies_file)
    load(DanceBook, "dances").pick(dances)
    if robot is not None:
        load_robot(describe_robot(robot))
