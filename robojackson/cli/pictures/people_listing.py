"""List the people in a video, with a picture of their numbers."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from robojackson.cli import console
from robojackson.cli.lifetime.video_process import in_video_process, probed
from robojackson.files.file_tree import results_in
from robojackson.pipeline.yaml_loader import load

PICTURE = "people.png"


def list_people(
    video: Path,
    out: Path,
    config: str,
    overrides: Mapping[str, object],
    start_s: float | None = None,
) -> tuple[dict[str, object], list[str]]:
    """Return all people in a video, as data and as lines; `--person N` selects one of them.

    Args:
        start_s: Where the clip begins in the video that was given: all moments are of that.
    Raises:
        NoPersonFound: no person is visible for long enough.
    """
    from robojackson.clips.people.people_picture import draw_people
    from robojackson.clips.people.tracked_people import track_people
    from robojackson.errors import NoPersonFound
    from robojackson.pipeline.pipeline_config import PipelineConfig

    settings = load(PipelineConfig, config, overrides)
    info = probed(video, settings.video)
    with results_in(out) as files:
        with console.bar(f"people of {video.name}") as progress:
            dancer = settings.dancer
            cast = in_video_process(
                track_people, video, info, dancer.detection, dancer.identity,
                frames=info.frames, progress=progress,
            )  # fmt: skip
        if not cast.rows:
            raise NoPersonFound(f"{cast}", video)
        files.write(PICTURE, draw_people(video, cast))
    people, picture = [each.later(start_s or 0.0) for each in cast.people], str(out / PICTURE)
    rows = [asdict(person) for person in people]
    answer: dict[str, object] = {"video": str(video), "people": rows, "picture": picture}
    return answer, [*(f"person {person}" for person in people), f"picture  {picture}"]
