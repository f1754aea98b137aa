"""List the people in a video, with a picture of their numbers."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from robojackson.cli import console
from robojackson.cli.lifetime.video_process import in_video_process, probed
from robojackson.cli.video_range import video_range
from robojackson.files.file_tree import results_in
from robojackson.pipeline.yaml_loader import load

PICTURE = "people.png"


def list_people(
    video: Path,
    out: Path,
    range_s: tuple[float | None, float | None],
    config: str,
    overrides: Mapping[str, object],
    others: Mapping[str, object],
) -> tuple[dict[str, object], list[str]]:
    """Return all people in a video, as data and as lines; `--person N` selects one of them.

    Args:
        range_s: First and last moment that are listed, seconds; None is the video's.
        others: What else was requested, by its name on the command line; nothing can be done.
    Raises:
        BadConfiguration: something else was requested.
        NoPersonFound: no person is visible for long enough.
    """
    from robojackson.clips.people.people_picture import draw_people
    from robojackson.clips.people.tracked_people import track_people
    from robojackson.errors import BadConfiguration, NoPersonFound
    from robojackson.pipeline.pipeline_config import PipelineConfig

    if named := [name for name, value in others.items() if value]:
        raise BadConfiguration(f"--people only lists the people: omit {' and '.join(named)}")
    settings = load(PipelineConfig, config, overrides)
    with (
        video_range(video, None, out, range_s, config, overrides, kept=False) as clip,
        results_in(out) as files,
    ):
        info = probed(clip, settings.video)
        with console.bar(f"people of {clip.name}") as progress:
            dancer = settings.dancer
            cast = in_video_process(
                track_people, clip, info, dancer.detection, dancer.identity,
                frames=info.frames, progress=progress,
            )  # fmt: skip
        if not cast.rows:
            raise NoPersonFound(f"{cast}", clip)
        files.write(PICTURE, draw_people(clip, cast))
    people, picture = [each.later(range_s[0] or 0.0) for each in cast.people], str(out / PICTURE)
    rows = [asdict(person) for person in people]
    answer: dict[str, object] = {"video": str(video), "people": rows, "picture": picture}
    return answer, [*(f"person {person}" for person in people), f"picture  {picture}"]
