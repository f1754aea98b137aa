"""The passport: one line a case, each of which changes what it says."""

import copy
from dataclasses import replace
from typing import Literal

import mujoco
import numpy as np
import pytest

from robojackson.cli.passport_text import passport_lines
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.yaml_loader import load
from robojackson.report.pages.evaluation_text import passport_rows
from robojackson.rl.config.train_config import EvaluateConfig, RandomConfig, TrainConfig
from robojackson.rl.evaluation import passport as passport_module
from robojackson.rl.evaluation.controllers import control_of, trained_driver
from robojackson.rl.evaluation.passport import (
    FIGURES,
    LEAST_SHARE,
    NOMINAL,
    ROBUST,
    cases,
    passport,
    robust_ranges,
)
from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
from robojackson.rl.modes.observation import Observer
from robojackson.rl.policy import Policy
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.variation import Variation, varied
from robojackson.robot.model import Robot, load_robot
from tests.fixtures.robots import G1, description

BRIEF = EvaluateConfig(seconds=0.3, phases=2, resets=1, passport=True)


def idle(robot: Robot) -> Policy:
    nothing = (np.zeros((Observer(robot, "full").size, robot.model.nu)), np.zeros(robot.model.nu))
    return Policy((nothing,), {"robot": "humanoid", "control": {"law": "pd"}})


def seeing(robot: Robot) -> Policy:
    """Return a policy whose action depends a little on its whole observation."""
    shape = (Observer(robot, "full").size, robot.model.nu)
    weights = 0.01 * np.random.default_rng(0).normal(size=shape)
    return Policy(((weights, np.zeros(robot.model.nu)),), idle(robot).facts)


def test_every_case_differs_from_the_nominal_one(robot: Robot) -> None:
    found = cases(robot, 0)
    assert found[0].name == NOMINAL
    assert len({case.name for case in found}) == len(found)
    late = [case.name for case in found if case.conditions.delay_s]
    assert late == ["action 9 ms late", "action 15 ms late"], "of steps of 3 ms, within one of 15"
    plain = found[0]
    for case in found[1:]:
        assert (case.variation, case.conditions) != (plain.variation, plain.conditions), case.name


