"""Output of `mocap`: what was recovered, how far it may be trusted, and what comes next."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from robojackson.cli.cards import Answer, advice_lines, closing
from robojackson.clips.quality.advice import HALF_TURN, QUARTER_TURN

if TYPE_CHECKING:
    from robojackson.motion.smpl_sequence import SmplSequence

WHOLE, MOSTLY = 0.95, 0.7
"""Shares of frames with the person from which a motion counts as whole, or as having gaps."""
CUT_OFF = 0.5
"""Share of frames in which the body leaves the picture from which a motion is largely invented."""
OFF_PICTURE_M, UNDER_FLOOR_M = 0.25, 0.1
"""Distance from the landmarks (median), and depth under the floor, of a motion that is wrong."""
SHORTEST_S = 0.25
"""Shortest motion that is retargeted, about; seconds."""
RISE = 0.5
"""Vertical part of a trunk's direction below which it lies, and hangs below its negative."""
TURNED = 0.5
"""Share of frames in which a person hangs or lies from which the picture may be turned."""


def contact_shares(sequence: "SmplSequence") -> dict[str, float]:
    """Return the share of the frames in which each point of the feet is planted."""
    from robojackson.motion.smpl_sequence import CONTACT_POINTS, PLANTED

    shares = (sequence.contact == PLANTED).mean(0)
    return dict(zip(CONTACT_POINTS, map(float, shares), strict=True))


def floor_figures(sequence: "SmplSequence") -> dict[str, object]:
    """Return the source of the floor, the distance of the lowest keypoint from it, metres, and the
    shares of the frames in which the trunk lies or hangs."""
    import numpy as np

    from robojackson.body.forward_kinematics import unit
    from robojackson.body.skeleton import keypoint

    lowest = sequence.keypoints_w[:, :, 2].min(1)
    trunk = sequence.keypoints_w[:, keypoint("neck")] - sequence.keypoints_w[:, keypoint("pelvis")]
    rise = unit(trunk)[:, 2]
    shares = {"head_down_share": (rise < -RISE).mean(), "lying_share": (abs(rise) <= RISE).mean()}
    keys = ("gravity", "tilt_deg", "gravity_sd_deg", "gravity_sure")
    known = {key: sequence.camera[key] for key in keys if key in sequence.camera}
    return {"lowest_keypoint_m": lowest.min(), "median_m": np.median(lowest), **shares, **known}


def mocap_lines(answer: Answer) -> list[str]:
    """Return the lines about a recovered motion."""
    feet = ", ".join(
        f"{name.replace('_', ' ')} {share:.0%}" for name, share in answer["contact_share"].items()
    )
    seconds = answer["frames"] / answer["fps"]
    lowest_cm = 100 * answer["floor"]["lowest_keypoint_m"]
    side = "under" if lowest_cm < 0 else "above"
    rows = [
        f"frames    {answer['frames']} at {answer['fps']:.4g} a second, {seconds:.1f} s",
        f"person    {answer['person']}, seen in {answer['detected']} of {answer['frames']} frames",
        f"planted   {feet} of the time",
        f"floor     lowest point {abs(lowest_cm):.1f} cm {side} it",
    ]
    rows += _up_lines(answer["floor"])
    rows += _reprojection_lines(answer)
    rows += [f"note      {note}" for note in answer["notes"]]
    rows += advice_lines(answer)
    rows += [f"motion    {answer['smpl']}"]
    rows += [f"{key:<9} {answer[key]}" for key in ("picture", "film") if key in answer]
    return [*rows, *closing(answer)]


def with_verdict(answer: dict[str, object]) -> dict[str, object]:
    """Return the answer with its verdict; without a next command where that would be refused."""
    verdict = mocap_verdict(answer)
    if verdict["kind"] == "short":
        answer = {key: value for key, value in answer.items() if key != "next"}
    return answer | {"verdict": verdict}


SOURCES_OF_UP = {
    "scene": "straight edges of the room",
    "network": "the body alone",
    "balance": "the body alone",
    "camera": "the camera",
}


