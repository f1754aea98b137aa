"""Write a deploy pack without a network: the feedback along a motion, from measurements alone."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from robojackson.api.arguments import FilePath, RobotLike, require_robot, robot_of
from robojackson.api.pack_parts import machine_of, motor_of_hinge, own_evaluation, write_pack
from robojackson.api.policy_ingredients import motion_ingredients
from robojackson.api.robots import load_robot
from robojackson.api.trackers import load_tracker
from robojackson.errors import BadPolicy
from robojackson.formats.deploy.deployed_feedback import DeployedFeedback, balls_of, soles_of
from robojackson.formats.deploy.licence_passport import Ingredient, with_declared
from robojackson.formats.deploy.pack_files import feedback_files
from robojackson.formats.deploy.pack_readme import Figures
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.tracker_descriptions import describe_tracker
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.feedback.cached_feedback import feedback_of
from robojackson.rl.feedback.nominal_path import Progress, no_progress
from robojackson.rl.feedback.standing_feet import LOW_M, foot_sites
from robojackson.rl.policy import Policy
from robojackson.rl.policy_facts import OTHER_PATH, is_of_another_path
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.leg_odometry import CONSTANTS
from robojackson.rl.sim.motors import Motors
from robojackson.rl.trackers.tracker import Tracker
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import Robot

ODOMETRY = {**CONSTANTS, "foot_low": LOW_M}


def write_feedback_pack(
    tracker: str | Tracker,
    reference: FilePath,
    folder: FilePath,
    *,
    robot: RobotLike | None = None,
    evaluation: FilePath | None = None,
    licences: Mapping[str, str] | None = None,
    progress: Progress = no_progress,
) -> Figures:
    """Write a tracker that is feedback from a robot's own measurements, as a pack that runs alone.

    Args:
        tracker: A tracker whose `root_state` is estimated, or its name: `regulator_onboard`.
        reference: The motion.
        folder: Folder for the pack.
        robot: The one that the motion was made for; None finds it.
        evaluation: evaluation.json of `robojackson evaluate TRACKER REFERENCE`, whose figures and
            passport go into the pack; None looks beside the motion.
        licences: Licences of inputs by kind, where nothing records them: `{"clip": "CC-BY-4.0"}`.
        progress: Called with a name, the steps that are done, and all, while the feedback is
            computed.

    Returns:
        What was written: files, the passport's cases and its weakest, and what the licences allow.

    Raises:
        UnknownName: no such tracker.
        BadPolicy: one that needs more than a robot measures, or a network of others; another robot.
        StoreError: a file is missing or cannot be written.
        BadConfiguration: a robot or a licence that cannot go into a pack, or an evaluation of
            another tracker or motion.
    """
    described = describe_tracker(tracker) if isinstance(tracker, str) else tracker.description
    _require_onboard(described)
    who = load_tracker(tracker) if isinstance(tracker, str) else tracker
    source = Path(reference)
    motion = ReferenceMotion.load(source)
    machine = robot_of(motion) if robot is None else require_robot(motion, load_robot(robot))
    machine = who.equip(machine)
    evaluated = own_evaluation(
        f"{described.name!r}",
        f"robojackson evaluate {described.name} {source}",
        source.parent,
        evaluation,
        motion,
        lambda found: found.get("tracker") == described.name,
    )
    note = "computed from the robot's model and the motion"
    law = Ingredient("tracker", f"the feedback, {described.name}", "own", note)
    others = motion_ingredients(source, machine, network=False)
    ingredients = with_declared([law, *others], licences or {})
    parts = deployed_feedback(who.control, motion, machine, progress)
    files = feedback_files(parts, machine, ingredients, evaluated)
    written = write_pack(Path(folder), files, ingredients, evaluated)
    return {"robot": motion.robot, **written}


def _require_onboard(tracker: TrackerDescription) -> None:
    """Refuse what a real robot cannot run.

    Raises:
        BadPolicy: a network, or feedback of the exact state.
    """
    alone = tracker.network == "regulator" and tracker.file is None
    if not alone or tracker.root_state != "estimated":
        raise BadPolicy(
            f"tracker {tracker.name!r} cannot go into a deploy pack: that takes a tracker of the "
            "network `regulator` with `root_state: estimated` and no file, such as "
            "regulator_onboard, or a policy that was trained with --set track.observation=onboard"
        )


def deployed_feedback(
    control: ControlConfig,
    reference: ReferenceMotion,
    robot: Robot,
    progress: Progress,
    policy: Policy | None = None,
) -> DeployedFeedback:
    """Put together what a pack is made from, in the order of the hinges.

    Args:
        policy: What was trained on top of it; None for the feedback alone.

    Raises:
        BadPolicy: the robot has hinges without a motor, or no feedback, or this is another than
            the policy's.
    """
    motor, hinge = motor_of_hinge(robot), Motors.of(robot.model).hinge
    found = feedback_of(robot, [reference], control, progress)
    if found is None:
        raise BadPolicy(f"robot {robot.description.name!r} has no feedback along a motion")
    if policy is not None and is_of_another_path(policy, found.outline):
        raise BadPolicy(OTHER_PATH)
    gains, lead = found.gains, lead_of(robot, reference, control)
    targets = np.asarray(reference.qpos, float)[:, 7:][:, hinge]
    targets = targets if lead is None else targets + lead
    sites = foot_sites(robot)
    model = robot.model
    return DeployedFeedback(
        machine=machine_of(robot, reference, control),
        targets=targets[:, motor],
        gain=gains.gain[:, motor],
        offset=gains.offset[:, motor],
        limit=found.limit[motor],
        path_qpos=gains.qpos,
        path_qvel=gains.qvel,
        places=found.footholds,
        soles=soles_of(robot),
        feet=balls_of(robot, model.site_bodyid[sites], model.site_pos[sites], np.zeros(len(sites))),
        imu=robot.description.imu,
        odometry=ODOMETRY,
    )
