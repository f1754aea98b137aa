"""The gate: refuse a reference motion that training cannot follow, and name the remedy."""

from collections.abc import Mapping
from typing import Any

from robojackson.errors import RejectedReference
from robojackson.files.json_types import number_of
from robojackson.motion.reference_motion import ReferenceMotion

BARS: Mapping[str, float] = {
    "nan_count": 0.0,
    "limit_violations": 0.0,
    "quat_error": 1e-6,
    "floor_penetration_mm": 5.0,
    "self_penetration_mm": 5.0,
    "speed_over_limit": 1.0,
    "planted_slip_cm_s": 1.0,
    "planted_slip_p95_cm_s": 3.0,
    "contact_gap_mm": 5.0,
    "unsupported_share": 0.05,
    "seam_deg": 5.0,
    "seam_mm": 5.0,
    "seam_speed_rad_s": 1.0,
    "infeasible_share": 0.1,
    "fallen_share": 0.0,
}
"""Largest allowed value of each gated figure (issue 2, stage 4)."""
LEAST_FEASIBLE = 1.0 - BARS["infeasible_share"]
"""Least share of feasible steps."""

_FINDINGS = 2  # that an error message lists
_TELLING = ("nan_count", "fallen_share", "infeasible_share")
"""Figures that explain the others, the most telling first."""
_TRIM = "(`robojackson dance CLIP --start S --end S`)"
_SLOWER = "a slower tempo (--set retarget.tempo=0.7)"
_OPEN = "not to repeat it (--set retarget.cyclic=no)"
_FEET = f"a range of the clip in which both feet are in view {_TRIM}, or --method optimise"
_MENDING = {
    "infeasible_share": f"{_SLOWER}, a shorter range of the clip {_TRIM}, or another robot",
    "fallen_share": f"a range of the clip without it {_TRIM}",
    "seam_deg": _OPEN,
    "seam_mm": _OPEN,
    "seam_speed_rad_s": _OPEN,
    "speed_over_limit": _SLOWER,
    "planted_slip_cm_s": _FEET,
    "planted_slip_p95_cm_s": _FEET,
    "contact_gap_mm": _FEET,
    "unsupported_share": _FEET,
}


def failures(card: Mapping[str, float]) -> list[str]:
    """Return the names of the gated figures over their bars, the most telling first; a missing or
    non-finite figure fails."""
    order = (*_TELLING, *(name for name in BARS if name not in _TELLING))
    found = {name: card.get(name) for name in order}
    return [name for name, x in found.items() if x is None or not x <= BARS[name]]


def scorecard_record(motion: ReferenceMotion) -> dict[str, Any]:
    """Return the card as it is written beside the motion: its figures, and its findings in
    words."""
    found = motion.certificate
    return {**motion.scorecard, "findings": [str(f) for f in found.findings] if found else []}


def check(card: Mapping[str, Any]) -> None:
    """Apply the gate of training to a card with figures and findings (`scorecard_record`).

    Raises:
        RejectedReference: A figure is over its bar; the message names it and the remedy.
    """
    if not set(BARS) & set(card):
        raise RejectedReference(
            "reference refused: no score card shows whether the robot can follow it",
            "make one with `robojackson retarget`",
            forcible=True,
        )
    failed = failures(card)
    if failed:
        name = failed[0]
        others = f" (and {', '.join(failed[1:])})" if failed[1:] else ""
        value = number_of(card.get(name))
        raise RejectedReference(
            f"reference refused: {name} is {value:.4g}, at most {BARS[name]:g} is "
            f"allowed{others}{_reasons(name, card)}",
            f"try {_MENDING.get(name, '--method optimise')}",
            figure=name,
            value=value,
            limit=BARS[name],
            forcible=True,
        )


def _reasons(name: str, card: Mapping[str, Any]) -> str:
    """Return the first findings, where they are the reason of the refusal."""
    findings = card.get("findings", ())
    if name not in ("infeasible_share", "fallen_share") or not findings:
        return ""
    if name == "fallen_share":
        findings = sorted(findings, key=lambda each: "a fall" not in each)
    more = f" (and {len(findings) - _FINDINGS} more)" if len(findings) > _FINDINGS else ""
    return ": " + ", ".join(findings[:_FINDINGS]) + more
