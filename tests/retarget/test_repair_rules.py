"""When a repair ends: heavier weights that make it worse are undone, hopeless ones not tried."""

from types import SimpleNamespace

import pytest

from robojackson.retarget import feasible_motion
from robojackson.retarget.retarget_config import RetargetConfig

ROBOT = SimpleNamespace()


def motion(name: str) -> SimpleNamespace:
    """Return a motion with a name."""
    return SimpleNamespace(name=name)


@pytest.fixture
def solver(monkeypatch: pytest.MonkeyPatch) -> dict[str, float]:
    """A solver that makes motion "0.03" and so on; the test sets the shares of feasible steps."""
    shares: dict[str, float] = {}
    monkeypatch.setattr(feasible_motion, "_error_mm", lambda *_: 10.0)
    monkeypatch.setattr(feasible_motion, "_holds", lambda *_: True)
    monkeypatch.setattr(feasible_motion, "_excess", lambda robot, found, config: 1.0)
    monkeypatch.setattr(
        feasible_motion, "feasible_share", lambda robot, found, config: shares[found.name]
    )
    monkeypatch.setattr(
        feasible_motion, "_solved", lambda robot, found, weight, config: motion(str(weight))
    )
    return shares


@pytest.mark.parametrize(
    ("found", "heavier", "taken"),
    [
        (0.80, (0.85, 0.9, 0.93), "0.3"),
        (0.80, (0.85, 0.84, 0.97), "0.03"),
        (0.80, (0.79, 0.9, 0.97), "first"),
        (0.80, (0.96, 0.97, 0.97), "0.03"),
        (0.45, (0.9, 0.9, 0.9), "first"),
    ],
)
def test_weights_rise_until_fewer_steps_are_feasible(
    solver: dict[str, float], found: float, heavier: tuple[float, ...], taken: str
) -> None:
    weights = RetargetConfig().repair.weights[1:]
    solver |= {"first": found, **dict(zip(map(str, weights), heavier, strict=True))}
    best = feasible_motion._repaired(ROBOT, motion("before"), motion("first"), RetargetConfig())
    assert best.name == taken


@pytest.mark.parametrize(("slower", "repairs"), [(0.85, 2), (0.81, 1)])
def test_a_slower_motion_that_is_far_behind_is_not_repaired(
    solver: dict[str, float], monkeypatch: pytest.MonkeyPatch, slower: float, repairs: int
) -> None:
    solver |= {"first": 0.8, "slower": slower, "repaired": 0.84}
    done = []

    def repaired(robot: object, before: object, found: object, config: object) -> object:
        done.append(found)
        return motion("repaired")

    monkeypatch.setattr(feasible_motion, "_slowed", lambda *_: motion("slower"))
    monkeypatch.setattr(feasible_motion, "_repaired", repaired)
    feasible_motion._best_repair(ROBOT, motion("before"), motion("first"), RetargetConfig())
    assert len(done) == repairs
