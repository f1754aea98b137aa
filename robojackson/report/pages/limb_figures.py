"""Figures of head, hands and feet from all stages of a run, a row a limb."""

import numpy as np

from robojackson.body.skeleton import keypoint
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.pages.evaluation_text import RESPONSES, Evaluation, Verdict
from robojackson.report.quantities import format_value
from robojackson.report.web.player_data import Player

LIMBS = {
    "head": ("pelvis", "head"),
    "left_hand": ("left_shoulder", "left_wrist"),
    "right_hand": ("right_shoulder", "right_wrist"),
    "left_foot": ("left_hip", "left_ankle"),
    "right_foot": ("right_hip", "right_ankle"),
}
"""The ends of each limb by its keypoint of robots: the dancer's, which the robot's follow."""


def limb_rows(
    sequence: SmplSequence,
    reference: ReferenceMotion,
    player: Player | None,
    evaluation: Evaluation,
) -> list[Verdict]:
    """Return a row a limb: confidence, direction, error of the rollout shown, and its responses.

    Args:
        player: Player of the page, or None.
    """
    errors = player.error_while_up if player else {}
    directions = limb_directions(sequence, reference)
    rows = []
    for limb, (_, end) in LIMBS.items():
        confidence = float(sequence.confidence[:, keypoint(end)].mean())
        error, direction = errors.get(limb), directions[limb]
        row = [
            f"{confidence:.2f}",
            f"{direction:.0f}°" if np.isfinite(direction) else "–",
            "–" if error is None else f"{1000 * float(error.mean()):.0f} mm",
            *(format_value(key, evaluation.get(f"{key}_{limb}")) for key in RESPONSES),
        ]
        rows.append(Verdict(limb.replace("_", " "), "", row, False))
    return rows


def limb_directions(sequence: SmplSequence, reference: ReferenceMotion) -> dict[str, float]:
    """Return the mean angle between the limbs of the reference robot and of the dancer over the
    steps at which the clip goes on, degrees; NaN for a limb that the robot lacks."""
    danced = reference.in_clip
    times = np.asarray(reference.source_time_s)[danced]
    frames = np.clip(np.round(times * sequence.fps).astype(int), 0, len(sequence) - 1)
    person = np.asarray(sequence.keypoints_w, float)[frames]
    robots = np.asarray(reference.keypoints_w, float)[danced]
    names, found = list(reference.keypoint_names), {}
    for limb, (start, end) in LIMBS.items():
        theirs = person[:, keypoint(end)] - person[:, keypoint(start)]
        origin = start if start in names else "pelvis"
        if not danced.any() or not {limb, origin} <= set(names):
            found[limb] = float("nan")
            continue
        ours = robots[:, names.index(limb)] - robots[:, names.index(origin)]
        lengths = np.linalg.norm(theirs, axis=1) * np.linalg.norm(ours, axis=1)
        cosine = np.sum(theirs * ours, 1) / np.maximum(lengths, 1e-9)
        found[limb] = float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean())
    return found
