"""One HTML page about one run: plain, offline, light or dark as the reader's system is.

The page needs nothing but itself and the video beside it; plots are inside. Everything that comes
from a file's name or a user is escaped by the template engine.
"""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2

from robojackson.report.quantities import POLICY_TITLES, Quantity, format_value, quantities
from robojackson.rl.config.evaluate_config import TRAINED
from robojackson.rl.evaluation.verdict import NEEDS_FULL_LENGTH

VERDICT_COLUMNS = (
    "survived_s", "success", "strict_success", "skill", "site_error_m", "limb_gain", "drift_m",
    "heading_error_deg",
)  # fmt: skip
NOT_TRAINED = "follows any motion, not trained on this one"
"""What a tracker does."""
TOO_SHORT = "too short"
"""In place of a figure that rollouts are too short to judge."""
SCORECARD_LINES = (
    "seconds", "cyclic", "keypoint_mm", "keypoint_p95_mm", "keypoint_leaned_mm", "lean_deg",
    "bone_deg", "limit_violations",
    "nan_count", "floor_penetration_mm", "self_penetration_mm", "planted_slip_cm_s",
    "contact_share", "joint_speed_max_rad_s", "torque_ratio_p95", "torque_over_share", "seam_deg",
    "infeasible_share", "fallen_share", "tempo_mean", "tempo_min",
)  # fmt: skip


@dataclass(frozen=True)
class Plot:
    """A picture with what it shows.

    Attributes:
        title: Short.
        caption: One sentence on how to read it.
        png: The picture.
    """

    title: str
    caption: str
    png: bytes


@dataclass(frozen=True)
class PageContent:
    """What the page shows; every mapping may be empty, and its section is then left out.

    Attributes:
        title: Of the dance.
        source: Name of the file, width, height, frames, fps, duration_s.
        stability: Fields of `Stability`.
        mocap: Figures of the recovered motion.
        scorecard: Of the reference motion.
        training: trainer, steps, updates, training_s, seed, ...
        evaluation: Summary of `Evaluation`, its `baselines` inside.
        video: Address of the mp4 relative to the page, or None.
        tracker_video: The same of a tracker's dance beside a trained one.
        plots: In the order they are shown.
        versions: Of programs and models.
        notes: Warnings for the reader.
        advice: What to do better when the clip is filmed again.
    """

    title: str
    source: Mapping[str, Any] = field(default_factory=dict)
    stability: Mapping[str, Any] = field(default_factory=dict)
    mocap: Mapping[str, Any] = field(default_factory=dict)
    scorecard: Mapping[str, Any] = field(default_factory=dict)
    training: Mapping[str, Any] = field(default_factory=dict)
    evaluation: Mapping[str, Any] = field(default_factory=dict)
    video: str | None = None
    tracker_video: str | None = None
    plots: Sequence[Plot] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    notes: Sequence[str] = ()
    advice: Sequence[str] = ()


@dataclass(frozen=True)
class _Section:
    title: str
    lines: Sequence[Quantity]


@dataclass(frozen=True)
class Verdict:
    """One row of the evaluation table."""

    title: str
    meaning: str
    values: Sequence[str]
    trained: bool


def render(content: PageContent) -> str:
    """The page as HTML."""
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    here = resources.files("robojackson.report.pages")
    template = environment.from_string(here.joinpath("page.html").read_text("utf-8"))
    return template.render(
        content=content,
        style=here.joinpath("page.css").read_text("utf-8"),
        headline=headline(content.evaluation),
        dancer=dancer_of(content.evaluation),
        trackers=list(content.evaluation.get("trackers", {})),
        tiles=_tiles(content.evaluation),
        columns=[Quantity("", "")] + quantities(dict.fromkeys(VERDICT_COLUMNS)),
        verdicts=verdicts(content.evaluation),
        passport_columns=[Quantity("", "")] + quantities(dict.fromkeys(PASSPORT_COLUMNS)),
        passport=passport_rows(content.evaluation),
        sections=_sections(content),
        plots=[(plot, base64.b64encode(plot.png).decode()) for plot in content.plots],
    )


