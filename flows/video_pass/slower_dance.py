"""An instant dance that falls at the clip's own tempo is tried slower.

Whether a tracker falls is known after its first look. The certificate of a motion says what a robot
can do, not what a tracker holds: 27 s of a captured dance that the regulator never finishes at its
own tempo it finishes from 88 % of the starts at .93 of it.
"""

import json
from collections.abc import Callable, Sequence

from robojackson.motion.reference_motion import tempo_beside_clip
from robojackson.retarget.scorecard_gate import failures
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.run_logger import run_logger

Artifacts = dict[str, Artifact]
Look = Callable[[Artifacts], float]
"""From a retargeted clip to the share of a tracker's starts that end with strict success."""

HELD, BETTER = 0.5, 0.1
"""Share of the starts from which a tempo is kept without trying another; how much more a slower one
has to hold."""


def slower_where_it_falls(
    moved: Artifacts,
    tempos: Sequence[float],
    retargeted: Callable[[float], Artifacts],
    look: Look,
    gate: bool,
) -> Artifacts:
    """Return the retargeted clip at the fastest tempo that the tracker holds, or at the one that it
    holds best.

    Args:
        moved: `reference`, `scorecard` and more of the clip at the tempo that `auto` found.
        tempos: Slower ones to try, ratio to the clip's, falling.
        retargeted: Function that returns the same at another tempo.
        gate: Whether a tempo at which the certificate fails is passed over.
    """
    held = look(moved)
    if held >= HELD:
        return moved
    best, own = moved, tempo_beside_clip(_card(moved))
    for tempo in tempos:
        if tempo >= own:
            continue
        slower = retargeted(tempo)
        if gate and failures(_card(slower)):
            continue
        now = look(slower)
        run_logger().info(
            "at tempo %.2f the tracker dances %.0f %% of its starts to the end, at %.2f %.0f %%",
            tempo_beside_clip(_card(best)), 100 * held,
            tempo_beside_clip(_card(slower)), 100 * now,
        )  # fmt: skip
        if now >= held + BETTER:
            best, held = slower, now
        if held >= HELD:
            break
    return best


def _card(moved: Artifacts) -> dict[str, float]:
    found: dict[str, float] = json.loads(Store.from_environment().read(moved["scorecard"].key))
    return found
