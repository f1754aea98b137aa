"""Plan a performance: stand, dance, next dance, stand, as one motion with a certificate.

Every dance begins where the one before has left the robot, facing as it does. Metres, seconds.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.errors import RejectedReference
from robojackson.motion.floor_move import FloorMove
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import PLANTED
from robojackson.retarget.feasibility.certification import certify
from robojackson.retarget.performance.ways import Piece, standing_dance, way
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.scorecard_gate import BARS
from robojackson.robot.fall import standing_height
from robojackson.robot.model import Robot
from robojackson.robot.resampling import velocities
from robojackson.robot.tree_kinematics import continuous, pose, tree

STAND, WAY = "stand", "way"


@config_dataclass
class ProgrammeConfig:
    """How dances are joined.

    Attributes:
        dance_s: How long a dance that repeats goes on, seconds; at least one cycle.
        stand_s: Stand before the first dance and after the last one, seconds.
    """

    dance_s: float = Field(default=8.0, gt=0)
    stand_s: float = Field(default=2.0, gt=0)


@dataclass(frozen=True)
class Part:
    """A part of a programme.

    Attributes:
        name: Name of the dance; `stand`, or `way` from one dance to another.
        start, end: Its steps, [start, end).
        danced: The steps among them that show the dance: the others lead into and out of it.
        infeasible_share: Share of its steps that the certificate refuses.
    """

    name: str
    start: int
    end: int
    danced: tuple[int, int]
    infeasible_share: float

    @property
    def is_dance(self) -> bool:
        """Whether it shows a dance."""
        return self.danced[1] > self.danced[0]


@dataclass(frozen=True)
class Programme:
    """A performance as it is planned.

    Attributes:
        motion: All parts as one motion, in the frame of the first stand.
        parts: In order.
    """

    motion: ReferenceMotion
    parts: tuple[Part, ...]


def plan(
    dances: Sequence[tuple[str, ReferenceMotion]],
    robot: Robot,
    config: ProgrammeConfig,
    retarget: RetargetConfig,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Programme:
    """Join dances: stand, way into the first one, dances with ways between them, way, stand.

    Args:
        dances: Names and motions, of one robot.

    Raises:
        RejectedReference: no dance, another robot's motion, or a way that the robot cannot do.
    """
    if not dances:
        raise RejectedReference("a performance needs at least one dance")
    dt, stand = dances[0][1].dt, stand_of(robot)
    pieces: list[tuple[str, Piece]] = [(STAND, _still(stand, robot, config.stand_s, dt))]
    for done, (name, motion) in enumerate(dances):
        progress(done, len(dances) + 1)
        piece = standing_dance(motion, robot, retarget, config.dance_s)
        _append(pieces, name, piece, robot, retarget, dt)
    progress(len(dances), len(dances) + 1)
    _append(pieces, STAND, _still(stand, robot, config.stand_s, dt), robot, retarget, dt)
    return _joined(pieces, robot, retarget, dt)


def stand_of(robot: Robot) -> Float[np.ndarray, " nq"]:
    """Return the robot's own stand on the floor, facing +x at the origin."""
    qpos = robot.standing.copy()
    qpos[:2], qpos[2] = 0.0, standing_height(robot)
    return np.asarray(qpos)


def _append(
    pieces: list[tuple[str, Piece]],
    name: str,
    piece: Piece,
    robot: Robot,
    retarget: RetargetConfig,
    dt: float,
) -> None:
    """Put a piece where the last one ended, the way into its first stand before it."""
    last = pieces[-1][1].qpos[-1]
    ankles = [robot.keypoint_names.index(f"{side}_foot") for side in ("left", "right")]
    move = FloorMove.onto(piece.qpos[:1], last[None])
    points = pose(tree(robot), np.stack([last, move.qpos(piece.qpos[:1])[0]])).site_pos
    apart = points[0, ankles, :2].mean(0) - points[1, ankles, :2].mean(0)
    placed = piece.moved(FloorMove(move.turn, move.shift + apart))
    pieces.append((WAY, way(last, placed.qpos[0], robot, retarget, dt)))
    pieces.append((name, placed))


def _still(stand: Float[np.ndarray, " nq"], robot: Robot, seconds: float, dt: float) -> Piece:
    count = max(2, round(seconds / dt))
    contact = np.full((count, len(robot.contact_names)), PLANTED, np.int8)
    return Piece(np.repeat(stand[None], count, 0), contact)


def _joined(
    pieces: Sequence[tuple[str, Piece]], robot: Robot, retarget: RetargetConfig, dt: float
) -> Programme:
    qpos = continuous(np.concatenate([piece.qpos for _, piece in pieces]))
    posed = pose(tree(robot), qpos)
    certified = certify(robot, qpos, dt, None, retarget.weights.tolerance)
    slack, parts, first = certified.certificate.slack, [], 0
    for name, piece in pieces:
        past = first + len(piece.qpos)
        danced = (first + piece.danced[0], first + piece.danced[1])
        share = float((slack[first:past] > 1.0).mean())
        parts.append(Part(name, first, past, danced, share))
        first = past
    _require_ways(parts, dt)
    motion = ReferenceMotion(
        robot=robot.description.name,
        model_sha256=robot.sha256,
        dt=dt,
        cyclic=False,
        cycle_offset=np.zeros(3),
        qpos=qpos,
        qvel=velocities(qpos, dt, None),
        body_pos_w=posed.body_pos[:, 1:],
        keypoints_w=posed.site_pos,
        contact=np.concatenate([piece.contact for _, piece in pieces]),
        torque_ratio=certified.torque_ratio,
        source_time_s=np.arange(len(qpos)) * dt,
        certificate=certified.certificate,
        joint_names=robot.joint_names,
        body_names=robot.body_names,
        keypoint_names=robot.keypoint_names,
        contact_names=robot.contact_names,
        scorecard={"infeasible_share": float((slack > 1.0).mean()), "seconds": len(qpos) * dt},
        robot_file=robot.description.file,
    )
    return Programme(motion, tuple(parts))


def _require_ways(parts: Sequence[Part], dt: float) -> None:
    """Refuse ways that the robot cannot do.

    Raises:
        RejectedReference: more of a way's steps are infeasible than the gate lets through.
    """
    for i, part in enumerate(parts):
        if part.name == WAY and part.infeasible_share > BARS["infeasible_share"]:
            before, after = parts[i - 1].name, parts[i + 1].name
            raise RejectedReference(
                f"the way from {before} to {after} is infeasible for "
                f"{100 * part.infeasible_share:.0f} % of its {(part.end - part.start) * dt:.1f} s",
                "change the order of the dances, or leave one out",
            )
