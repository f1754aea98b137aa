"""The nightly flow: for every dance the best new video, as a motion that is ready to train.

Entry point of the deployments: `flows.refresh.refresh`. A dance whose search fails does not stop
the others; the result names which failed and why.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any

from prefect import flow
from prefect.artifacts import acreate_table_artifact
from prefect.logging import get_run_logger

from configs.dance_book import Dance, DanceBook
from configs.find_config import FindConfig
from flows.find import (
    BOOK,
    HUNTERS,
    in_good_quality,
    nothing,
    of_champion,
    run_id,
)
from flows.runtime.launch import launch
from flows.search.refresh_notes import KIND, is_due, note
from flows.search.search_artifacts import publish_search
from flows.search.search_entries import REASON_LENGTH, reason_of, rows
from flows.search.search_pipeline import search_and_rank, steadiest
from flows.video_pass.motion_stages import to_reference
from robojackson.cli.options import yaml_text
from robojackson.clips.web.untrusted_text import clean_text
from robojackson.errors import (
    BadConfiguration,
    NoPersonFound,
    SearchFailed,
    TrackTooShort,
    UnreadableVideo,
    VideoTooLong,
)
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.run_names import slug_of
from robojackson.pipeline.yaml_loader import build, load
from robojackson.robot.model import load_robot
from storage import candidate_catalogue
from storage.artifact import Artifact
from storage.leftovers import sweep
from storage.store import Store
from tasks.probe_video import SourceFile, probe_video

OF_THE_VIDEO = (UnreadableVideo, VideoTooLong, TrackTooShort, NoPersonFound)
"""Errors of a motion that another video may not have; all others are the machine's."""
MOST_TRIES = 4
"""Videos of a dance of which a night tries a motion: where more fail, the fault is another."""
CHOSEN_COLUMNS = ("video_id", "url", "title", "score_per_second", "stability_score")
Facts = dict[str, Any]


@flow(name="refresh", task_runner=HUNTERS)  # type: ignore[arg-type]
async def refresh(
    dances: list[str] | None = None,
    book: str = BOOK,
    config: str = "finding",
    overrides: Facts | None = None,
    pipeline: str = "base",
    pipeline_overrides: Facts | None = None,
    robot: str | None = None,
) -> Facts:
    """Search, score, choose, mocap and retarget, for every dance that is due.

    Args:
        dances: Names in the book, searched whether they are due or not; all that are due if absent.
        book: Name or path of the list of dances.
        config: Name or path of the configuration of the search.
        overrides: Overrides of that configuration, values by key path.
        pipeline: Name or path of the configuration of the stages after it.
        pipeline_overrides: Overrides of the pipeline.
        robot: Name of one of configs/robots; or path, where the worker is, of the YAML of your own;
            the pipeline's if absent.
    Raises:
        BadConfiguration: two dances of the book have the same letters and digits, or the robot's
            model is not here.
        SearchFailed: every dance failed; the message has the reasons.
    """
    store, began = Store.from_environment(), datetime.now(UTC)
    sweep(store, work=False)
    load(FindConfig, config, overrides)  # before any dance
    chosen = {} if robot is None else {"robot": yaml_text(robot)}
    stage_overrides = {**(pipeline_overrides or {}), **chosen}
    stages = load(PipelineConfig, pipeline, stage_overrides)
    dancer = load_robot(describe_robot(stages.robot)).description.name
    given = (config, overrides or {}, pipeline, stage_overrides)
    done: dict[str, Facts] = {}
    failed: dict[str, str] = {}
    waiting: list[str] = []
    for dance in _require_distinct(load(DanceBook, book)).pick(dances):
        if dances is None and not is_due(store, dance, dancer, began):
            waiting.append(dance.name)
            continue
        state = await refresh_dance(dance.name, asdict(dance), *given, return_state=True)
        result = await state.aresult(raise_on_failure=False)
        if isinstance(result, BaseException):
            failed[dance.name] = reason_of(result)
        else:
            done[dance.name] = result
            note(store, dance, dancer, began, result)
    candidate_catalogue.compact(store)
    await _log_summary(done, failed)
    if failed and not done:
        raise SearchFailed("; ".join(f"{name}: {reason}" for name, reason in failed.items()))
    return {"dances": done, "failed": failed, "not_due": waiting}


def run(
    dances: list[str] | None, config: str, overrides: Mapping[str, Any], robot: str | None = None
) -> Facts:
    """Return the flow from the command line.

    Args:
        robot: Name or file of the robot of the motions; None takes the pipeline's.
    Raises:
        DeploymentFailed: the Prefect server that is named does not answer, or refuses us.
    """
    return launch(refresh, dances, BOOK, config, dict(overrides), "base", {}, robot)


