"""The results of the mocap benchmark as Markdown tables."""

from collections.abc import Mapping
from typing import Any

from benchmarks.mocap.truth import HELD_OUT

NAMES = ("raw", "filtered", "step 1", "step 2", "step 3", "best")
JOINTS = {
    "pa_mpjpe_mm": ("PA-MPJPE mm", "{:.0f}"),
    "rr_mpjpe_mm": ("RR-MPJPE mm", "{:.0f}"),
    "mpjve_mm_s": ("MPJVE mm/s", "{:.0f}"),
    "speed_ratio": ("speed ratio", "{:.2f}"),
    "velocity_gain": ("velocity gain", "{:.2f}"),
    "acceleration_ratio": ("acceleration ratio", "{:.2f}"),
}
GROUND = {
    "velocity_score": ("velocity score", "{:.2f}", 1.0),
    "knee_bias_deg": ("bent knees off", "{:+.0f}°", 1.0),
    "knee_gain": ("knees' gain", "{:.2f}", 1.0),
    "tilt_deg": ("gravity error", "{:.1f}°", 1.0),
    "path_error": ("root path error", "{:.1f} %", 100.0),
    "touching_f1": ("touching F1", "{:.2f}", 1.0),
    "planted_f1": ("planted F1", "{:.2f}", 1.0),
    "unsupported_share": ("unsupported", "{:.1f} %", 100.0),
    "floating_share": ("floating", "{:.1f} %", 100.0),
    "slide_cm_s": ("slide cm/s", "{:.1f}", 1.0),
    "true_slide_cm_s": ("truth's own", "{:.1f}", 1.0),
    "penetration_mm": ("in floor mm", "{:.1f}", 1.0),
}
Result = Mapping[str, Any]


def markdown(result: Result) -> str:
    """Return the joint errors, ground and feet, speeds; what was tuned on what."""
    names = [name for name in NAMES if name in result["clips"][0]["rows"]]
    parts = [_joints(result, names), _ground(result), _speeds(result)]
    if "official" in result:
        parts.append(_official(result["official"]))
    tuned = [f"- {clips}: {what}" for clips, what in result["tuned"].items()]
    parts.append("Tuned on what:\n" + "\n".join(tuned))
    return "\n\n".join(parts) + "\n"


def _joints(result: Result, names: list[str]) -> str:
    """Return one line a clip, a group's mean in bold; each cell lists the rows."""
    head = ["clip", *(title for title, _ in JOINTS.values())]
    lines = [_cells([clip["clip"] + _mark(clip), *_values(clip["rows"], names)])
             for clip in result["clips"]]  # fmt: skip
    for group, means in result["means"].items():
        lines.append(_cells([f"**mean {group}**", *_values(means, names)]))
    return f"Each cell: {' / '.join(names)}.\n\n" + _table(head, lines)


def _ground(result: Result) -> str:
    """Return the ground and feet of the default."""
    name = result["default"]
    head = ["clip", *(title for title, _, _ in GROUND.values())]
    lines = []
    for clip in result["clips"]:
        figures = clip["rows"][name]
        shown = [
            form.format(figures[key] * factor) if key in figures else "-"
            for key, (_, form, factor) in GROUND.items()
        ]
        lines.append(_cells([clip["clip"] + _mark(clip), *shown]))
    return f"Ground and feet of {name}.\n\n" + _table(head, lines)


def _speeds(result: Result) -> str:
    clips = result["clips"]
    detect = [clip["detect_fps"] for clip in clips]
    recover = [clip["rows"][result["default"]]["recover_fps"] for clip in clips]
    whole = [1.0 / (1.0 / a + 1.0 / b) for a, b in zip(detect, recover, strict=True)]
    return (
        f"Frames a CPU second: landmarks and background {min(detect):.0f}-{max(detect):.0f}, "
        f"motion {min(recover):.0f}-{max(recover):.0f}, both {min(whole):.0f}-{max(whole):.0f}; "
        f"the solve alone {result['solve_fps']:,.0f}."
    )


def _official(found: Mapping[str, Mapping[str, Any]]) -> str:
    lines = []
    for name, figures in found.items():
        agreed = figures.get("agreement", {})
        pairs = [
            " / ".join(f"{agreed[row][key]:.0f}" for row in ("raw landmarks", "ours")) if agreed
            else "-" for key in ("mpjpe_mm", "pa_mpjpe_12_mm")
        ]  # fmt: skip
        cells = [f"{figures['solve_mm']:.1f}", f"{figures['constant_twist_deg']:.1f}", *pairs]
        lines.append(_cells([name, *cells]))
    head = ["official output", "our solve mm", "constant twist deg",
            "raw / our motion mm", "twelve joints, PA-MPJPE mm"]  # fmt: skip
    return _table(head, lines)


def _values(rows: Mapping[str, Mapping[str, float]], names: list[str]) -> list[str]:
    return [
        " / ".join(form.format(rows[name][key]) for name in names)
        for key, (_, form) in JOINTS.items()
    ]


def _mark(clip: Mapping[str, Any]) -> str:
    return "" if clip["clip"] in HELD_OUT else " (tuned)"


def _cells(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _table(head: list[str], lines: list[str]) -> str:
    return "\n".join([_cells(head), _cells(["---"] * len(head)), *lines])
