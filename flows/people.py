"""Who is in a video: a list, and a picture with their numbers."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from configs.loader import load
from flows import console, single

PICTURE = "people.png"


def list_people(
    video: Path, out: Path, config: str, overrides: Mapping[str, Any]
) -> tuple[dict[str, Any], list[str]]:
    """Everybody in a video, as an answer and as lines; `--person N` follows one of them.

    Raises:
        NoPersonFound: nobody is there for long enough.
    """
    from configs.pipeline import PipelineConfig
    from robojackson.clips.cast import look_around
    from robojackson.clips.portrait import portrait
    from robojackson.clips.video import probe
    from robojackson.errors import NoPersonFound

    settings = load(PipelineConfig, config, overrides)
    info = probe(video, settings.video)
    with single.results_in(out) as store:
        with console.bar(f"people of {video.name}") as progress:
            who = settings.dancer
            cast = look_around(video, info, who.crowd, who.identity, progress)
        if not cast.rows:
            raise NoPersonFound(f"{video}: {cast}")
        store.put(PICTURE, portrait(video, cast))
    people, picture = cast.people, str(out / PICTURE)
    told = {"video": str(video), "people": [asdict(p) for p in people], "picture": picture}
    return told, [*(f"person {person}" for person in people), f"picture  {picture}"]
