"""The evaluation: rows made by hand, so that each verdict has one known answer."""

import dataclasses

import numpy as np
import pytest

from robojackson.errors import BadPolicy, RejectedReference, TrackTooShort
from robojackson.geometry.rotations import heading, wrapped
from robojackson.motion.floor_move import FloorMove
from robojackson.motion.reference_motion import ReferenceMotion, poses_sha256
from robojackson.rl.config.train_config import (
    ControlConfig,
    EvaluateConfig,
    PaperConfig,
    TrackConfig,
)
from robojackson.rl.evaluation.controllers import control_of
from robojackson.rl.evaluation.policy_evaluation import environment_of, evaluate_policy
from robojackson.rl.evaluation.rollout_records import RolloutScorer
from robojackson.rl.evaluation.rollouts import Driver, Rollouts, Starts, roll_out
from robojackson.rl.modes import track_mode
from robojackson.rl.modes.observation import Observer
from robojackson.rl.policy import Policy
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.motors import actuation_facts
from robojackson.rl.sim.reference_clip import Clip
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot, load_robot
from tests.fixtures.deploy_policies import random_policy

STEPS = 160
STATE = ("qpos", "keypoints_w")
"""Arrays of a motion's poses."""


def perfect(sway: ReferenceMotion) -> Rollouts:
    """Return a rollout that is the reference itself for two cycles."""
    at = Clip(sway).at(np.arange(STEPS))
    return Rollouts(
        length=np.array([STEPS]),
        fell=np.array([False]),
        horizon=np.array([STEPS]),
        qpos=at.qpos[:, None],
        points=at.points[:, None],
        target=at.points[:, None],
        target_qpos=at.qpos[:, None],
        totals={},
    )


def row(robot: Robot, sway: ReferenceMotion, rollouts: Rollouts) -> dict[str, object]:
    return RolloutScorer(robot, sway, EvaluateConfig()).row("trained", (0, 0), rollouts, 0)


def idle(robot: Robot, sway: ReferenceMotion, control: ControlConfig | None = None) -> Policy:
    """Return a policy that adds nothing to the reference."""
    size = Observer(robot, "full").size
    nothing = (np.zeros((size, robot.model.nu)), np.zeros(robot.model.nu))
    control = control or ControlConfig()
    return Policy((nothing,), {"robot": "humanoid", "control": dataclasses.asdict(control)})


def test_the_reference_itself_is_a_strict_success_of_skill_one(
    robot: Robot, sway: ReferenceMotion
) -> None:
    scored = row(robot, sway, perfect(sway))
    assert (scored["success"], scored["strict_success"], scored["clip_fraction"]) == (1, 1, 1)
    assert scored["skill"] == pytest.approx(1)
    assert scored["limb_gain_left_hand"] == pytest.approx(1)


def test_a_motion_that_hardly_moves_has_no_skill_of_robots_that_fall_either(
    robot: Robot, sway: ReferenceMotion
) -> None:
    fields = {name: np.repeat(getattr(sway, name)[:1], len(sway), 0) for name in STATE}
    still = dataclasses.replace(sway, **fields)
    upright = perfect(still)
    fallen = dataclasses.replace(upright, fell=np.array([True]), length=np.array([40]))
    for rollouts in (upright, fallen):
        scored = row(robot, still, rollouts)
        assert np.isnan([scored["skill"], scored["velocity_score"]]).all()
    moving = dataclasses.replace(perfect(sway), fell=np.array([True]), length=np.array([40]))
    assert row(robot, sway, moving)["skill"] == 0


