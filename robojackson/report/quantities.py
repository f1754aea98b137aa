"""Names, units and meaning of the figures on the page and in its plots."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

POLICY_TITLES: Mapping[str, tuple[str, str]] = {
    "trained": ("trained robot", ""),
    "regulator": ("feedback", "the linear feedback of the control law, without a policy"),
    "hold": ("torque held", "the trained robot with its torque held for a whole control step"),
    "statue": ("statue", "holds the pose it starts in"),
    "mean_pose": ("mean pose", "holds the mean pose of the dance"),
    "zero_residual": ("zero residual", "the reference's angles as targets, nothing learnt"),
    "random": ("random", "random corrections to the reference's angles"),
}
"""Titles and descriptions of the policies of the tables."""


@dataclass(frozen=True)
class Quantity:
    """One line of a table.

    Attributes:
        label: Name of the figure.
        value: Value with its unit, as text.
        meaning: Interpretation, or empty.
    """

    label: str
    value: str
    meaning: str = ""


@dataclass(frozen=True)
class _Form:
    """The format of a figure: factor, digits, unit."""

    label: str
    unit: str = ""
    digits: int = 0
    factor: float = 1.0
    meaning: str = ""


_FORMS: Mapping[str, _Form] = {
    "frames": _Form("frames"),
    "fps": _Form("frame rate", "fps", 2),
    "duration_s": _Form("length", "s", 2),
    "detected": _Form("frames with a person"),
    "missing_joints": _Form("missing landmarks M", meaning="summed over the clip"),
    "jitter": _Form("jitter J", "", 3, meaning="image units, summed over the clip"),
    "stability_score": _Form("stability score M + J", "", 2, meaning="the paper's sum"),
    "score_per_second": _Form("stability score a second", "1/s", 2, meaning="lower is steadier"),
    "missing_joints_per_frame": _Form("missing landmarks a frame", "", 2),
    "jitter_per_frame": _Form("jitter a frame", "", 4),
    "valid_share": _Form("frames seen, not filled in", "%", 1, 100.0),
    "contact_share": _Form("time with a foot on the floor", "%", 0, 100.0),
    "planted_share": _Form("time with a planted foot", "%", 0, 100.0),
    "height_m": _Form("height of the recovered person", "m", 2),
    "seconds": _Form("length", "s", 2),
    "steps": _Form("control steps"),
    "cyclic": _Form("cyclic"),
    "keypoint_mm": _Form(
        "keypoint error", "mm", 1, meaning="robot against the dancer's own motion"
    ),
    "keypoint_leaned_mm": _Form(
        "keypoint error, leaned", "mm", 1, meaning="against leaned targets"
    ),
    "lean_deg": _Form("lean of the targets", "deg", 1, meaning="to bring the body over the feet"),
    "sway_cm": _Form(
        "largest sway of the targets", "cm", 1, meaning="over the feet, at the centre of mass"
    ),
    "keypoint_p95_mm": _Form("keypoint error, 95th percentile", "mm", 1),
    "bone_deg": _Form("bone direction error", "deg", 1),
    "limit_violations": _Form("joint limit violations", meaning="must be 0"),
    "nan_count": _Form("values that are not numbers", meaning="must be 0"),
    "floor_penetration_mm": _Form("floor penetration", "mm", 2, meaning="at most 5"),
    "self_penetration_mm": _Form("self penetration", "mm", 2),
    "planted_slip_cm_s": _Form("slip of planted feet", "cm/s", 2),
    "joint_speed_max_rad_s": _Form("fastest joint", "rad/s", 2),
    "torque_ratio_p95": _Form("torque over limit, 95th percentile", "", 2, meaning="1 is all"),
    "torque_over_share": _Form("steps beyond a motor's torque", "%", 1, 100.0),
    "infeasible_share": _Form("steps that the robot cannot do", "%", 1, 100.0, "at most 10"),
    "fallen_share": _Form("steps that count as a fall", "%", 1, 100.0, "must be 0"),
    "tempo_mean": _Form("tempo beside the clip, mean", "", 2),
    "tempo_min": _Form("tempo beside the clip, slowest", "", 2),
    "seam_deg": _Form("jump at the seam of a cycle", "deg", 2),
    "seam_mm": _Form("gap at the seam of a cycle", "mm", 2),
    "seam_speed_rad_s": _Form("change of speed at the seam", "rad/s", 2),
    "speed_over_limit": _Form("fastest joint over its limit", "", 2),
    "quat_error": _Form("length of quaternions, error", "", 7),
    "planted_slip_p95_cm_s": _Form("slip of planted feet, 95th percentile", "cm/s", 2),
    "contact_gap_mm": _Form("height of planted feet", "mm", 2),
    "unsupported_share": _Form("steps without support", "%", 1, 100.0),
    "updates": _Form("gradient updates"),
    "training_s": _Form("training time", "min", 1, 1 / 60),
    "survived_s": _Form("survival", "s", 1),
    "success": _Form("success", "%", 0, 100.0),
    "strict_success": _Form("strict success", "%", 0, 100.0),
    "skill": _Form("skill", "", 2),
    "site_error_m": _Form("site error", "mm", 0, 1000.0),
    "limb_gain": _Form("limb gain", "", 2),
    "limb_r2": _Form("limb R2", "", 2),
    "excess_speed": _Form("excess speed", "", 2),
    "acceleration_ratio": _Form("accelerations, of the reference's", "", 2),
    "mpjpe_l_m": _Form("mpjpe, to the horizon", "mm", 0, 1000.0),
    "mpjpe_l_alive_m": _Form("mpjpe, until a fall", "mm", 0, 1000.0),
    "mpjpe_g_alive_m": _Form("mpjpe in the world, until a fall", "mm", 0, 1000.0),
    "drift_m": _Form("drift", "m", 2),
    "heading_error_deg": _Form("heading error", "deg", 1),
    "kept": _Form("kept", "%", 0, 100.0),
    "robust": _Form("robust"),
    "rollouts": _Form("rollouts"),
}
_FLAGS = ("cyclic",)
_NAMES = ("seed",)
"""Integers that name something instead of counting it: without separators."""


def quantity(key: str, value: Any) -> Quantity:
    """Return a figure by its key; an unknown key is its own label."""
    form = _FORMS.get(key, _Form(key.replace("_", " "), digits=3))
    return Quantity(form.label, format_value(key, value), form.meaning)


def format_value(key: str, value: Any) -> str:
    """Return a value with its unit; a dash where there is none."""
    form = _FORMS.get(key, _Form(key, digits=3))
    if key in _FLAGS or isinstance(value, bool):
        return "yes" if value else "no"
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "–"
    if not isinstance(value, int | float):
        return str(value)
    if key in _FORMS:
        number = decimal(value * form.factor, form.digits)
    elif isinstance(value, int):
        number = decimal(value, 0) if key not in _NAMES else str(value)
    else:
        number = f"{value:,.4g}"
    space = "" if form.unit == "%" else " "
    return f"{number}{space}{form.unit}".strip()


def decimal(value: float, digits: int) -> str:
    """Return a number with a real minus sign, and none before a zero."""
    text = f"{value:,.{digits}f}"
    if not text.startswith("-"):
        return text
    return f"\N{MINUS SIGN}{text[1:]}" if text.strip("-0.,") else text[1:]


def quantities(values: Mapping[str, object], only: tuple[str, ...] = ()) -> list[Quantity]:
    """Return a table of figures, in the order of `only` where it is given."""
    keys = [key for key in only if key in values] if only else list(values)
    return [quantity(key, values[key]) for key in keys]
