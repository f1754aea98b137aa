"""What strict success lost and how closely the robot followed, as sentences for page and terminal.

Every figure is a key of evaluation.json (`rl.evaluation.starts.summarise`).
"""

from robojackson.report.pages.evaluation_text import RESPONSES, Evaluation
from robojackson.report.quantities import format_value
from robojackson.robot.names import FEET, HANDS

LOSSES = {
    "lost_fell": "fell",
    "lost_sites": "had the keypoints too far from the reference's in the mean",
    "lost_ends": "had a foot or hand too high or too low",
    "lost_kneels": "knelt",
    "lost_floor": "touched the floor where the reference does not",
}
"""Count of rollouts in evaluation.json, and what they did."""


def sentences(evaluation: Evaluation) -> list[str]:
    """Return what cost strict success, then position errors, then feet and hands; nothing where
    the evaluation is too short or of before these figures."""
    if evaluation.get("success") is None:
        return []
    return [line for line in (_losses(evaluation), _errors(evaluation), _ends(evaluation)) if line]


def _losses(evaluation: Evaluation) -> str:
    """Return how many rollouts broke which rule; those that fell stand under that alone."""
    if "lost_fell" not in evaluation:
        return ""
    counts = {said: round(evaluation[key]) for key, said in LOSSES.items() if evaluation[key]}
    every = round(evaluation["rollouts"])
    if not counts:
        return f"Strict: all {every} rollouts."
    found = ", ".join(f"{count} {said}" for said, count in counts.items())
    return f"Not strict, of {every} rollouts: {found}."


def _errors(evaluation: Evaluation) -> str:
    figures = {key: evaluation.get(key) for key in ("mpjpe_l_alive_m", "mpjpe_g_alive_m")}
    if any(value is None for value in figures.values()):
        return ""
    local, world = (format_value(key, value) for key, value in figures.items())
    whole = ""
    if evaluation.get("whole_rollouts") == evaluation.get("rollouts"):  # simulated on after a fall
        figure = format_value("mpjpe_l_m", evaluation.get("mpjpe_l_m"))
        whole = f", {figure} relative to the root with what follows it"
    faster = format_value("acceleration_ratio", evaluation.get("acceleration_ratio"))
    return (
        f"Mean position error (mpjpe): {local} relative to the root and {world} in the world until "
        f"a fall{whole}; accelerations {faster} times the reference's."
    )


def _ends(evaluation: Evaluation) -> str:
    """Return gain, R2 and excess speed of feet and hands; dashes where a limb hardly moves."""
    limbs = [limb for limb in (*FEET, *HANDS) if f"excess_speed_{limb}" in evaluation]
    if not limbs:
        return ""

    def of_all(prefix: str) -> str:
        return " ".join(format_value(prefix, evaluation.get(f"{prefix}_{limb}")) for limb in limbs)

    names = ", ".join(limb.replace("_", " ") for limb in limbs).capitalize()
    gain, r2, excess = map(of_all, RESPONSES)
    return f"{names}: gain {gain}; R2 {r2}; excess speed, m/s, {excess}."