def test_a_robot_that_never_falls_is_up_for_all_of_its_rollouts(
    robot: Robot, sway: ReferenceMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rollouts of a motion that ends begin in its first quarter: they are shorter than it."""
    monkeypatch.setattr(Fall, "has_fallen", lambda self, qpos, there: np.zeros(len(qpos), bool))
    ending = dataclasses.replace(sway, cyclic=False)
    config = EvaluateConfig(phases=4, resets=1)
    found = evaluate_policy(idle(robot, sway), ending, robot, config).summary
    assert found["verdict"]["seconds"] == pytest.approx(found["survived_s"])
    assert found["clip_fraction"] == 1


@pytest.mark.parametrize(
    ("scorecard", "tempo"),
    [({}, 1.0), ({"tempo": 1.0, "tempo_mean": 0.8}, 0.8), ({"tempo": 0.5, "tempo_mean": 1.0}, 0.5)],
)
def test_the_tempo_is_the_clips_own_times_what_retargeting_left_of_it(
    robot: Robot, sway: ReferenceMotion, scorecard: dict[str, float], tempo: float
) -> None:
    slow = dataclasses.replace(sway, scorecard=scorecard)
    assert row(robot, slow, perfect(sway))["tempo"] == pytest.approx(tempo)


def test_a_reference_that_stands_still_has_no_skill(robot: Robot, sway: ReferenceMotion) -> None:
    whole = perfect(sway)
    still = np.repeat(whole.target[:1], STEPS, 0)
    scored = row(robot, sway, dataclasses.replace(whole, target=still, points=still + 0.01))
    assert np.isnan(scored["skill"])


def test_the_velocity_score_is_one_at_the_reference_and_none_for_a_statue(
    robot: Robot, sway: ReferenceMotion
) -> None:
    whole = perfect(sway)
    frozen = np.repeat(whole.points[:1], STEPS, 0)
    statue = dataclasses.replace(whole, points=frozen)
    assert row(robot, sway, whole)["velocity_score"] == pytest.approx(1)
    assert row(robot, sway, statue)["velocity_score"] == pytest.approx(0)


def test_the_velocity_score_sees_a_jump_that_the_pelvis_frame_does_not(
    robot: Robot, sway: ReferenceMotion
) -> None:
    points = perfect(sway).points.copy()
    points[90:, ..., 0] += 1.0
    scored = row(robot, sway, dataclasses.replace(perfect(sway), points=points))
    assert scored["skill"] == pytest.approx(1)
    assert scored["velocity_score"] < 0  # type: ignore[operator]


def test_a_fall_has_no_skill_and_no_success(robot: Robot, sway: ReferenceMotion) -> None:
    fall = dataclasses.replace(perfect(sway), length=np.array([40]), fell=np.array([True]))
    scored = row(robot, sway, fall)
    assert (scored["success"], scored["strict_success"], scored["skill"]) == (0, 0, 0)
    assert scored["velocity_score"] == 0
    assert scored["survived_s"] == pytest.approx(40 * sway.dt)
    assert scored["clip_fraction"] == pytest.approx(0.25)


@pytest.mark.parametrize("length", [0, 1])
def test_a_fall_before_there_is_a_velocity_counts_like_any_fall(
    robot: Robot, sway: ReferenceMotion, length: int
) -> None:
    fall = dataclasses.replace(perfect(sway), length=np.array([length]), fell=np.array([True]))
    assert row(robot, sway, fall)["velocity_score"] == 0


def test_kneeling_for_one_step_is_no_strict_success(robot: Robot, sway: ReferenceMotion) -> None:
    kneeling = perfect(sway)
    points = kneeling.points.copy()
    points[70, 0, robot.keypoint_names.index("left_knee"), 2] = 0.1
    scored = row(robot, sway, dataclasses.replace(kneeling, points=points))
    assert scored["kneels"]
    assert (scored["success"], scored["strict_success"]) == (1, 0)


def test_one_step_far_from_the_reference_is_no_strict_success(
    robot: Robot, sway: ReferenceMotion
) -> None:
    off = perfect(sway)
    points = off.points.copy()
    points[70, 0, 1:, 0] += 0.4
    assert row(robot, sway, dataclasses.replace(off, points=points))["strict_success"] == 0


def test_marching_on_the_spot_shows_in_drift_and_travel(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """The pelvis-heading frame cannot see it, so the table has columns of its own for it."""
    still = perfect(sway)
    walked = still.target + np.linspace(0, 2, STEPS)[:, None, None, None] * [1.0, 0, 0]
    scored = row(robot, sway, dataclasses.replace(still, target=walked))
    assert scored["drift_m"] == pytest.approx(2.0, abs=0.05)
    assert scored["travel_ratio"] == pytest.approx(0.0, abs=0.05)


def test_a_robot_that_lies_down_has_fallen(robot: Robot, sway: ReferenceMotion) -> None:
    """A controller that lets go of every joint does not stay up."""
    starts = Starts(np.zeros(2, int), sway.qpos[[0, 0]], sway.qvel[[0, 0]])
    limp = roll_out(
        robot,
        Clip(sway),
        Driver(ControlConfig(stiffness=1e-6), lambda sim, *rest: np.zeros((sim.n, 17))),
        starts,
        np.full(2, 200),
        1,
        Fall.of(robot),
    )
    assert limp.fell.all()
    assert (limp.length < 200).all()


def test_the_shown_rollout_begins_with_its_start(robot: Robot, sway: ReferenceMotion) -> None:
    brief = EvaluateConfig(
        seconds=0.15, phases=2, resets=1, joint_noise=0, joint_speed_noise=0, root_speed_noise=0
    )
    shown = evaluate_policy(idle(robot, sway), sway, robot, brief).rollout_qpos
    np.testing.assert_allclose(shown[0], sway.qpos[0])
    assert len(shown) == 11


@pytest.mark.medium
def test_a_clip_that_is_not_cyclic_is_danced_to_its_end(
    robot: Robot, sway: ReferenceMotion
) -> None:
    open_clip = dataclasses.replace(sway, cyclic=False)
    verdict = evaluate_policy(
        idle(robot, sway), open_clip, robot, EvaluateConfig(phases=4, resets=1)
    )
    phases = [int(r["phase"]) for r in verdict.rows if r["policy"] == "trained"]  # type: ignore[call-overload]
    assert max(phases) < len(sway) // 4
    assert all(0 <= float(r["clip_fraction"]) <= 1 for r in verdict.rows)  # type: ignore[arg-type]


def test_a_policy_with_another_control_rate_is_refused(robot: Robot, sway: ReferenceMotion) -> None:
    hurried = idle(robot, sway, ControlConfig(substeps=1))
    with pytest.raises(BadPolicy, match="control step"):
        evaluate_policy(hurried, sway, robot, EvaluateConfig())


def test_a_policy_for_a_robot_of_another_name_is_refused(
    robot: Robot, sway: ReferenceMotion
) -> None:
    stranger = dataclasses.replace(idle(robot, sway), facts={"robot": "humanoid_strong"})
    with pytest.raises(BadPolicy, match="humanoid_strong"):
        evaluate_policy(stranger, sway, robot, EvaluateConfig())


def test_an_older_policy_of_own_measurements_is_audited_under_its_own_law(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """It had no feedback; today a training with the same configuration would have."""
    policy = random_policy(robot, sway)
    environment = environment_of(policy, control_of(policy, robot))
    assert isinstance(environment, TrackConfig)
    assert environment.observation == "onboard"
    assert track_mode.control_of(environment).feedback == 0.0


@pytest.mark.medium
def test_a_robot_whose_gains_changed_since_the_training_is_refused(
    robot: Robot, sway: ReferenceMotion
) -> None:
    policy = idle(robot, sway)
    facts = dict(policy.facts) | {"actuation": actuation_facts(robot, ControlConfig())}
    known = dataclasses.replace(policy, facts=facts)
    older = ControlConfig(
        feedback=0.0, feedback_path="reference", action_factor=1.0, root_state="exact"
    )
    assert control_of(known, robot) == older
    softer = load_robot(dataclasses.replace(robot.description, action_scale={"*_knee": 0.2}))
    with pytest.raises(BadPolicy, match=r"action_scale 0\.5 of right_knee .* has 0\.2 now"):
        control_of(known, softer)


def test_a_policy_of_another_dance_is_evaluated_with_a_note(
    robot: Robot, sway: ReferenceMotion, caplog: pytest.LogCaptureFixture
) -> None:
    policy = idle(robot, sway)
    stranger = dataclasses.replace(policy, facts={**policy.facts, "reference_sha256": "other"})
    brief = EvaluateConfig(seconds=0.15, phases=1, resets=1)
    verdict = evaluate_policy(stranger, sway, robot, brief)
    assert "another reference motion" in caplog.text
    assert verdict.summary["reference_sha256"] == poses_sha256(sway), "the motion of the figures"


@pytest.mark.parametrize("steps", [0, 1, 2])
def test_a_reference_without_motion_is_refused(
    robot: Robot, sway: ReferenceMotion, steps: int
) -> None:
    cut = {
        name: getattr(sway, name)[:steps]
        for name in ("qpos", "qvel", "keypoints_w", "body_pos_w", "contact", "source_time_s")
    }
    short = dataclasses.replace(sway, **cut)
    with pytest.raises(TrackTooShort, match=f"has {steps} steps"):
        Clip(short)
    with pytest.raises(TrackTooShort, match=f"has {steps} steps"):
        lead_of(robot, short, ControlConfig(feedforward=1.0))


def test_a_reference_that_is_not_a_number_is_refused(sway: ReferenceMotion) -> None:
    qpos = sway.qpos.copy()
    qpos[3, 9] = np.nan
    with pytest.raises(RejectedReference, match="not finite"):
        Clip(dataclasses.replace(sway, qpos=qpos))


@pytest.mark.medium
def test_a_statue_that_earns_more_than_the_policy_raises_a_flag(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """A policy that falls at once earns less than a body that is carried along."""
    verdict = evaluate_policy(idle(robot, sway), sway, robot, EvaluateConfig(phases=2, resets=1))
    reward = verdict.summary["reward"]
    assert reward["flagged"] is True  # type: ignore[index]
    assert reward["statue_return"] > reward["own_return"]  # type: ignore[index]
    terms = [abs(share) for share in reward["of_terms"].values()]  # type: ignore[index]
    assert sum(terms) == pytest.approx(1)


def test_every_rollout_is_measured_by_the_papers_reward_too(
    robot: Robot, sway: ReferenceMotion
) -> None:
    brief = EvaluateConfig(seconds=0.15, phases=1, resets=1)
    rows = evaluate_policy(idle(robot, sway), sway, robot, brief).rows
    assert {row["policy"] for row in rows} >= {"trained", "hold", "statue", "zero_residual"}
    for row in rows:
        terms = [value for key, value in row.items() if key.startswith("reward_")]
        assert row["return_own"] == pytest.approx(sum(terms))  # type: ignore[arg-type]
        assert 0 < row["return_paper"] < 10 * 5.2  # type: ignore[operator]


@pytest.mark.medium
def test_the_papers_reward_is_the_same_whatever_a_policy_was_trained_with(
    robot: Robot, sway: ReferenceMotion
) -> None:
    nothing = (np.zeros((348, 17)), np.zeros(17))
    control = dataclasses.asdict(ControlConfig(law="torque"))
    facts = {"robot": "humanoid", "mode": "paper", "control": control, "repeats": 1}
    brief = EvaluateConfig(seconds=0.15, phases=1, resets=1)
    paid = []
    for preset in ("paper", "released", "walker"):
        environment = dataclasses.asdict(PaperConfig(preset=preset))
        policy = Policy((nothing,), {**facts, "environment": environment})
        rows = evaluate_policy(policy, sway, robot, brief).rows
        paid.append([row["return_paper"] for row in rows if row["policy"] == "trained"])
    assert paid[0][0] > 0
    assert paid == [paid[0]] * 3


def test_a_policy_of_another_version_is_refused_in_words(
    robot: Robot, sway: ReferenceMotion
) -> None:
    policy = idle(robot, sway)
    control = {**policy.facts["control"], "jerk": 3}  # type: ignore[dict-item]
    strange = dataclasses.replace(policy, facts={**policy.facts, "control": control})
    with pytest.raises(BadPolicy, match=r"control\.jerk = 3 .*another version of RoboJackson"):
        evaluate_policy(strange, sway, robot, EvaluateConfig(phases=1, resets=1))


def test_the_usage_of_a_joint_is_its_spread_over_the_references(
    robot: Robot, sway: ReferenceMotion
) -> None:
    lively = perfect(sway)
    qpos = lively.qpos.copy()
    knee = 7 + robot.joint_names.index("left_knee")
    qpos[:, 0, knee] = 3 * qpos[:, 0, knee]
    scored = row(robot, sway, dataclasses.replace(lively, qpos=qpos))
    assert scored["usage_left_knee"] == pytest.approx(3)
    assert scored["usage_right_knee"] == pytest.approx(1)


@pytest.mark.medium
def test_a_policy_of_paper_mode_is_evaluated_on_348_observations(
    robot: Robot, sway: ReferenceMotion
) -> None:
    nothing = (np.zeros((348, 17)), np.zeros(17))
    control = dataclasses.asdict(ControlConfig(law="torque"))
    facts = {"robot": "humanoid", "mode": "paper", "control": control, "repeats": 4}
    brief = EvaluateConfig(seconds=0.6, phases=1, resets=1)
    summary = evaluate_policy(Policy((nothing,), facts), sway, robot, brief).summary
    assert summary["variants"] == {}
    assert set(summary["reward"]["audit"]) == {"root", "world"}  # type: ignore[index]


def test_a_rollout_of_paper_mode_lies_where_the_given_reference_does(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """The paper evaluates the motion turned ahead; pages show it beside the motion as it is."""
    away = FloorMove(np.array([1.2]), np.array([[0.7, -0.4]]))
    turned = dataclasses.replace(
        sway, qpos=away.qpos(np.array(sway.qpos)), qvel=away.qvel(np.array(sway.qvel)),
        keypoints_w=away.points(np.array(sway.keypoints_w)),
    )  # fmt: skip
    control = dataclasses.asdict(ControlConfig(law="torque"))
    weights = (np.zeros((348, robot.model.nu)), np.zeros(robot.model.nu))
    policy = Policy((weights,), {"robot": "humanoid", "mode": "paper", "control": control})
    found = evaluate_policy(policy, turned, robot, EvaluateConfig(phases=2, resets=1))
    off = np.linalg.norm(found.rollout_qpos[0, :2] - turned.qpos[0, :2])
    assert off < 0.02  # the noise of the start
    ahead = wrapped(heading(found.rollout_qpos[:1, 3:7]) - heading(turned.qpos[:1, 3:7]))
    assert abs(float(ahead[0])) < 0.02
