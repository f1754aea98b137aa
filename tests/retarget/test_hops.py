"""Hops that are no flights: kept where the robot can do them, else steps, whichever it can do."""

from types import SimpleNamespace

import numpy as np
import pytest

from robojackson.motion.smpl_sequence import AIR, PLANTED
from robojackson.retarget import danced_motion
from robojackson.retarget.retarget_config import RetargetConfig


class Solver:
    """Targets and solutions whose feasible shares are given.

    Args:
        first, hopped: Shares of the motion with hops after its first repair, and after all.
        stepped: Share of the motion with steps.
        differ: Whether the clip has a hop.
    """

    def __init__(self, first: float, hopped: float, stepped: float, differ: bool) -> None:
        self.shares = {"first": first, "hopped": hopped, "stepped": stepped}
        self.differ, self.repaired = differ, list[str]()

    def targets(self, clip: object, robot: object, *, hops: bool) -> SimpleNamespace:
        """Return contacts that differ between hops and steps where the clip has a hop."""
        state = AIR if hops and self.differ else PLANTED
        return SimpleNamespace(contact=np.full((4, 2), state))

    def solve(
        self, clip: object, robot: object, config: object, plain: object, hops: bool
    ) -> SimpleNamespace:
        """Return a motion that is repaired as its configuration says."""

        def repaired(robot: object, config: RetargetConfig) -> SimpleNamespace:
            short = len(config.repair.weights) == 1 and config.repair.slow_rounds == 0
            self.repaired.append("first" if short else "hopped" if hops else "stepped")
            return SimpleNamespace(able=self.repaired[-1])

        return SimpleNamespace(repaired=repaired)

    def share(self, robot: object, able: str, config: object) -> float:
        """Return the share of a motion."""
        return self.shares[able]


@pytest.mark.parametrize(
    ("shares", "differ", "repaired", "taken"),
    [
        ((0.96, 0.97, 1.0), True, ["first"], "first"),
        ((0.92, 0.95, 1.0), True, ["first", "hopped"], "hopped"),
        ((0.85, 0.88, 0.97), True, ["first", "hopped", "stepped"], "stepped"),
        ((0.85, 0.88, 0.6), True, ["first", "hopped", "stepped"], "hopped"),
        ((0.6, 0.7, 0.97), True, ["first", "stepped"], "stepped"),
        ((0.6, 0.7, 0.65), True, ["first", "stepped", "hopped"], "hopped"),
        ((0.6, 0.7, 0.75), True, ["first", "stepped", "hopped"], "stepped"),
        ((0.6, 0.7, 0.97), False, ["hopped"], "hopped"),
    ],
)
def test_steps_replace_hops_only_where_the_robot_can_do_only_these(
    monkeypatch: pytest.MonkeyPatch,
    shares: tuple[float, float, float],
    differ: bool,
    repaired: list[str],
    taken: str,
) -> None:
    """Hops that stay out of reach after the first repair are not repaired before steps are
    tried."""
    solver = Solver(*shares, differ)
    monkeypatch.setattr(danced_motion, "targets", solver.targets)
    monkeypatch.setattr(danced_motion, "_solved", solver.solve)
    monkeypatch.setattr(danced_motion, "feasible_share", solver.share)
    found = danced_motion.danced_motion(None, None, RetargetConfig())  # type: ignore[arg-type]
    assert solver.repaired == repaired
    assert found.able == taken