def write_page(content: PageContent, out: Path) -> Path:
    """Write the page as one file; the video is expected beside it."""
    partial = out.with_name(out.name + ".partial")
    partial.write_text(render(content), encoding="utf-8")
    partial.replace(out)
    return out


def dancer_of(evaluation: Mapping[str, Any]) -> str:
    """Return who dances: the trained robot, or a tracker by its name."""
    name = evaluation.get("tracker")
    return POLICY_TITLES[TRAINED][0] if name is None else f"tracker {name}"


def headline(evaluation: Mapping[str, Any]) -> str:
    """Return one sentence that says how well it went, beside the best of the baselines."""
    if not evaluation:
        return ""
    said = str(evaluation.get("verdict", {}).get("sentence", ""))
    if evaluation.get("success") is None:
        return said
    said += " " if said else ""
    said += (
        f"The {dancer_of(evaluation)} finished {format_value('success', evaluation['success'])} of "
        f"{format_value('rollouts', evaluation['rollouts'])} rollouts without a fall"
    )
    baselines = evaluation.get("baselines", {})
    if not baselines:
        return f"{said}."
    name = max(baselines, key=lambda key: baselines[key]["success"])
    best = POLICY_TITLES.get(name, (name, ""))[0]
    theirs, ours = baselines[name]["success"], evaluation["success"]
    if theirs < ours:
        return f"{said}; the best baseline ({best}) {format_value('success', theirs)}."
    how = "as well" if theirs == ours else "better"
    figure = format_value("success", theirs)
    return f"{said}; a baseline that learnt nothing ({best}) does {how}: {figure}."


def _tiles(evaluation: Mapping[str, Any]) -> list[Quantity]:
    meanings = {
        "success": "no fall in a whole rollout",
        "survived_s": "mean time before a fall",
        "skill": "1 is perfect, 0 is the best frozen pose",
        "site_error_m": "mean distance of 14 points",
        "limb_gain": "1 is the whole amplitude",
    }
    found = {key: evaluation[key] for key in meanings if evaluation.get(key) is not None}
    return [
        Quantity(f.label, f.value, meanings[key])
        for key, f in zip(found, quantities(found), strict=True)
    ]


def verdicts(evaluation: Mapping[str, Any]) -> list[Verdict]:
    """Return the figures of the trained policy and of its baselines, ready to read."""
    if not evaluation:
        return []
    trackers = evaluation.get("trackers", {})
    policies = {TRAINED: evaluation, **trackers, **evaluation.get("baselines", {})}
    rows = []
    for name, figures in policies.items():
        title, meaning = POLICY_TITLES.get(name, (name, ""))
        if "tracker" in figures:
            title, meaning = dancer_of(figures), NOT_TRAINED
        short = evaluation.get("verdict", {}).get("kind") == "too_short"
        values = [
            TOO_SHORT
            if short and column in NEEDS_FULL_LENGTH
            else format_value(column, figures.get(column))
            for column in VERDICT_COLUMNS
        ]
        rows.append(Verdict(title, meaning, values, name == TRAINED))
    return rows


PASSPORT_COLUMNS = ("strict_success", "skill", "survived_s", "kept")


def passport_rows(evaluation: Mapping[str, Any]) -> list[Verdict]:
    """Return the figures of the policy under other physics, ready to read."""
    return [
        Verdict(
            row["case"], "", [format_value(key, row[key]) for key in PASSPORT_COLUMNS], index == 0
        )
        for index, row in enumerate(evaluation.get("passport", []))
    ]


def _sections(content: PageContent) -> list[_Section]:
    found = [
        _Section("Source clip", quantities(content.source)),
        _Section("Stability", quantities(content.stability)),
        _Section("Motion capture", quantities(content.mocap)),
        _Section("Retargeting", quantities(content.scorecard, SCORECARD_LINES)),
        _Section("Training", quantities(content.training)),
        _Section(
            "Versions", [Quantity(name, version) for name, version in content.versions.items()]
        ),
    ]
    return [section for section in found if section.lines]