@flow(name="refresh-dance", flow_run_name="{name}", task_runner=HUNTERS)  # type: ignore[arg-type]
async def refresh_dance(
    name: str,
    dance: Facts,
    config: str,
    overrides: Facts,
    pipeline: str,
    pipeline_overrides: Facts,
) -> Facts:
    """Refresh one dance, from its name to a reference motion.

    Configurations are named, not given: what is given, overrides among it, is shown on Prefect's
    pages, and a file of configurations may hold the password of a proxy.

    Raises:
        SearchFailed: the source does not answer, or has no new video and none was chosen before.
        NoPersonFound: no video may be danced; the message has the reasons.
    """
    entry = build(Dance, dance, "dance")
    settings = load(FindConfig, config, overrides)
    store = Store.from_environment()
    stages = load(PipelineConfig, pipeline, pipeline_overrides)
    mine = (store, entry.name, KIND)  # assessments of `find` do not count here
    reigning = _best_so_far(mine, settings)
    seen, failing = candidate_catalogue.known(*mine), candidate_catalogue.failed(*mine)
    found = search_and_rank(entry, settings, run_id(KIND), seen, reigning, failing)
    listing = rows(found)
    chosen = listing[0] if found.chosen else reigning
    await publish_search(entry.name, listing, chosen)
    if chosen is None:
        raise NoPersonFound(nothing(found))
    video = in_good_quality(found.chosen, settings) if found.chosen else None
    is_new = found.chosen is not None
    for left in reversed(range(MOST_TRIES)):
        try:
            made = motion(store, video or of_champion(chosen, settings), stages)
            if chosen["decision"] != "chosen":
                chosen, is_new = {**chosen, **_decided("chosen", "")}, True
                candidate_catalogue.append(store, [chosen])
            break
        except OF_THE_VIDEO as cause:
            reason = f"no motion could be made of it: {reason_of(cause)}"
            candidate_catalogue.append(store, [{**chosen, **_decided("failed", reason)}])
            other = _best_so_far(mine, settings)
            if other is None or not left:
                raise
            title = clean_text(other["title"] or other["video_id"], REASON_LENGTH)
            get_run_logger().warning("%s: %s; %s is danced", entry.name, cause, title)
            chosen, video, is_new = other, None, False
    return {
        "run_id": found.run_id,
        "assessed": len(listing),
        "is_new": is_new,
        "chosen": {key: chosen[key] for key in CHOSEN_COLUMNS},
        **made,
    }


def motion(store: Store, video: Artifact, settings: PipelineConfig) -> Facts:
    """Return the mocap and retargeting of a video: what a training starts from."""
    with store.local(video) as path:
        clip = probe_video(SourceFile(path, video.sha256), settings.video, None, None)
    moved = to_reference(clip, describe_robot(settings.robot), settings)
    return {
        "video": store.address(clip["video"].key),
        "smpl": store.address(moved["smpl"].key),
        "reference": store.address(moved["reference"].key),
        "scorecard": json.loads(store.read(moved["scorecard"].key)),
    }


def _best_so_far(mine: tuple[Store, str, str], settings: FindConfig) -> Mapping[str, Any] | None:
    """Return the catalogue's row of the present choice, else of the steadiest that may be danced
    and never was.

    Args:
        mine: Store, dance, and kind of the runs.
    """
    reigning = candidate_catalogue.champion(*mine)
    return reigning or steadiest(candidate_catalogue.accepted(*mine), settings)


def _decided(decision: str, reason: str) -> Facts:
    """Return what a decision of now changes in a row of the catalogue."""
    when = datetime.now(UTC)
    return {"decision": decision, "reason": clean_text(reason, REASON_LENGTH), "decided_at": when}


def _require_distinct(book: DanceBook) -> DanceBook:
    """Return the book, or raise if two dances would share a catalogue key."""
    by_slug: dict[str, str] = {}
    for dance in book.dances:
        other = by_slug.setdefault(slug_of(dance.name), dance.name)
        if other != dance.name:
            raise BadConfiguration(
                f"dances: {other!r} and {dance.name!r} have the same letters and digits; rename one"
            )
    return book


async def _log_summary(done: dict[str, Facts], failed: dict[str, str]) -> None:
    """Log one table of all dances."""
    table = [
        {"dance": name, "result": "new" if facts["is_new"] else "as before",
         "video": clean_text(facts["chosen"]["title"]), "reason": ""}
        for name, facts in done.items()
    ]  # fmt: skip
    table += [
        {"dance": name, "result": "failed", "video": "", "reason": reason}
        for name, reason in failed.items()
    ]
    for name, reason in failed.items():
        get_run_logger().warning("%s: %s", name, reason)
    if table:
        await acreate_table_artifact(key="refresh", table=table, description="Dances refreshed")
