"""Turn the SOURCE of a dance into video files of this machine.

That may be the name of a dance, the address of a video on the web, or the path of a file or folder.
Names are searched and their steadiest video is downloaded; an address is downloaded as it is.
"""

import os
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated
from urllib.parse import urlsplit

from prefect.logging import get_run_logger
from pydantic import Field

from configs.dance_book import DanceBook
from configs.find_config import FindConfig
from flows.find import best, of_candidate
from flows.search.dance_source import is_name, resolve
from robojackson.clips.sources import urls
from robojackson.clips.video import SUFFIXES, list_videos
from robojackson.clips.web.file_version import versioned
from robojackson.clips.web.untrusted_text import web_address
from robojackson.config import config_dataclass
from robojackson.pipeline.run_names import run_name, slug_of
from robojackson.pipeline.yaml_loader import load
from storage.artifact import Artifact
from storage.store import Store

Source = Annotated[str, Field(min_length=1, max_length=1000, pattern=r"\S")]
Seconds = Annotated[float, Field(ge=0)]
Minutes = Annotated[float, Field(gt=0)]


@config_dataclass
class Search:
    """Search settings for a dance that is given by its name.

    Attributes:
        config: Name or path of the configuration of the search.
        book: Name or path of the list of dances; a name that is not in it is searched as it is.
    """

    config: str = "finding"
    book: str = "dances"


@asynccontextmanager
async def videos_of(source: str, search: Search) -> AsyncIterator[tuple[Path, ...]]:
    """Yield the local files of the inputs.

    Raises:
        UnreadableVideo: it looks like a path and is not there, or holds no video.
        SearchFailed: no answer from the web, and no earlier search has chosen a video.
        NoPersonFound: no video of the search may be danced; the message has the reasons.
    """
    source = _bare(source)
    if web_address(source):
        with _file(*of_address(source, search)) as path:
            yield (path,)
    elif is_name(source):
        with _file(*await of_name(source, search)) as path:
            yield (path,)
    else:
        yield list_videos(resolve(source))


async def of_name(words: str, search: Search) -> tuple[str, Artifact]:
    """Return the best video of a dance in good quality, and its name.

    When the search fails, the video that an earlier one chose is taken.
    """
    dance = load(DanceBook, search.book).find(words)
    chosen = await best(dance.name, asdict(dance), search.config)
    return slug_of(dance.name), Artifact(**chosen)


def of_address(address: str, search: Search) -> tuple[str, Artifact]:
    """Return a video of the web in good quality, and the name of its file or that of its page.

    Raises:
        SearchFailed: it cannot be found or downloaded; the message has the reason.
    """
    settings = load(FindConfig, search.config)
    named = urls.search("", address, 1, settings.web, datetime.now(UTC))
    (candidate,) = versioned(named, settings.web)
    get_run_logger().info("bringing %s", candidate.url)
    file = Path(candidate.title)
    name = file.stem if file.suffix.lower() in SUFFIXES else name_of(address)
    return slug_of(name), of_candidate(candidate, None, settings)


def name_of(source: str) -> str:
    """Return what to call the run of a source: the dance, or the file or folder without its path.

    Args:
        source: Name of a dance, address of a video, or path.
    """
    source = _bare(source)
    if web_address(source):
        parts = urlsplit(source)
        return run_name(parts.query or parts.path)
    return run_name(source if is_name(source) else Path(source).absolute().stem)


def _bare(source: str) -> str:
    """Return a SOURCE without spaces around it, unless it is the path of a file that has some."""
    return source if os.path.exists(source) else source.strip()


@contextmanager
def _file(name: str, video: Artifact) -> Iterator[Path]:
    """Yield an artifact as a file that has a name."""
    store = Store.from_environment()
    with store.scratch() as folder:
        path = folder / f"{name or 'dance'}{Path(video.name).suffix}"
        path.write_bytes(store.read(video.key))
        yield path