def test_a_policy_that_commands_torques_has_only_cases_that_reach_it(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """Gains and sensor noise were rows, too, with the figures of the nominal one."""
    size = robot.model.nu
    weights = 0.05 * np.random.default_rng(0).normal(size=(348, size))
    facts = {"robot": "humanoid", "mode": "paper", "control": {"law": "torque"}}
    policy = Policy(((weights, np.zeros(size)),), facts)
    config = EvaluateConfig(seconds=0.6, phases=2, resets=1)
    found = {row["case"]: row["site_error_m"] for row in passport(policy, sway, robot, config)}
    missing = [case.name for case in cases(robot, 0) if case.name not in found]
    assert missing == ["gains x 0.8", "gains x 1.2", "sensor noise"]
    nominal = found.pop(NOMINAL)
    same = [case for case, error in found.items() if error == nominal]
    assert same == ["pushes every 1 to 3 s"], "which come after a second"


@pytest.mark.parametrize("timestep", [0.0025, 0.01])
def test_a_delay_is_a_case_once(timestep: float, robot: Robot) -> None:
    """20 ms late was a control step late, as 10 ms."""
    simulation = replace(robot.description.simulation, timestep=timestep)
    quick = load_robot(replace(robot.description, control_dt=0.01, simulation=simulation))
    names = [case.name for case in cases(quick, 0)]
    assert len(set(names)) == len(names)
    assert [name for name in names if "late" in name] == ["action 10 ms late"]


def test_a_delay_that_is_no_step_of_the_physics_is_no_case(robot: Robot) -> None:
    simulation = replace(robot.description.simulation, timestep=0.03)
    slow = load_robot(replace(robot.description, control_dt=0.03, simulation=simulation))
    assert [case.name for case in cases(slow, 0) if "late" in case.name] == ["action 30 ms late"]


def integrators(robot: Robot) -> list[str]:
    found = [case.name for case in cases(robot, 0)]
    return [name.removeprefix("integrator ") for name in found if name.startswith("integrator")]


@pytest.mark.parametrize(
    ("own", "others"),
    [("RK4", ["Euler"]), ("Euler", ["RK4"]), ("implicitfast", ["RK4"])],
)
def test_an_integrator_that_moves_the_robot_as_another_is_no_case(
    own: Literal["RK4", "Euler", "implicitfast"], others: list[str], robot: Robot
) -> None:
    """Euler and implicitfast are both implicit in the damping of hinges, Humanoid-v5's own."""
    assert integrators(varied(robot, Variation(integrator=own))) == others


def test_integrators_that_differ_are_cases(robot: Robot) -> None:
    explicit = copy.copy(robot.model)
    explicit.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    assert integrators(replace(robot, model=explicit)) == ["Euler", "implicitfast"]
    dragging = copy.copy(robot.model)
    dragging.opt.viscosity = 0.1
    assert integrators(replace(robot, model=dragging)) == ["Euler", "implicitfast"]


@G1
def test_the_integrators_of_a_robot_without_damping_differ_by_rounding() -> None:
    assert integrators(load_robot(description("g1"))) == ["RK4"]


def test_an_evaluation_with_a_passport_has_a_row_a_case(
    robot: Robot, sway: ReferenceMotion
) -> None:
    verdict = evaluate_policy(idle(robot), sway, robot, BRIEF)
    rows = verdict.summary["passport"]
    assert [row["case"] for row in rows] == [case.name for case in cases(robot, 0)]  # type: ignore[attr-defined]
    shown = passport_rows(verdict.summary)
    assert len(shown) == len(rows)  # type: ignore[arg-type]
    assert shown[0].trained
    assert [one.failed for one in shown] == [not row["robust"] for row in rows]  # type: ignore[attr-defined]
    assert verdict.summary["robust"] == all(row["robust"] for row in rows)  # type: ignore[attr-defined]
    assert verdict.summary["passport_least_kept"] == LEAST_SHARE


@pytest.mark.parametrize(
    ("pushed", "robust"), [(0.9, True), (0.72 / 0.8, True), (0.88, False), (None, False)]
)
def test_a_case_is_robust_that_keeps_nine_tenths(
    pushed: float | None,
    robust: bool,
    robot: Robot,
    sway: ReferenceMotion,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nominal = 0.0 if pushed is None else 1.0
    strict = iter([nominal, *(pushed or 0.0 for _ in cases(robot, 0)[1:])])
    figures = dict.fromkeys(FIGURES, 0.0)
    monkeypatch.setattr(
        passport_module,
        "_evaluate_case",
        lambda *given: {**figures, "strict_success": next(strict)},
    )
    rows = passport(idle(robot), sway, robot, BRIEF)
    assert {row["robust"] for row in rows[1:]} == {robust}


def test_the_terminal_and_the_page_name_the_cases_that_fail() -> None:
    figures = {"strict_success": 1.0, "success": 1.0, "skill": 0.5, "survived_s": 10.0, "kept": 1.0}
    pushed = {"case": "pushes", **figures, "kept": 0.76, "robust": False}
    rows = [{"case": NOMINAL, **figures, "robust": True}, pushed]
    evaluation = {"passport": rows, "passport_least_kept": LEAST_SHARE}
    assert passport_lines(evaluation)[-1] == (
        "Not robust: 1 of 2 cases keep 90 % of the nominal strict success, not: pushes."
    )
    assert passport_lines(evaluation | {"passport": rows[:1]})[-1].startswith("Robust: each of 1")
    assert [(one.failed, one.values[-1]) for one in passport_rows(evaluation)] == [
        (False, "yes"),
        (True, "no"),
    ]
    assert passport_lines({"passport": []}) == []


def test_slippery_floor_and_late_actions_change_the_outcome(
    robot: Robot, sway: ReferenceMotion
) -> None:
    config = EvaluateConfig(seconds=1.0, phases=4, resets=1)
    rows = {
        row["case"]: row["site_error_m"] for row in passport(seeing(robot), sway, robot, config)
    }
    nominal = rows.pop(NOMINAL)
    same = [case for case, error in rows.items() if error == nominal]
    assert same == ["pushes every 1 to 3 s"], "which come after a second"
    assert "integrator RK4" not in rows, "the robot's own"


def test_other_gains_reach_a_policy_with_gains_of_its_own(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """Gains of `track.control.stiffness` were the same in every case."""
    control = {"law": "pd", "stiffness": 4.0, "feedback": 0.0, "action_factor": 1.0}
    policy = Policy(idle(robot).layers, {"robot": "humanoid", "control": control})
    driver, config = trained_driver(policy, robot, sway), EvaluateConfig(seconds=0.3, phases=1)
    clip = Clip(sway, lead_of(robot, sway, driver.control))
    chosen = [case for case in cases(robot, 0) if case.name in (NOMINAL, "gains x 0.8")]
    errors = [
        passport_module._evaluate_case(driver, clip, sway, robot, config, case)["site_error_m"]
        for case in chosen
    ]
    softer = replace(driver, control=replace(driver.control, stiffness=3.2))
    nominal = passport_module._evaluate_case(softer, clip, sway, robot, config, chosen[0])
    assert errors[0] != errors[1] == nominal["site_error_m"]


def test_pushes_do_not_change_what_an_older_policys_actions_are(robot: Robot) -> None:
    """Its file has no factor: it would act four times as strongly where the passport pushes."""
    stronger = load_robot(replace(robot.description, robust_action_factor=4.0))
    control = control_of(idle(stronger), stronger)
    pushed, calm = (
        Simulation(stronger, control, 1, random=RandomConfig(pushes=pushes)) for pushes in (1, 0)
    )
    np.testing.assert_array_equal(pushed.residual, calm.residual)


def test_train_robust_disturbs_what_the_passport_tests() -> None:
    assert load(TrainConfig, None, robust_ranges()).track.random == ROBUST
