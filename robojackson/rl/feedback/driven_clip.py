"""A reference with all that a control law follows: feed-forward, feedback and preview."""

from collections.abc import Sequence

import numpy as np

from robojackson.motion.reference_motion import ReferenceMotion, motions_of
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.feedback.cached_feedback import feedback_of
from robojackson.rl.feedback.nominal_path import Progress, no_progress
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.preview import preview_of
from robojackson.rl.sim.reference_clip import Clip
from robojackson.robot.model import Robot


def driven_clip(
    robot: Robot,
    references: ReferenceMotion | Sequence[ReferenceMotion],
    control: ControlConfig,
    ahead: bool = False,
    progress: Progress = no_progress,
) -> Clip:
    """Return the clip with its feed-forward, its feedback and, if `ahead`, the preview.

    Args:
        progress: Called with a name, the steps that are done, and all, while the feedback is
            computed.
    """
    motions = motions_of(references)
    leads = [lead_of(robot, motion, control) for motion in motions]
    driven = [lead for lead in leads if lead is not None]
    lead = np.concatenate(driven) if driven else None
    seen = np.concatenate([preview_of(motion, robot) for motion in motions]) if ahead else None
    return Clip(motions, lead, seen, feedback_of(robot, motions, control, progress))
