"""Closing lines of searches and studies: a sentence that rates the result, and the next command.

Everything is made from what a command answers; as `robojackson.cli.cards` does for single stages.
"""

import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from robojackson.cli.cards import command_line, of_robot
from robojackson.cli.lifetime.interruption import python, with_option
from robojackson.clips.web.untrusted_text import clean_text

Facts = Mapping[str, Any]
TITLE, REASON = 60, 120
"""Longest title and reason in a sentence, characters."""
FEW_SEEDS, MANY_SEEDS = 6, 10
"""Seeds below which no difference of two setups can be shown, and seeds that are advised."""


def find_verdict(found: Facts) -> dict[str, Any]:
    """Return `verdict` and `next` of a search.

    Args:
        found: `chosen`, `candidates`, `dropped` and `source` of the flow `find`.
    """
    candidates, chosen = found["candidates"], found["chosen"]
    if chosen is not None:
        fit = sum(row["decision"] in ("chosen", "accepted") for row in candidates)
        sentence = (
            f"{_title(chosen)} is the steadiest of {len(candidates)}, "
            f"{chosen['score_per_second']:.2f} a second (lower is steadier); {fit} may be danced."
        )
        return _closing("found", sentence, command_line("dance", chosen["url"]))
    if not candidates:
        dropped = len(found["dropped"])
        sentence = "The search found no video: other words may."
        if dropped:
            sentence = f"None of the {dropped} videos found was worth a download: other words may."
        return _closing("none", sentence, command_line("find", f"{found['dance']} tutorial"))
    reasons = Counter(clean_text(row["reason"], REASON) for row in candidates)
    reason, count = reasons.most_common(1)[0]
    sentence = (
        f"None of {len(candidates)} videos may be danced; of {count} the reason is: {reason}."
    )
    more = bool(found["dropped"])  # else all that there are were assessed
    following = with_option("--top", str(2 * len(candidates))) if more else ""
    return _closing("none", sentence, following)


def catalogue_verdict(rows: Sequence[Facts]) -> dict[str, Any]:
    """Return `verdict` and `next` of a catalogue that has rows."""
    dances = sorted({row["dance"] for row in rows})
    fit = [row for row in rows if row["decision"] in ("chosen", "accepted")]
    sentence = (
        f"{_videos(rows)} videos of {len(dances)} dance{'' if len(dances) == 1 else 's'} "
        f"were assessed, {_videos(fit)} may be danced."
    )
    if not fit:
        return _closing("none", sentence, command_line("find", dances[0]))
    return _closing("assessed", sentence, command_line("dance", fit[0]["url"]))


def metrics_verdict(rows: Sequence[Facts]) -> dict[str, Any]:
    """Return `verdict` and `next` of the overview of all studies."""
    studies = {row["study"] for row in rows}
    trusted = sum(row["strict_success"] is not None for row in rows)
    sentence = (
        f"{len(rows)} cells of {len(studies)} stud{'y' if len(studies) == 1 else 'ies'}; "
        f"{trusted} can be evaluated."
    )
    question = "SELECT move, setup, avg(skill) AS skill FROM evaluations GROUP BY ALL"
    return _closing("overview", sentence, command_line("metrics", "--sql", question))


def deploy_verdict(made: Facts) -> dict[str, Any]:
    """Return `verdict` and `next` of a registration."""
    sentence = (
        f"{len(made['deployments'])} deployments are registered; a worker of each pool runs them."
    )
    return _closing("registered", sentence, "prefect worker start --pool flows")


def refresh_lines(done: Facts) -> list[str]:
    """Return a line for every dance of a refresh."""
    rows = [
        f"{name}: {'new' if made['is_new'] else 'as before'}, {_title(made['chosen'])}, "
        f"{made['reference']}"
        for name, made in done["dances"].items()
    ]
    rows += [f"{name}: failed, {reason}" for name, reason in done["failed"].items()]
    return rows + [f"{name}: not due" for name in done["not_due"]]


def refresh_verdict(done: Facts, robot: str | None = None) -> dict[str, Any]:
    """Return `verdict` and `next` of a refresh.

    Args:
        robot: What `--robot` was given.
    """
    dances, failed = done["dances"], done["failed"]
    new = [name for name, made in dances.items() if made["is_new"]]
    if not dances and not failed:
        waiting = ", ".join(done["not_due"]) or "there is none in configs/dances.yaml"
        following = command_line("refresh", *done["not_due"][:1], *of_robot(robot))
        return _closing("not_due", f"No dance is due: {waiting}.", following)
    count = len(dances) + len(failed)
    sentence = f"{len(dances)} of {count} dances have a motion, {len(new)} of a new video."
    if failed:
        return _closing("failed", sentence, command_line("refresh", *failed, *of_robot(robot)))
    name = (new or list(dances))[0]
    reference = dances[name]["reference"]
    following = command_line("train", reference, "-o", name.replace(" ", "_"))
    if "://" in reference:  # `train` reads files of this machine
        following = command_line("dance", name, *of_robot(robot))
    return _closing("refreshed", sentence, following)


def ablation_verdict(made: Facts, steps: int, seeds: int, least_steps: int) -> dict[str, Any]:
    """Return `verdict` and `next` of a study.

    Args:
        made: `cells` and `page`.
        steps, seeds: Steps and seeds of the study.
        least_steps: Control steps of a training below which nothing is learnt.
    """
    if steps < least_steps:
        sentence = (
            f"{made['cells']} cells of {steps:,} steps show that every part runs; their numbers "
            "mean nothing."
        )
        return _closing("meaningless", sentence, command_line("ablation", "paper"))
    show = shlex.join([python(), "-m", "webbrowser", made["page"]])
    if seeds < FEW_SEEDS:
        sentence = (
            f"{made['cells']} cells are evaluated, but {seeds} seed{'' if seeds == 1 else 's'} can "
            f"show no difference between setups; {MANY_SEEDS} can. The page has the figures."
        )
        return _closing("few_seeds", sentence, show)
    sentence = f"{made['cells']} cells are evaluated; the page lists which claims hold."
    return _closing("evaluated", sentence, show)


def _closing(kind: str, sentence: str, following: str) -> dict[str, Any]:
    return {"verdict": {"kind": kind, "sentence": sentence}, "next": following}


def _videos(rows: Sequence[Facts]) -> int:
    """Return the number of videos; one may have been assessed several times."""
    return len({(row["source"], row["video_id"]) for row in rows})


def _title(row: Facts) -> str:
    return clean_text(row.get("title"), TITLE) or clean_text(row.get("video_id"), TITLE)
