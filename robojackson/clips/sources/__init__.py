"""Sources of videos. A new source is one new file beside this one.

The file defines `search`, and its name is the name of the source. `IS_LOCAL = True` means that it
reads this machine's disk, so that a mistake is reported before anything is started; `page` names
the page of the web that it reads, so that a missing network is.
"""

from datetime import datetime
from importlib import import_module
from pkgutil import iter_modules
from typing import Protocol, cast

from robojackson.clips.web.untrusted_text import clean_text, web_address
from robojackson.clips.web.video_candidate import VideoCandidate
from robojackson.clips.web.yt_dlp_client import WebConfig
from robojackson.errors import SearchFailed, UnknownName


class Source(Protocol):
    """Interface of a file of this folder."""

    def search(
        self, query: str, address: str, count: int, config: WebConfig, now: datetime
    ) -> list[VideoCandidate]:
        """Return videos for a query, in the source's own order, nothing downloaded.

        Args:
            query: Words to look for; a source that cannot look for words offers all it has.
            address: Address of the folder, list, site or server; empty for the usual one.
            count: Largest number of videos.
            config: Rate limits, retries, proxy and cookies.
            now: Time that the candidates record.
        Raises:
            SearchFailed: the message has the source and the reason.
        """


def names() -> tuple[str, ...]:
    """Return all sources."""
    return tuple(sorted(module.name for module in iter_modules(__path__)))


def source(name: str) -> Source:
    """Return the source of a name.

    Raises:
        UnknownName: there is no such file; the message lists those that are.
    """
    if name not in names():
        raise UnknownName("source", name, "robojackson/clips/sources", names())
    return cast(Source, import_module(f"{__name__}.{name}"))


def is_local(name: str) -> bool:
    """Return whether a source reads this machine's disk.

    Raises:
        UnknownName: as `source`.
    """
    return bool(getattr(source(name), "IS_LOCAL", False))


def page_of(name: str, query: str, address: str) -> str:
    """Return the address of the web page that a source reads first; empty where there is none.

    Raises:
        UnknownName: as `source`.
        SearchFailed: it is no address of the web.
    """
    page = getattr(source(name), "page", None)
    named = page(query, address) if page else ""
    if named and not web_address(named):
        raise SearchFailed(f"{name}: {clean_text(named)} is no http address")
    return web_address(named)
