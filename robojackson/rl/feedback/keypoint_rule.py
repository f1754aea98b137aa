"""The part of a robot's strict rule that concerns its keypoints, as a path is searched; metres."""

import numpy as np
from jaxtyping import Bool, Float

from robojackson.metrics.rollout_score import heading_frame, site_error
from robojackson.rl.feedback.standing_feet import Sites
from robojackson.robot.model import Robot
from robojackson.robot.names import FEET, HANDS, PELVIS


class KeypointRule:
    """`StrictRule.sites` and `StrictRule.ends` of a robot, as in `evaluation.strict_success`.

    Args:
        share: Share of the limits that is allowed.
    """

    def __init__(self, robot: Robot, share: float = 1.0) -> None:
        names, self._rule, self._share = robot.keypoint_names, robot.description.strict, share
        self._sites, self._pelvis = Sites(robot, robot.keypoint_sites), names.index(PELVIS)
        self._ends = [names.index(name) for name in (*FEET, *HANDS)]

    def points(self, qpos: Float[np.ndarray, "N nq"]) -> Float[np.ndarray, "N K 3"]:
        """Return the keypoints of robots in poses, world."""
        return self._sites.at(qpos)

    def keeps(
        self,
        qpos: Float[np.ndarray, "N nq"],
        aimed: Float[np.ndarray, "*N nq"],
        aimed_points: Float[np.ndarray, "*N K 3"],
    ) -> Bool[np.ndarray, " N"]:
        """Return which robots keep the rule beside poses of their motion."""
        points = self.points(qpos)
        here = heading_frame(points, qpos[:, 3:7], self._pelvis)
        there = heading_frame(aimed_points, aimed[..., 3:7], self._pelvis)
        result: np.ndarray = site_error(here, there) <= self._share * self._rule.sites
        if self._rule.ends is not None:
            off = np.abs(points - aimed_points)[:, self._ends, 2].max(1)
            result &= off <= self._share * self._rule.ends
        return result
