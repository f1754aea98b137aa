"""Output of single stages: a few lines, a sentence with the verdict, the command to type next.

Everything is computed from the data that `--json` prints; `--verbose` prints all of it.
"""

import math
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from robojackson.cli.console import lines
from robojackson.cli.lifetime.interruption import program
from robojackson.files.json_types import number_of
from robojackson.motion.reference_motion import tempo_beside_clip
from robojackson.retarget.scorecard_gate import BARS, failures

Answer = Mapping[str, Any]
FULL, EMPTY, CELLS = "█", "·", 10
ROWS: tuple[tuple[str, str, str, int], ...] = (
    ("in the floor", "floor_penetration_mm", "mm", 1),
    ("in itself", "self_penetration_mm", "mm", 1),
    ("slip of planted feet", "planted_slip_cm_s", "cm/s", 2),
    ("gap under planted feet", "contact_gap_mm", "mm", 1),
    ("fastest joint", "speed_over_limit", "of its limit", 2),
    ("beyond motors or balance", "infeasible_share", "of the steps", 2),
)
"""Lines of the card: label, gated figure, unit, digits."""


def shown(answer: Answer, card: Sequence[str], verbose: bool) -> list[str]:
    """Return the card, or with `verbose` every figure of the answer and the closing lines."""
    return [*lines(answer), *closing(answer)] if verbose else list(card)


def closing(answer: Answer) -> list[str]:
    """Return the last lines of a command: the verdict, and the command to type next."""
    sentence = answer.get("verdict", {}).get("sentence", "")
    following = answer.get("next", "")
    return [*([sentence] if sentence else []), *([f"next: {following}"] if following else [])]


def command_line(*words: object) -> str:
    """Return a command that can be copied into a shell."""
    return shlex.join([program(), *map(str, words)])


def of_robot(robot: str | None) -> tuple[str, ...]:
    """Return the words that name again the robot that a command was given; none without one."""
    return () if robot is None else ("--robot", robot)


def score_lines(answer: Answer) -> list[str]:
    """Return the table of scores, the steadiest first and marked."""
    scored = [video for video in answer["videos"] if "score_per_second" in video]
    unread = [video for video in answer["videos"] if "error" in video]
    width = max((len(Path(v["video"]).name) for v in answer["videos"]), default=5)
    rows = [
        f"  {'video':<{width}}  score/s  missing  jitter  length  seen",
    ]
    for place, video in enumerate(scored):
        mark = "►" if place == 0 and video["detected"] else " "
        frames = max(video["frames"], 1)
        length = f"{video['frames'] / video['fps']:.1f} s"
        rows.append(
            f"{mark} {Path(video['video']).name:<{width}}  {video['score_per_second']:7.2f}  "
            f"{video['missing_joints']:7d}  {video['jitter']:6.2f}  {length:>6}  "
            f"{video['detected'] / frames:4.0%}"
        )
    rows.append("lower is steadier; score/s is missing landmarks and jitter a second")
    rows += [f"! {video['error']}" for video in unread]
    return [*rows, *closing(answer)]


def advice_lines(answer: Answer) -> list[str]:
    """Return advice for filming the clip again, a line each."""
    return [f"advice    {each['words']}" for each in answer.get("advice", ())]


def retarget_lines(answer: Answer) -> list[str]:
    """Return the card of a reference motion: ten lines with bars, and the verdict."""
    card = answer["scorecard"]
    kind = "cyclic" if answer["cyclic"] else "not cyclic"
    seconds, step_ms = answer["steps"] * answer["dt"], 1000 * answer["dt"]
    sway_cm = card.get("sway_cm", 0.0)
    sway = (
        [f"sway                      up to {sway_cm:.0f} cm, over the feet that stand"]
        if sway_cm
        else []
    )
    rows = [
        f"robot                     {answer['robot']}, {answer['steps']} steps of "
        f"{step_ms:.3g} ms, {seconds:.1f} s, {kind}",
        f"tempo                     {tempo_beside_clip(card):.2f} of the dancer's",
        f"keypoints                 {_figure(card, 'keypoint_leaned_mm', 1)} mm off, bones "
        f"{_figure(card, 'bone_deg', 1)} degrees",
        *sway,
        f"joint limits              {card['limit_violations']:.0f} violations",
    ]
    for words, name, unit, digits in ROWS:
        value, limit = card.get(name, math.nan), BARS[name]
        if value is None or not math.isfinite(value):
            continue
        figure = f"{value:.{digits}f} {unit}"
        rows.append(f"{words:<25} {figure:<18} {bar(value, limit)} at most {limit:g}")
    rows += [f"finding                   {finding}" for finding in card.get("findings", ())[:3]]
    rows += [f"{key:<25} {answer[key]}" for key in ("reference", "picture", "video", "hint")
              if key in answer]  # fmt: skip
    return [*rows, *closing(answer)]


def retarget_verdict(card: Mapping[str, Any]) -> dict[str, str]:
    """Return kind and sentence about a reference motion."""
    failed = failures(card)
    if failed:
        return {
            "kind": "refused",
            "sentence": f"The robot cannot follow this: {failed[0].replace('_', ' ')} is "
            f"{number_of(card.get(failed[0])):.3g}, at most {BARS[failed[0]]:g} is allowed.",
        }
    tempo = tempo_beside_clip(card)
    slow = "" if tempo > 0.995 else f" at {tempo:.2f} of the dancer's tempo"
    return {"kind": "feasible", "sentence": f"The robot can do this motion{slow}."}


def bar(value: float, limit: float) -> str:
    """Return how much of a limit is used, as a bar of ten cells."""
    share = (0.0 if value <= 0 else 1.0) if limit <= 0 else min(max(value / limit, 0.0), 1.0)
    full = math.ceil(share * CELLS - 0.05) if share else 0
    return FULL * full + EMPTY * (CELLS - full)


def train_lines(answer: Answer) -> list[str]:
    """Return the lines about a training."""
    return [
        f"trained   {answer['steps']:,} steps, {answer['updates']:,} updates, "
        f"{answer['episodes']:,} episodes in {answer['seconds'] / 60:.1f} min "
        f"({answer['stopped']} used up)",
        f"policy    {answer['policy']}",
        *closing(answer),
    ]


def train_verdict(updates: int, steps: int, survived_s: Sequence[float]) -> dict[str, str]:
    """Return kind and sentence about a training.

    Args:
        survived_s: Lengths of its last episodes, seconds.
    """
    if updates == 0:
        sentence = (
            f"Nothing was learnt: the {steps:,} steps ended before the first update. Give it more "
            "--steps or --minutes."
        )
        return {"kind": "untrained", "sentence": sentence}
    if not survived_s:
        return {"kind": "learning", "sentence": "No episode ended yet: train longer."}
    mean = sum(survived_s) / len(survived_s)
    count = len(survived_s)
    sentence = f"The last {count} episodes of the training lasted {mean:.1f} s on average."
    return {"kind": "trained", "sentence": sentence}


def _figure(card: Mapping[str, Any], name: str, digits: int) -> str:
    value = card.get(name)
    return "-" if value is None else f"{value:.{digits}f}"
