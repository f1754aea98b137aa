"""`README.md` of a deploy pack: its files, its figures, and what to do before a real robot."""

from collections.abc import Mapping, Sequence
from typing import Any

from robojackson.formats.deploy.deployed_feedback import DeployedFeedback
from robojackson.formats.deploy.deployed_machine import DeployedMachine
from robojackson.formats.deploy.deployed_policy import DeployedPolicy

Figures = Mapping[str, Any]
COMMON = """\
| `robot.xml` | the robot with its motors and stepping, without meshes |
| `LICENCES.md`, `licences.json` | what it was made from, and what the licences allow |
| `licences/` | the texts that go with the robot's model |
"""
FILES = """\
| file | what |
|---|---|
| `run.py` | runs it: `pip install numpy onnxruntime mujoco`, `python run.py --view` |
| `policy.onnx` | `obs`, `time_step` in; `actions` and the motion out, as mjlab exports |
| `policy_obs.onnx` | the same function, `obs` in, `actions` out, for Unitree's C++ runner |
| `motion.npz` | the motion for mjlab; the command of a control step is one row ahead |
| `deploy.yaml` | joint order, gains, limits, scale, layout; Unitree's keys first |
| `simulated_robot.py` | the robot that it drives, in MuJoCo |
"""
FEEDBACK_FILES = """\
| file | what |
|---|---|
| `run.py` | runs it: `pip install numpy mujoco`, `python run.py --view` |
| `state_estimator.py` | what it knows of itself from what it measures |
| `network_runner.py` | the part that packs with a network share: start and stop |
| `simulated_robot.py` | the robot that it drives, in MuJoCo |
| `feedback.npz` | targets, gains and the path that they keep the robot on, a row a control step |
| `deploy.yaml` | joint order, gains, limits, soles, accelerometer, odometry; Unitree's keys first |
"""
POLISHED_FILES = """\
| file | what |
|---|---|
| `run.py` | runs it: `pip install numpy onnxruntime mujoco`, `python run.py --view` |
| `feedback_runner.py`, `network_runner.py` | its parts |
| `state_estimator.py` | what it knows of itself from what it measures |
| `simulated_robot.py` | the robot that it drives, in MuJoCo |
| `policy.onnx` | `obs`, `time_step` in; `actions` and the motion out, as mjlab exports |
| `motion.npz` | the motion for mjlab; the command of a control step is one row ahead |
| `feedback.npz` | gains and the path that they keep the robot on, a row a control step |
| `deploy.yaml` | joint order, gains, limits, layout, soles, accelerometer; Unitree's keys first |
"""
NOT_ALONE = """\
The network was trained on top of the feedback: mjlab's and Unitree's runners, which do not know the
feedback, would let the robot fall.
"""
ESTIMATE = """\
## What it measures and what it estimates

A control step ahead, target = `targets` - (`gain` @ difference + `offset`), at most
`feedback_limit` away from `targets`; the difference is that of the robot's state from `path_qpos`
and `path_qvel`, position before velocity, as `mj_differentiatePos` orders it. That path is moved
along the floor so that its feet, `places`, are at the robot's own.

No robot measures where its root is and how fast it travels: the pack estimates both. The sole
points (`soles`) that carry the robot are taken to rest, or to slide as the motion's, so that
joints, attitude and gyroscope give the root's velocity and height; the accelerometer, at `imu` in
the root's frame, bridges slips and steps. The floor is level and starts where the robot stands.

- `read()`: attitude wxyz, gyroscope in the root's axes, joint angles and speeds.
- `force()`: the accelerometer in the root's axes, m/s^2, as a mean since the last call: average
  what your sensor gives in a control step. At rest it is the opposite of gravity.

In the figures below attitude, gyroscope and joints are exact and the accelerometer has noise of
.1 m/s^2; read the passport's rows of noise and pushes before anything else.
"""
SAFETY = """\
## Before a real robot

Nothing here has been on a real robot. All figures above are of simulations.

1. Run `run.py --view` and watch the whole dance. Stop here if a row of the passport is bad. On
   macOS MuJoCo's viewer needs `mjpython run.py --view`.
2. Hang the robot from a gantry with slack for the dance, feet just off the floor, 3 m free around
   it, no person within reach, and a second person at the emergency stop of the robot itself.
3. `Runner(robot=...)` drives any object with `joints` (names, in order), `read()` (attitude wxyz,
   gyroscope in the root's axes, joint angles and speeds), `drive(target, stiffness, damping)`
   {also}. Your `drive` must keep the limits of `deploy.yaml`, as `SimulatedRobot.drive` does, and
   return after one control step: a loop that is late is another robot.
4. First with the stop in your hand and damping alone (`drive` with stiffness 0), then the soft
   start, then one second of the dance, then more.
5. It stops by itself when robot and motion lean apart more than `stop_tilt`, when a joint is twice
   as fast as its limit, and when a value is no number; Ctrl-C and SIGTERM stop it as well. To stop
   is to damp: the robot sinks down. It neither stands up again nor catches itself.
6. It refuses to start when {refused}.
"""
OF_NETWORK = """\
names, sizes or order of the observation or of the joints differ from
   what the policy was trained with. Do not pad or cut an observation to make it start"""
