"""One HTML page about one run: offline, light or dark like the reader's system.

The page is self-contained: player, motions, source clip and plots are inside; its content security
policy blocks everything else. Everything from a file's name or a user is escaped by the template
engine.
"""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from robojackson.report.pages import inline
from robojackson.report.pages.closeness import sentences
from robojackson.report.pages.evaluation_text import (
    PASSPORT_COLUMNS,
    VERDICT_COLUMNS,
    Verdict,
    beat_tiles,
    dancer_of,
    dancer_title,
    headline,
    passport_rows,
    tiles,
    verdicts,
)
from robojackson.report.quantities import Quantity, format_value, quantities
from robojackson.report.web.player_data import Player
from robojackson.retarget.scorecard_gate import BARS

FOLDED = ("Versions", "Files")
SCORECARD_LINES = (
    "seconds", "cyclic", "keypoint_mm", "keypoint_p95_mm", "keypoint_leaned_mm", "lean_deg",
    "sway_cm", "bone_deg", "limit_violations",
    "nan_count", "floor_penetration_mm", "self_penetration_mm", "planted_slip_cm_s",
    "contact_share", "joint_speed_max_rad_s", "torque_ratio_p95", "torque_over_share", "seam_deg",
    "infeasible_share", "fallen_share", "tempo_mean", "tempo_min",
)  # fmt: skip


@dataclass(frozen=True)
class Plot:
    """A picture with a title and a caption.

    Attributes:
        title: Short title.
        caption: One sentence on how to read it.
        png: The picture as PNG.
    """

    title: str
    caption: str
    png: bytes


@dataclass(frozen=True)
class PageContent:
    """The content of the page; every mapping may be empty, and its section is then left out.

    Attributes:
        title: Title of the dance.
        robot: Name of the robot.
        source: Name of the file, width, height, frames, fps, duration_s.
        stability: Fields of `Stability`.
        mocap: Figures of the recovered motion.
        scorecard: Score card of the reference motion.
        training: trainer, steps, updates, training_s, seed, ...
        evaluation: Summary of `Evaluation`, including its `baselines`.
        video: Address of the mp4 relative to the page, or None.
        tracker_video: Address of a tracker's dance beside a trained one, or None.
        plots: Plots in the order of the page.
        versions: Versions of programs and models.
        notes: Warnings for the reader.
        advice: Advice for filming the clip again.
        player: The four panes, their curves and the rows of their timeline.
        film: mp4 of the source pane, at the moments of the player.
        has_sound: Whether the film has sound.
        live: Address of the live dance relative to the page, or None.
        candidates: Clips that were scored.
        limbs, beats: Rows of figures by limb, and of beats of motions and music.
        provenance: Digests of the results.
        settings: The configuration, as YAML.
        next_step: What to do about a robot that does not dance and the option for it, or empty.
    """

    title: str
    robot: str = ""
    source: Mapping[str, object] = field(default_factory=dict)
    stability: Mapping[str, object] = field(default_factory=dict)
    mocap: Mapping[str, object] = field(default_factory=dict)
    scorecard: Mapping[str, Any] = field(default_factory=dict)
    training: Mapping[str, object] = field(default_factory=dict)
    evaluation: Mapping[str, Any] = field(default_factory=dict)
    video: str | None = None
    tracker_video: str | None = None
    plots: Sequence[Plot] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    notes: Sequence[str] = ()
    advice: Sequence[str] = ()
    player: Player | None = None
    film: bytes = b""
    has_sound: bool = False
    live: str | None = None
    candidates: Sequence["PageCandidate"] = ()
    limbs: Sequence[Verdict] = ()
    beats: Sequence[Verdict] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)
    settings: str = ""
    next_step: tuple[str, str] = ("", "")


@dataclass(frozen=True)
class PageCandidate:
    """A clip that was scored.

    Attributes:
        name: Name of the file.
        reason: Reason for or against its choice.
        chosen: Whether it is danced.
        thumbnail: JPEG as base64, or empty.
    """

    name: str
    reason: str
    chosen: bool
    thumbnail: str = ""


@dataclass(frozen=True)
class _Bar:
    """A gated figure beside its bar; `share` is the filled part of the bar, per cent."""

    label: str
    value: str
    bar: str
    share: float
    holds: bool


