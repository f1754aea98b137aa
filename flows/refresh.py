"""The nightly flow: for every dance the best new video, as a motion that is ready to train.

Entry point of the deployments: `flows.refresh.refresh`. A dance whose search fails does not stop
the others; the result names which failed and why.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime, timedelta
from typing import Any

from prefect import flow
from prefect.artifacts import acreate_table_artifact
from prefect.logging import get_run_logger

from configs.dance_book import Dance, DanceBook
from configs.find_config import FindConfig
from flows.find import (
    HUNTERS,
    in_good_quality,
    nothing,
    of_candidate,
    run_id,
)
from flows.runtime.launch import launch
from flows.search.search_artifacts import publish_search
from flows.search.search_entries import REASON_LENGTH, Entry, reason_of, rows
from flows.search.search_pipeline import search_and_rank
from flows.video_pass.motion_stages import to_reference
from robojackson.cli.options import yaml_text
from robojackson.clips.web.untrusted_text import clean_text
from robojackson.clips.web.video_candidate import VideoCandidate
from robojackson.errors import BadConfiguration, NoPersonFound, RoboJacksonError, SearchFailed
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.run_names import slug_of
from robojackson.pipeline.yaml_loader import build, load
from storage import candidate_catalogue
from storage.artifact import Artifact
from storage.leftovers import sweep
from storage.store import Store
from tasks.probe_video import SourceFile, probe_video

KIND = "refresh"
"""Beginning of the ids of its runs in the catalogue."""
FOLDER = "refresh"
CHOSEN_COLUMNS = ("video_id", "url", "title", "score_per_second", "stability_score")
SLACK = 0.1
"""Share of the days between two searches that a nightly run may come early."""
Facts = dict[str, Any]
BOOK = "dances"
"""Where the dances are named: a file of `configs`."""


@flow(name="refresh", task_runner=HUNTERS)  # type: ignore[arg-type]
async def refresh(
    dances: list[str] | None = None,
    book: str = BOOK,
    config: str = "finding",
    overrides: Facts | None = None,
    pipeline: str = "base",
    pipeline_overrides: Facts | None = None,
) -> Facts:
    """Search, score, choose, mocap and retarget, for every dance that is due.

    Args:
        dances: Names in the book, searched whether they are due or not; all that are due if absent.
        book: Name or path of the list of dances.
        config: Name or path of the configuration of the search.
        overrides: Overrides of that configuration, values by key path.
        pipeline: Name or path of the configuration of the stages after it.
        pipeline_overrides: Overrides of the pipeline; robot is a name of configs/robots, or the
            path, where the worker is, of the YAML of your own.
    Raises:
        BadConfiguration: two dances of the book have the same letters and digits.
        SearchFailed: every dance failed; the message has the reasons.
    """
    sweep(Store.from_environment(), work=False)
    settings = asdict(load(FindConfig, config, overrides))
    stages = [pipeline, pipeline_overrides or {}]
    done: dict[str, Facts] = {}
    failed: dict[str, str] = {}
    picked = _require_distinct(load(DanceBook, book)).pick(dances)
    due = [dance for dance in picked if dances is not None or _is_due(dance)]
    for dance in due:
        state = await refresh_dance(dance.name, asdict(dance), settings, *stages, return_state=True)
        result = await state.aresult(raise_on_failure=False)
        if isinstance(result, BaseException):
            failed[dance.name] = reason_of(result)
        else:
            done[dance.name] = result
            _note(dance, result)
    candidate_catalogue.compact(Store.from_environment())
    await _log_summary(done, failed)
    if failed and not done:
        raise SearchFailed("; ".join(f"{name}: {reason}" for name, reason in failed.items()))
    waiting = [dance.name for dance in picked if dance not in due]
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
    chosen = {} if robot is None else {"robot": yaml_text(robot)}
    return launch(refresh, dances, BOOK, config, dict(overrides), "base", chosen)


@flow(name="refresh-dance", flow_run_name="{name}", task_runner=HUNTERS)  # type: ignore[arg-type]
async def refresh_dance(
    name: str, dance: Facts, config: Facts, pipeline: str, pipeline_overrides: Facts
) -> Facts:
    """Refresh one dance, from its name to a reference motion.

    Raises:
        SearchFailed: the source does not answer, or has no new video and none was chosen before.
        NoPersonFound: no video may be danced; the message has the reasons.
    """
    entry = build(Dance, dance, "dance")
    settings = build(FindConfig, config, "config")
    store = Store.from_environment()
    stages = load(PipelineConfig, pipeline, pipeline_overrides)
    mine = (store, entry.name, KIND)  # assessments of `find` do not count here
    reigning = candidate_catalogue.champion(*mine)
    seen, failing = candidate_catalogue.known(*mine), candidate_catalogue.failed(*mine)
    found = search_and_rank(entry, settings, run_id(KIND), seen, reigning, failing)
    listing = rows(found)
    chosen = listing[0] if found.chosen else reigning
    await publish_search(entry.name, listing, chosen)
    if chosen is None:
        raise NoPersonFound(nothing(found))
    try:
        made = motion(store, _video(found.chosen, reigning, settings), stages)
    except RoboJacksonError as cause:
        if not found.chosen:
            raise
        candidate_catalogue.append(store, [{**listing[0], **_failed(cause)}])
        if reigning is None:
            raise
        get_run_logger().warning("%s: %s; the one before is danced", entry.name, cause)
        chosen = reigning
        made = motion(store, _video(None, reigning, settings), stages)
    return {
        "run_id": found.run_id,
        "assessed": len(listing),
        "is_new": chosen is not reigning,
        "chosen": {
            key: chosen[key]
            for key in ("video_id", "url", "title", "score_per_second", "stability_score")
        },
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


def _failed(cause: RoboJacksonError) -> Facts:
    """Return the catalogue's entry for a choice of which no motion could be made."""
    reason = clean_text(f"no motion could be made of it: {reason_of(cause)}", REASON_LENGTH)
    return {"decision": "failed", "reason": reason, "decided_at": datetime.now(UTC)}


def _video(chosen: Entry | None, reigning: Facts | None, settings: FindConfig) -> Artifact:
    """Return the file to dance: of the new choice, or of the video chosen before."""
    if chosen:
        return in_good_quality(chosen, settings)
    assert reigning
    candidate = VideoCandidate(
        video_id=reigning["video_id"],
        url=reigning["url"],
        title=reigning["title"] or "",
        query=reigning["query"] or "",
        source=reigning["source"],
    )
    scored = Artifact(key=reigning["video_key"], sha256=reigning["video_sha256"])
    return of_candidate(candidate, scored, settings)


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


def _is_due(dance: Dance) -> bool:
    """Return whether it was last searched long enough ago."""
    store, key = Store.from_environment(), _key(dance)
    if not store.exists(key):
        return True
    last = datetime.fromisoformat(json.loads(store.read(key))["finished_at"])
    return datetime.now(UTC) - last >= timedelta(days=dance.every_days * (1 - SLACK))


def _note(dance: Dance, result: Facts) -> None:
    """Store the result and its time."""
    facts = {"finished_at": datetime.now(UTC).isoformat(), "dance": dance.name, **result}
    text = json.dumps(facts, indent=1, default=str)
    Store.from_environment().put(_key(dance), text.encode())


def _key(dance: Dance) -> str:
    return f"{FOLDER}/{slug_of(dance.name)}.json"


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
