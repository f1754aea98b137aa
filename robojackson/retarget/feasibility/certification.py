"""Certify a motion: which steps the robot can do, which joint or contact fails in the others.

A step fails for a torque when it would be feasible without torque limits; otherwise nothing that
the soles can push replaces the missing support. Joins what fails in a row to one finding.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from robojackson.geometry.rotations import quat_to_matrix
from robojackson.motion.certificate import Cause, Certificate, Finding
from robojackson.retarget.feasibility import contact_wrench, inverse_dynamics, tempo
from robojackson.retarget.feasibility.contact_wrench import Supply, Tolerance
from robojackson.retarget.feasibility.inverse_dynamics import FreeSpace
from robojackson.retarget.targets.ground_contact import GRAVITY
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import pose

_GAP_STEPS = 4  # findings so near to each other are one


@dataclass(frozen=True)
class Certified:
    """A motion's certificate, and the loads it was made from."""

    certificate: Certificate
    torque_ratio: Float[np.ndarray, "S J"]
    missing_bw: Float[np.ndarray, " S"]


@dataclass(frozen=True)
class _Failure:
    """Failure of one step: cause, the joint or part, how much, and the tempo that repairs it."""

    cause: Cause
    part: str
    amount: float
    lever_m: float
    tempo: float


def certify(
    robot: Robot,
    qpos: Float[np.ndarray, "S nq"],
    dt: float,
    cycle_offset: np.ndarray | None,
    tolerance: Tolerance,
) -> Certified:
    """Return what the robot can and cannot do of a motion."""
    needs, near, forces = _demand(robot, qpos, dt, cycle_offset, tolerance)
    found = contact_wrench.supply(needs)
    slack = tempo.slower_slacks(needs, forces, found.slack)
    free = _without_limits(needs, found)
    free = replace(free, torque=_motor_torque(needs, free))  # a stop carries the rest
    failures = [
        _failure(robot, step, found, free, near, slack, tolerance)
        for step in range(len(qpos))
    ]  # fmt: skip
    falls = _falls(robot, qpos)
    findings = sorted((*_joined(failures), *_joined(falls)), key=lambda finding: finding.start)
    ratio = np.abs(_motor_torque(needs, found)) / robot.torque_limit
    return Certified(
        Certificate(found.slack, tempo.feasible_tempo(slack), tuple(findings)),
        ratio,
        tolerance.force_bw * np.linalg.norm(found.left[:, :3], axis=1),
    )


def motor_torques(
    robot: Robot,
    qpos: Float[np.ndarray, "S nq"],
    dt: float,
    cycle_offset: np.ndarray | None,
    tolerance: Tolerance,
) -> Float[np.ndarray, "S J"]:
    """Return the torque of every hinge's motor that the motion needs, within its limit, Nm."""
    needs, *_ = _demand(robot, qpos, dt, cycle_offset, tolerance)
    return _motor_torque(needs, contact_wrench.supply(needs))


def _demand(
    robot: Robot,
    qpos: Float[np.ndarray, "S nq"],
    dt: float,
    cycle_offset: np.ndarray | None,
    tolerance: Tolerance,
) -> tuple[contact_wrench.Demand, Bool[np.ndarray, "S C"], FreeSpace]:
    """Return what a motion needs at its own tempo, which soles are near the floor, and the parts
    of the force."""
    forces = inverse_dynamics.free_space(robot, qpos, dt, cycle_offset)
    posed = pose(inverse_dynamics.linkage(robot), qpos)
    near = inverse_dynamics.touching(robot, posed)
    needs = inverse_dynamics.demand(robot, qpos, forces.at(1.0), near, tolerance, posed)
    return needs, near, forces


def fallen(robot: Robot, qpos: Float[np.ndarray, "S nq"]) -> Bool[np.ndarray, " S"]:
    """Return the steps that the fall rule ends."""
    return np.array([failure is not None for failure in _falls(robot, qpos)])


def _motor_torque(needs: contact_wrench.Demand, found: Supply) -> Float[np.ndarray, "S J"]:
    """Return the torque of the motors; beyond its limit a hinge on its stop is held by the stop."""
    limit = 1.0 / np.where(needs.ease > 0, needs.ease, np.inf)
    upper = np.where(np.isinf(needs.upper) & (needs.ease > 0), limit, np.inf)
    lower = np.where(np.isinf(needs.lower) & (needs.ease > 0), -limit, -np.inf)
    result: np.ndarray = np.clip(found.torque, lower, upper)
    return result


