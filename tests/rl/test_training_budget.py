"""Laws of the budget of a training."""

import time

import pytest

from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.training_budget import TrainingBudget


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return wall and processor time, seconds, which replace the machine's."""
    now = [1000.0, 50.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    monkeypatch.setattr(time, "process_time", lambda: now[1])
    return now


@pytest.mark.parametrize(
    ("config", "before", "after", "name"),
    [
        (TrainConfig(steps=100), (99, 1e9, 1e9), (100, 0.0, 0.0), "steps"),
        (TrainConfig(minutes=2.0), (10**9, 119.0, 1e9), (0, 120.0, 0.0), "minutes"),
        (TrainConfig(cpu_minutes=1.0), (10**9, 1e9, 59.0), (0, 0.0, 60.0), "cpu_minutes"),
    ],
)
def test_a_budget_is_used_up_by_its_own_measure_alone(
    clock: list[float],
    config: TrainConfig,
    before: tuple[int, float, float],
    after: tuple[int, float, float],
    name: str,
) -> None:
    began = tuple(clock)
    for (steps, wall, cpu), expected in ((before, ""), (after, name)):
        budget = TrainingBudget(config)
        clock[:] = [began[0] + wall, began[1] + cpu]
        assert budget.used_up(steps) == expected
        clock[:] = began


@pytest.mark.slow
def test_what_earlier_sittings_used_counts(clock: list[float]) -> None:
    budget = TrainingBudget(TrainConfig(minutes=2.0))
    budget.resume(500, seconds=90.0, cpu_seconds=30.0)
    clock[:] = [clock[0] + 30.0, clock[1] + 5.0]
    assert (budget.seconds(), budget.cpu_seconds()) == (120.0, 35.0)
    assert budget.used_up(501) == "minutes"


@pytest.mark.slow
def test_the_rate_is_that_of_this_sitting_and_the_shortest_budget_is_left(
    clock: list[float],
) -> None:
    budget = TrainingBudget(TrainConfig(steps=1_000, minutes=10.0))
    budget.resume(500, seconds=90.0, cpu_seconds=0.0)
    assert not budget.has_advanced(500)
    clock[0] += 10.0
    assert budget.has_advanced(600)
    assert budget.progress(600) == {"seconds": 100.0, "steps_per_s": 10.0, "seconds_left": 40.0}