def _up_lines(floor: Answer) -> list[str]:
    """Return the line about the direction of up, and how sure it is."""
    if "tilt_deg" not in floor:
        return []
    source = SOURCES_OF_UP[floor["gravity"]]
    sure = ", sure" if floor.get("gravity_sure") else ", not sure"
    within = f": within {floor['gravity_sd_deg']:.0f} degrees" if "gravity_sd_deg" in floor else ""
    tilt = f"the camera is tilted by {floor['tilt_deg']:.0f}"
    return [f"up        from {source}{sure}{within}; {tilt}"]


def _reprojection_lines(answer: Answer) -> list[str]:
    if (found := answer.get("reprojection")) is None:
        return []
    rows = [f"overlay   {100 * found['median_m']:.0f} cm off the landmarks (median)"]
    advice = "" if found["left_out"] else " (leave them out: --set mocap.leave_out_weak=true)"
    if weak := _parts(found["weak_s"]):
        rows.append(f"weak      {weak}{advice}")
    if filled := _parts(found["filled_s"]):
        rows.append(f"filled in {filled}")
    return rows


def _parts(parts: Sequence[tuple[float, float]]) -> str:
    """Return the stretches, those that are closer than can be read as one."""
    joined: list[list[float]] = []
    for start, end in parts:
        if joined and start - joined[-1][1] < 0.15:
            joined[-1][1] = end
        else:
            joined.append([start, end])
    return ", ".join(f"{start:.1f}-{end:.1f} s" for start, end in joined)


def mocap_verdict(answer: Answer) -> dict[str, str]:
    """Return kind and sentence about a recovered motion, the gravest reason for doubt first.

    Args:
        answer: What `mocap` prints as JSON.
    """
    for kind, sentence_of in _DOUBTS:
        if sentence := sentence_of(answer):
            return {"kind": kind, "sentence": sentence}
    return {"kind": "whole", "sentence": "The motion is whole: the person is in view all along."}


def _seen(answer: Answer) -> float:
    return float(answer["detected"] / max(answer["frames"], 1))


def _short(answer: Answer) -> str:
    if (seconds := answer["frames"] / answer["fps"]) >= SHORTEST_S:
        return ""
    return f"{seconds:.2f} s are too short to retarget: at least {SHORTEST_S:g} s are needed."


def _poor(answer: Answer) -> str:
    if (share := _seen(answer)) >= MOSTLY:
        return ""
    return f"The person is seen in only {share:.0%} of the frames: choose another range or clip."


def _head_down(answer: Answer) -> str:
    if (share := answer["floor"]["head_down_share"]) <= TURNED:
        return ""
    return f"The person is head down in {share:.0%} of the frames; {HALF_TURN}."


def _doubtful(answer: Answer) -> str:
    off = answer.get("reprojection", {}).get("median_m", 0.0)
    under = -answer["floor"]["lowest_keypoint_m"]
    if off <= OFF_PICTURE_M and under <= UNDER_FLOOR_M:
        return ""
    where = f"{off:.2f} m off the landmarks, up to {max(under, 0.0):.2f} m under the floor"
    return f"The motion cannot be right ({where}): choose another range; {QUARTER_TURN}."


def _cut_off(answer: Answer) -> str:
    outside = {each["kind"]: each["value"] for each in answer["advice"]}.get("body_outside", 0.0)
    if outside <= CUT_OFF:
        return ""
    return f"The body is cut off in {outside:.0%} of the frames: what is not in view is invented."


def _gaps(answer: Answer) -> str:
    if (share := _seen(answer)) >= WHOLE:
        return ""
    return f"The person is out of sight in {1 - share:.0%} of the frames, which are filled in."


def _lying(answer: Answer) -> str:
    if (share := answer["floor"]["lying_share"]) <= TURNED:
        return ""
    return f"The person lies or bows in {share:.0%} of the frames; {QUARTER_TURN}."


_DOUBTS: tuple[tuple[str, Callable[[Answer], str]], ...] = (
    ("short", _short),
    ("poor", _poor),
    ("head_down", _head_down),
    ("doubtful", _doubtful),
    ("cut_off", _cut_off),
    ("gaps", _gaps),
    ("lying", _lying),
)
