"""Performances: several dances in a row by one robot, with a tracker that follows them."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path

import numpy as np

from robojackson.api.arguments import FilePath, Progress, RobotLike, counter, require_robot
from robojackson.api.motions import read_motion, recover_motion, retarget_motion
from robojackson.api.robots import load_robot
from robojackson.api.trackers import load_tracker
from robojackson.clips.video import SUFFIXES
from robojackson.errors import BadPolicy
from robojackson.files.file_tree import results_in
from robojackson.files.json_types import to_json
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.rollout import Rollout
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.run_names import motion_name
from robojackson.pipeline.tracker_descriptions import require_tracker, usual_robot
from robojackson.retarget.performance.programme import Programme, ProgrammeConfig, plan
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.rl.config.performance_config import PerformanceConfig
from robojackson.rl.evaluation import performance
from robojackson.rl.evaluation.performance_record import PartRow, RunRow, Summary
from robojackson.rl.trackers.tracker import Tracker
from robojackson.robot.model import Robot

Dance = FilePath | SmplSequence | ReferenceMotion
ONE = (str, PathLike, SmplSequence, ReferenceMotion)
"""Types of a single dance."""
SEARCHES = (
    "%s computes gains for all %.0f s of the programme first: minutes of a processor, and it may "
    "find no path for so long a motion; a network needs no search (robojackson trackers lists them)"
)
PROGRAMME, ROLLOUT, RESULT = "programme.parquet", "rollout.parquet", "performance.json"

log = logging.getLogger(__name__)


@dataclass(frozen=True, repr=False)
class Performance:
    """Runs of one performance.

    Attributes:
        programme: Dances, stands and ways between them as one motion.
        summary: `finished`, `danced_share`, ...: means and counts over the runs; tracker, robot.
        parts: A row a part of the programme.
        runs: A row a run.
        rollout: What the robot did in the first run, including a fall.
        followed: Where the programme was at the same steps: it waits for a robot that lost balance.
    """

    programme: Programme
    summary: Summary
    parts: list[PartRow]
    runs: list[RunRow]
    rollout: Rollout
    followed: ReferenceMotion = field(repr=False)

    def __repr__(self) -> str:
        return (
            f"Performance({self.summary['finished']} of {self.summary['runs']} runs finished, "
            f"{self.summary['danced_share']:.0%} of the dances danced, {self.programme.motion})"
        )

    def save(self, folder: FilePath) -> Path:
        """Write programme.parquet, rollout.parquet and performance.json.

        Returns:
            The folder.

        Raises:
            StoreError: it cannot be written.
        """
        answer = {**self.summary, "parts": self.parts, "rows": self.runs}
        with results_in(Path(folder)) as files:
            files.write(PROGRAMME, self.programme.motion.to_bytes())
            files.write(ROLLOUT, self.rollout.to_bytes())
            files.write(RESULT, to_json(answer))
        return Path(folder)


def perform(
    dances: Dance | Sequence[Dance],
    robot: RobotLike | None = None,
    *,
    tracker: str | Tracker | None = None,
    config: PerformanceConfig | None = None,
    programme: ProgrammeConfig | None = None,
    retarget: RetargetConfig | None = None,
    progress: Progress = False,
) -> Performance:
    """Let a robot stand, go into the first dance, dance all of them, and stand again.

    Args:
        dances: One or several videos, motions of people or reference motions, or files of them.
        robot: Name, YAML file, or what `load_robot` returned; the first tracker's when None.
        tracker: Who dances: a name of configs/trackers or a tracker; the robot's first one that is
            here when None.
        config: Runs, pushes, and when a robot gives a part up.
        programme: How long dances that repeat go on, and the stands.
        retarget: How a person's motion becomes the robot's, and how the ways are solved.
        progress: True shows a bar; a function is called with (steps done, steps in all).

    Returns:
        Rows of the runs and of the parts, and the motion of the first run.

    Raises:
        RejectedReference: no dance, one of another robot, or a way that the robot cannot do.
        BadPolicy: no tracker for the robot is here.
        UnreadableVideo, NoPersonFound, ...: see `recover_motion` and `retarget_motion`.
    """
    machine = load_robot(usual_robot() if robot is None else robot)
    solving = retarget or RetargetConfig()
    who = _tracker(tracker, machine)
    motions = [_motion(d, i, machine, solving) for i, d in enumerate(_several(dances))]
    planned = plan(motions, machine, programme or ProgrammeConfig(), solving)
    how = config or PerformanceConfig()
    if who.description.network == "regulator":
        log.warning(SEARCHES, who.description.name, len(planned.motion) * planned.motion.dt)
    with counter(progress, "performance") as count:
        done = performance.perform(who, planned, machine, how, count or (lambda step, total: None))
    runs = done.runs(how.seed)
    summary = Summary(
        robot=machine.description.name,
        tracker=who.description.name,
        pushes=how.pushes,
        runs=len(runs),
        finished=sum(row["finished"] for row in runs),
        uninterrupted=sum(row["finished"] and not row["given_up"] for row in runs),
        survived_s=float(np.mean([row["survived_s"] for row in runs])),
        danced_share=float(np.mean([row["danced_share"] for row in runs])),
        mpjpe_l_m=float(np.mean([row["mpjpe_l_m"] for row in runs])),
    )
    length, motion = done.recorded(0), planned.motion
    shown = done.step[:length, 0]
    followed = replace(
        motion, qpos=np.asarray(motion.qpos)[shown], certificate=None,
        **{name: np.asarray(getattr(motion, name))[shown] for name in BESIDE},
    )  # fmt: skip
    rollout = Rollout(motion.dt, done.qpos[:length, 0])
    return Performance(planned, summary, done.parts(), runs, rollout, followed)


BESIDE = ("qvel", "body_pos_w", "keypoints_w", "contact", "torque_ratio", "source_time_s")
"""What a motion holds a row a step, beside its poses."""


def _tracker(given: str | Tracker | None, robot: Robot) -> Tracker:
    who = given
    if who is None or isinstance(who, str):
        found = require_tracker(robot.description.name, who)
        if found is None:
            raise BadPolicy("a performance needs a tracker; `none` is for trainings")
        who = load_tracker(found.name)
    if who.description.root_state == "estimated":
        raise BadPolicy(
            f"tracker {who.description.name!r} estimates its place along one motion alone; "
            "a performance needs another, such as regulator"
        )
    return who


def _several(dances: Dance | Sequence[Dance]) -> Sequence[Dance]:
    """Return one dance or several as a list."""
    return [dances] if isinstance(dances, ONE) else dances


def _motion(
    dance: Dance, number: int, robot: Robot, config: RetargetConfig
) -> tuple[str, ReferenceMotion]:
    """Return name and reference motion of a dance."""
    if isinstance(dance, SmplSequence | ReferenceMotion):
        name, found = f"dance {number + 1}", dance
    else:
        path = Path(dance)
        name = path.absolute().parent.name if path.stem == "smpl" else motion_name(path)
        is_video = path.suffix.lower() in SUFFIXES
        found = recover_motion(path) if is_video else read_motion(path)
    if isinstance(found, SmplSequence):
        found = retarget_motion(found, robot, config=config)
    require_robot(found, robot)
    return name, found