@dataclass(frozen=True)
class _Section:
    title: str
    lines: Sequence[Quantity]


LIMB_COLUMNS = ("limb", "confidence", "direction", "error", "gain", "R2", "excess, m/s")
BEAT_COLUMNS = ("", "beats", "precision", "recall", "F1", "BAS")
SCRIPTS = ("scene.js", "page.js")


def render(content: PageContent) -> str:
    """Return the page as HTML."""
    player, styles, scripts = content.player, [inline.own("page.css")], []
    if player is not None:
        styles.append(inline.asset("uplot.min.css"))
        scripts = [inline.asset("three.min.js"), inline.asset("uplot.min.js")]
        scripts += [inline.own(name) for name in SCRIPTS]
    evaluation, sections = content.evaluation, _sections(content)
    folded = [section for section in sections if section.title in FOLDED]
    return inline.render(
        "page.html",
        styles,
        scripts,
        security=inline.policy(scripts, styles),
        content=content,
        **_player_values(content),
        headline=headline(evaluation),
        dancer=dancer_of(evaluation),
        dancer_title=dancer_title(evaluation),
        trackers=list(evaluation.get("trackers", {})),
        tiles=tiles(evaluation) + beat_tiles(content.beats),
        columns=[Quantity("", "")] + quantities(dict.fromkeys(VERDICT_COLUMNS)),
        verdicts=verdicts(evaluation),
        closeness=sentences(evaluation),
        passport_columns=[Quantity("", "")] + quantities(dict.fromkeys(PASSPORT_COLUMNS)),
        passport=passport_rows(evaluation),
        least_kept=format_value("kept", evaluation.get("passport_least_kept")),
        limb_columns=[Quantity(name, "") for name in LIMB_COLUMNS],
        beat_columns=[Quantity(name, "") for name in BEAT_COLUMNS],
        bars=_bars(content.scorecard),
        sections=[section for section in sections if section not in folded],
        folded=folded,
        plots=[(plot, base64.b64encode(plot.png).decode()) for plot in content.plots],
    )


def _player_values(content: PageContent) -> dict[str, object]:
    """Return the template's values of the player."""
    player = content.player
    data = {} if player is None else player.data
    film = base64.b64encode(content.film).decode()
    bands = [] if player is None else player.bands
    return {
        "data": inline.json_text({**data, "video": film}),
        "bands": bands,
        "count": data.get("count", 0),
        "has_rollout": "trained" in data,
        "has_torque": bool(data.get("torque")),
        "has_sound": content.has_sound,
        "has_beats": any(span.kind in ("beat", "music") for b in bands for span in b.spans),
        "sites": 0 if player is None else len(player.error_m),
    }


def _bars(scorecard: Mapping[str, Any]) -> list[_Bar]:
    """Return the gated figures of the score card with their bars; a broken bar of 0 is full."""
    bars = []
    for key, bar in BARS.items():
        value = scorecard.get(key)
        if value is None:
            continue
        holds = bool(value <= bar)
        share = 100 * min(1.0, value / bar) if bar and value == value else 100.0 * (not holds)
        label = quantities({key: value})[0].label
        shown, limit = format_value(key, value), format_value(key, bar)
        bars.append(_Bar(label, shown, limit, round(share, 1), holds))
    return bars


def write_page(content: PageContent, out: Path) -> Path:
    """Write the page as one file; the video is expected beside it."""
    partial = out.with_name(out.name + ".partial")
    partial.write_text(render(content), encoding="utf-8")
    partial.replace(out)
    return out


def _sections(content: PageContent) -> list[_Section]:
    found = [
        _Section("Source clip", quantities(content.source)),
        _Section("Stability", quantities(content.stability)),
        _Section("Motion capture", quantities(content.mocap)),
        _Section("Retargeting", quantities(content.scorecard, SCORECARD_LINES)),
        _Section("Training", quantities(content.training)),
        *(
            _Section(title, [Quantity(name, value) for name, value in known.items()])
            for title, known in (("Versions", content.versions), ("Files", content.provenance))
        ),
    ]
    return [section for section in found if section.lines]
