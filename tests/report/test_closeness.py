"""Sentences of what strict success lost and of how closely a robot follows."""

import json

import numpy as np

from robojackson.files.json_types import to_json
from robojackson.report.pages.closeness import sentences

FIGURES = {
    "success": 0.96, "rollouts": 73.0, "whole_rollouts": 73.0,
    "lost_fell": 3.0, "lost_sites": 0.0, "lost_ends": 2.0,
    "lost_kneels": 0.0, "lost_floor": 1.0, "mpjpe_l_alive_m": 0.0112, "mpjpe_g_alive_m": 0.043,
    "mpjpe_l_m": 0.0331, "acceleration_ratio": 1.544, "limb_gain_left_foot": 0.98,
    "limb_r2_left_foot": 0.912, "excess_speed_left_foot": 0.02, "limb_gain_left_hand": np.nan,
    "limb_r2_left_hand": np.nan, "excess_speed_left_hand": 0.42,
}  # fmt: skip
CLOSE = json.loads(to_json(FIGURES))
"""The figures as a page reads them: null where there is no number."""


def test_each_broken_rule_is_named_with_its_rollouts() -> None:
    first, *_ = sentences(CLOSE)
    assert first == (
        "Not strict, of 73 rollouts: 3 fell, 2 had a foot or hand too high or too low, 1 touched "
        "the floor where the reference does not."
    )


def test_errors_are_given_until_a_fall_and_to_the_horizon() -> None:
    _, errors, _ = sentences(CLOSE)
    assert "11 mm relative to the root and 43 mm in the world until a fall, 33 mm" in errors
    assert "accelerations 1.54 times" in errors


def test_where_fallen_robots_were_not_simulated_on_no_error_is_given_after_a_fall() -> None:
    """As of Humanoid-v5: the mean would be of the robots that never fell."""
    _, errors, _ = sentences({**CLOSE, "whole_rollouts": 70.0})
    assert "in the world until a fall; accelerations" in errors


def test_a_limb_that_hardly_moves_has_a_dash_for_its_gain() -> None:
    *_, ends = sentences(CLOSE)
    assert ends == "Left foot, left hand: gain 0.98 –; R2 0.91 –; excess speed, m/s, 0.02 0.42."


def test_an_evaluation_that_is_too_short_or_older_has_none() -> None:
    assert sentences({**CLOSE, "success": None}) == []
    assert sentences({"success": 1.0, "rollouts": 73.0}) == []


def test_all_strict_is_said() -> None:
    held = {**CLOSE, "lost_fell": 0.0, "lost_ends": 0.0, "lost_floor": 0.0}
    assert sentences(held)[0] == "Strict: all 73 rollouts."
