"""A motion that the gate refuses although it is nearly feasible is solved again as a slower one."""

from dataclasses import replace

import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.retarget import retargeting
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.scorecard_gate import BARS
from robojackson.robot.model import Robot
from tests.fixtures.robots import human, robot_motion, stock

Cards = dict[float, dict[str, float]]
"""Figures that differ from a perfect card, at each tempo."""


def solved(
    monkeypatch: pytest.MonkeyPatch, cards: Cards, config: RetargetConfig
) -> tuple[float, list[float]]:
    """Return the tempo of the motion that comes out, and all that were solved."""
    tried: list[float] = []
    motion = robot_motion("walk")

    def at(sequence: SmplSequence, robot: Robot, how: RetargetConfig) -> ReferenceMotion:
        tried.append(how.fixed_tempo)
        card = {**dict.fromkeys(BARS, 0.0), "tempo": how.fixed_tempo, **cards[how.fixed_tempo]}
        return replace(motion, scorecard=card)

    monkeypatch.setattr(retargeting, "_retargeted", at)
    found = retargeting.retarget_motion(human("walk"), stock(), config)
    return found.scorecard["tempo"], tried


def test_what_passes_the_gate_is_solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    assert solved(monkeypatch, {1.0: {}}, RetargetConfig()) == (1.0, [1.0])


def test_the_fastest_that_passes_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    cards: Cards = {
        1.0: {"unsupported_share": 0.08, "infeasible_share": 0.2},
        0.93: {"unsupported_share": 0.06},
        0.87: {},
    }
    assert solved(monkeypatch, cards, RetargetConfig()) == (0.87, [1.0, 0.93, 0.87])


def test_where_none_passes_it_stays_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    cards: Cards = {tempo: {"infeasible_share": 0.2} for tempo in (1.0, 0.93, 0.87, 0.8)}
    assert solved(monkeypatch, cards, RetargetConfig())[0] == 1.0


@pytest.mark.parametrize(
    "card", [{"infeasible_share": 0.6}, {"infeasible_share": 0.2, "fallen_share": 0.1}]
)
def test_what_no_tempo_mends_is_solved_once(
    monkeypatch: pytest.MonkeyPatch, card: dict[str, float]
) -> None:
    assert solved(monkeypatch, {1.0: card}, RetargetConfig()) == (1.0, [1.0])


def test_a_tempo_that_is_given_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    cards: Cards = {0.9: {"infeasible_share": 0.2}}
    assert solved(monkeypatch, cards, RetargetConfig(tempo=0.9)) == (0.9, [0.9])