OF_FEEDBACK = """\
joints differ in name or order, or when `feedback.npz` is of another pack"""


def policy_readme(policy: DeployedPolicy, figures: Figures | None) -> bytes:
    """Return the content of the file for a network.

    Args:
        figures: Figures of the evaluation on stock physics, with `passport` where one was made;
            None where there is none.
    """
    tail = (
        f"{policy.observation_size} inputs (layout `{policy.layout_sha256[:12]}`), "
        "target = default_joint_pos + action_scale * action."
    )
    safety = SAFETY.format(refused=OF_NETWORK, also="and nothing else")
    own = [_head(policy.machine, tail), FILES.strip() + "\n" + COMMON, _terms(policy)]
    return _text([*own, *_figures(figures), safety])


def feedback_readme(feedback: DeployedFeedback, figures: Figures | None) -> bytes:
    """Return the content of the file for feedback without a network; arguments of
    `policy_readme`."""
    tail = "linear feedback along the motion, without a network."
    safety = SAFETY.format(refused=OF_FEEDBACK, also="and `force()`")
    files = FEEDBACK_FILES.strip() + "\n" + COMMON
    return _text([_head(feedback.machine, tail), files, ESTIMATE, *_figures(figures), safety])


def polished_readme(policy: DeployedPolicy, figures: Figures | None) -> bytes:
    """Return the content of the file for a network on top of feedback; arguments of
    `policy_readme`."""
    tail = (
        f"{policy.observation_size} inputs (layout `{policy.layout_sha256[:12]}`), "
        "target = default_joint_pos + action_scale * action, moved by linear feedback."
    )
    refused = f"{OF_NETWORK}, or when `feedback.npz` is of another pack"
    safety = SAFETY.format(refused=refused, also="and `force()`")
    own = [_head(policy.machine, tail), POLISHED_FILES.strip() + "\n" + COMMON, NOT_ALONE]
    own.append(_terms(policy))
    estimate = ESTIMATE.replace("`targets`", "the network's target")
    return _text([*own, estimate, *_figures(figures), safety])


def _text(parts: Sequence[str]) -> bytes:
    return "\n\n".join(part.strip() for part in parts).encode() + b"\n"


def _head(machine: DeployedMachine, tail: str) -> str:
    reference = machine.reference
    kind = "repeats" if reference.cyclic else "ends"
    return (
        f"# Deploy pack: {reference.robot}, {len(reference) * reference.dt:.1f} s of motion that "
        f"{kind}\n\nMade by `robojackson export --to deploy`. Control step "
        f"{1e3 * reference.dt:g} ms, {len(machine.joints)} joints, {tail}"
    )


def _figures(figures: Figures | None) -> list[str]:
    return [_evaluation(figures), _passport((figures or {}).get("passport") or ())]


def _terms(policy: DeployedPolicy) -> str:
    lines = ["## Observation", "", "| term | from | size |", "|---|---|---|"]
    at = 0
    for name, size in policy.terms:
        lines.append(f"| `{name}` | {at} | {size} |")
        at += size
    tail = (
        "`motion_anchor_ori_b`: first two columns, row by row, of the rotation of the motion's "
        f"`{policy.anchor}` in the robot's; the motion is turned to where the robot faces at the "
        "start. Joint angles are relative to `default_joint_pos`, those of the command are not; "
        "speeds are rad/s, nothing is scaled; `actions` is the last output, zero at first."
    )
    return "\n".join([*lines, "", tail])


def _evaluation(figures: Figures | None) -> str:
    if not figures:
        return "## Evaluation\n\nNone was given: `robojackson evaluate` makes one."
    rows = [("success", "%", 100.0), ("strict_success", "%", 100.0), ("skill", "", 1.0)]
    rows += [("site_error_m", "mm", 1e3), ("mpjpe_l_m", "mm", 1e3)]
    lines = ["## Evaluation", "", "| figure | mean |", "|---|---|"]
    for name, unit, factor in rows:
        if isinstance(figures.get(name), int | float):
            lines.append(f"| {name.removesuffix('_m')} | {factor * figures[name]:.3g} {unit} |")
    return "\n".join(lines)


def _passport(rows: Sequence[Figures]) -> str:
    if not rows:
        return (
            "## Sim-to-sim passport\n\nNone was made: `robojackson evaluate --passport` makes it."
        )
    lines = [
        "## Sim-to-sim passport",
        "",
        "The same policy under other physics (`passport.json`).",
        "",
    ]
    lines += ["| case | strict success % | success % | skill | site error mm | kept % |"]
    lines += ["|---|---|---|---|---|---|"]
    for row in rows:
        strict, held, skill, error, kept = (
            _figure(row.get(name), factor)
            for name, factor in (
                ("strict_success", 100),
                ("success", 100),
                ("skill", 1),
                ("site_error_m", 1e3),
                ("kept", 100),
            )
        )
        lines.append(f"| {row['case']} | {strict} | {held} | {skill} | {error} | {kept} |")
    return "\n".join(lines)


def _figure(value: object, factor: float) -> str:
    return f"{factor * value:.3g}" if isinstance(value, int | float) else "-"