def _without_limits(needs: contact_wrench.Demand, found: Supply) -> Supply:
    """Return the slack with unlimited torques; steps that are feasible keep their slack."""
    hard = np.flatnonzero(found.slack > 1.0)
    if not len(hard):
        return found
    some = needs.at(hard)
    endless = np.full_like(some.upper, np.inf)
    free = contact_wrench.supply(replace(some, lower=-endless, upper=endless))
    torque, left = found.torque.copy(), found.left.copy()
    torque[hard], left[hard] = free.torque, free.left
    return replace(found, torque=torque, left=left)


def _failure(
    robot: Robot,
    step: int,
    found: Supply,
    free: Supply,
    near: np.ndarray,
    slack: Float[np.ndarray, "K S"],
    tolerance: Tolerance,
) -> _Failure | None:
    if found.slack[step] <= 1.0:
        return None
    mends = float(tempo.feasible_tempo(slack[:, step : step + 1])[0])
    if free.slack[step] <= 1.0:
        ratio = np.abs(free.torque[step]) / robot.torque_limit
        worst = int(ratio.argmax())
        return _Failure("torque", robot.joint_names[worst], float(ratio[worst]), 0.0, mends)
    missing = tolerance.force_bw * GRAVITY * float(np.linalg.norm(found.left[step, :3]))
    lever = tolerance.lever_m * float(np.linalg.norm(found.left[step, 3:6]))
    cause: Cause = "support" if near[step].any() else "no contact"
    return _Failure(cause, "", missing, lever, mends)


def _falls(robot: Robot, qpos: Float[np.ndarray, "S nq"]) -> list[_Failure | None]:
    rule = Fall.of(robot)
    if rule.relative:  # a motion does not fall beside itself
        return [None] * len(qpos)
    up = quat_to_matrix(qpos[:, 3:7])[:, 2, 2]
    tilt = np.degrees(np.arccos(np.clip(up, -1.0, 1.0)))
    out: list[_Failure | None] = []
    for angle, height in zip(tilt, qpos[:, 2], strict=True):
        if angle > np.degrees(rule.tilt):
            out.append(_Failure("fall rule", "tilt", float(angle), 0.0, 0.0))
        elif height < rule.height:
            out.append(_Failure("fall rule", "height", float(height), 0.0, 0.0))
        else:
            out.append(None)
    return out


def _joined(failures: Sequence[_Failure | None]) -> Iterator[Finding]:
    """Yield the findings of failures of one cause and part that follow each other."""
    run: list[tuple[int, _Failure]] = []
    for step, failure in enumerate(failures):
        if failure is None:
            continue
        if run and not _continues(run[-1], step, failure):
            yield _finding(run)
            run = []
        run.append((step, failure))
    if run:
        yield _finding(run)


def _continues(last: tuple[int, _Failure], step: int, failure: _Failure) -> bool:
    same = (last[1].cause, last[1].part) == (failure.cause, failure.part)
    return same and step - last[0] <= _GAP_STEPS


def _finding(run: list[tuple[int, _Failure]]) -> Finding:
    """Return one finding: the middle failure gives its figures, the slowest tempo repairs all."""
    start, end = run[0][0], run[-1][0] + 1
    failures = sorted((failure for _, failure in run), key=_size)
    usual, slowest = failures[len(failures) // 2], min(failure.tempo for failure in failures)
    if usual.cause in ("torque", "fall rule"):
        usual = failures[-1]
    what, otherwise = _describe(usual)
    repair = f"slow to {slowest:.1f}" if slowest > 0 else otherwise
    return Finding(start, end, usual.cause, what, repair)


def _size(failure: _Failure) -> float:
    """Return the size of a failure relative to others of its kind."""
    sign = -1.0 if failure.part == "height" else 1.0
    return sign * failure.amount + GRAVITY * failure.lever_m


def _describe(worst: _Failure) -> tuple[str, str]:
    """Return what fails, and the remedy where a slower tempo is none."""
    if worst.cause == "torque":
        return (
            f"{worst.part} torque {worst.amount:.2f}x its limit",
            f"needs motors {worst.amount:.1f} times as strong",
        )
    if worst.cause == "fall rule":
        if worst.part == "tilt":
            return f"tilted {worst.amount:.0f} degrees: a fall", "cut it out"
        return f"root at {worst.amount:.2f} m: a fall", "cut it out"
    if worst.cause == "no contact":
        return (
            f"no contact and no free fall: {worst.amount:.1f} m/s2 of support missing",
            "needs a foot on the floor",
        )
    return (
        f"body not over its feet: {worst.amount:.1f} m/s2 and a lever of "
        f"{100 * worst.lever_m:.0f} cm missing",
        f"needs a foot or a lean {_reach_cm(worst):.0f} cm further",
    )


def _reach_cm(failure: _Failure) -> float:
    """Return how far the body stands beside its support: as a lever, and as a push at a metre's
    height."""
    return 100 * (failure.lever_m + failure.amount / GRAVITY)
