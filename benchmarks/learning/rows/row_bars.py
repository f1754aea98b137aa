"""The bars of a row of the table of policies: of a whole robot, and of its feet, hands and head.

Humanoid-v5's rows have bars of every limb; of the authors' clips only APT1's feet have some. The
G1's rows have those of feet and hands, and one of accelerations; none is set for its head.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from benchmarks.learning.policies import Move

FEET, HANDS, HEAD = ("left_foot", "right_foot"), ("left_hand", "right_hand"), ("head",)
LIMBS = (*FEET, *HANDS, *HEAD)
ACCELERATION = 1.5
"""Largest acceleration of the sites, times the reference's, where mpjpe_l has a bar."""


@dataclass(frozen=True)
class LimbBar:
    """What a limb must show.

    Attributes:
        gain: Least and largest gain.
        r2: Least R2.
        excess: Largest excess speed, m/s; none where it has no bar.
    """

    gain: tuple[float, float] = (0.8, 1.2)
    r2: float = 0.5
    excess: float | None = 0.15


USUAL = LimbBar()
LIMB_BARS: Mapping[str, Mapping[str, LimbBar]] = {
    "dance_b": {
        **dict.fromkeys(FEET, LimbBar((0.75, 1.2), 0.4)),
        **dict.fromkeys((*HANDS, *HEAD), USUAL),
    },
    "authors_apt1": dict.fromkeys(FEET, LimbBar((0.75, 1.2), 0.4, None)),
    "authors_walk": {},
}
"""Rows whose limbs have other bars than those of their robot's rows."""


def limb_bars(name: str, move: Move) -> Mapping[str, LimbBar]:
    """Return the bars by limb; a limb that is missing has none."""
    usual = LIMBS if move.robot == "humanoid" else (*FEET, *HANDS)
    return LIMB_BARS.get(name, dict.fromkeys(usual, USUAL))


def bars(found: Mapping[str, Any], name: str, move: Move) -> dict[str, bool]:
    """Return each bar by name; a limb that the dance does not move has none."""
    held = {f"strict success >= {move.success:g}": found["strict_success"] >= move.success}
    if move.worst:
        held[f"worst seed >= {move.worst:g}"] = found["worst_seed"] >= move.worst
    held[f"skill >= {move.skill:g}"] = found["skill"] >= move.skill
    if move.mpjpe_mm is not None:
        if (error := found["mpjpe_l_m"]) is not None:
            held[f"mpjpe_l <= {move.mpjpe_mm:g} mm"] = 1e3 * error <= move.mpjpe_mm
        if (ratio := found["acceleration_ratio"]) is not None:
            held[f"acceleration <= {ACCELERATION:g}"] = ratio <= ACCELERATION
    for limb, bar in limb_bars(name, move).items():
        held |= _of_limb(found, limb, bar)
    return held


def _of_limb(found: Mapping[str, Any], limb: str, bar: LimbBar) -> dict[str, bool]:
    """Return the bars of one limb, of the figures that it has."""
    held: dict[str, bool] = {}
    gain, r2 = found["limb_gain"][limb], found["limb_r2"][limb]
    excess, (low, high) = found["excess_speed"][limb], bar.gain
    if gain is not None:
        held[f"gain {limb} {low:g}-{high:g}"] = low <= gain <= high
    if r2 is not None:
        held[f"R2 {limb} >= {bar.r2:g}"] = r2 >= bar.r2
    if excess is not None and bar.excess is not None:
        held[f"excess {limb} <= {bar.excess:g}"] = excess <= bar.excess
    return held
