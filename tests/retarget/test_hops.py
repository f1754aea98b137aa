"""Hops that are no flights: kept where the robot can do them, else steps, whichever it can do."""

from types import SimpleNamespace

import numpy as np
import pytest

from robojackson.motion.smpl_sequence import AIR, PLANTED
from robojackson.retarget import retargeting
from robojackson.retarget.retarget_config import RetargetConfig


class Solver:
    """Targets and solutions whose feasible shares are given."""

    def __init__(self, hopped: float, stepped: float, differ: bool) -> None:
        self.shares, self.differ, self.solved = {True: hopped, False: stepped}, differ, list[bool]()

    def targets(self, clip: object, robot: object, *, hops: bool) -> SimpleNamespace:
        """Return contacts that differ between hops and steps where the clip has a hop."""
        state = AIR if hops and self.differ else PLANTED
        return SimpleNamespace(contact=np.full((4, 2), state))

    def solve(
        self, clip: object, robot: object, config: object, plain: object, hops: bool
    ) -> SimpleNamespace:
        """Return a motion that knows whether it hops."""
        self.solved.append(hops)
        return SimpleNamespace(able=hops)

    def share(self, robot: object, able: bool, config: object) -> float:
        """Return the share of a motion."""
        return self.shares[able]


@pytest.mark.parametrize(
    ("hopped", "stepped", "differ", "solved", "taken"),
    [
        (0.95, 1.0, True, [True], True),
        (0.7, 0.97, True, [True, False], False),
        (0.7, 0.6, True, [True, False], True),
        (0.7, 0.97, False, [True], True),
    ],
)
def test_steps_replace_hops_only_where_the_robot_can_do_only_these(
    monkeypatch: pytest.MonkeyPatch,
    hopped: float,
    stepped: float,
    differ: bool,
    solved: list[bool],
    taken: bool,
) -> None:
    solver = Solver(hopped, stepped, differ)
    monkeypatch.setattr(retargeting, "targets", solver.targets)
    monkeypatch.setattr(retargeting, "_solved", solver.solve)
    monkeypatch.setattr(retargeting, "feasible_share", solver.share)
    found = retargeting._danced(None, None, RetargetConfig())  # type: ignore[arg-type]
    assert solver.solved == solved
    assert bool(found.able) == taken
