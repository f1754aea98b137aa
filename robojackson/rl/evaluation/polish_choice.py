"""Whether a policy dances better than the feedback alone that it was trained on.

A polish of a few minutes may undo at one place of a motion what the feedback holds: of dance_b,
after 250,000 steps, two of five seeds held 75 and 73 % of the starts, the feedback alone 88 %. Or
it may hold as many and follow less closely (`docs/learning_g1.md`).
"""

import json
import logging
from dataclasses import dataclass, replace

import numpy as np

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.evaluate_config import REGULATOR, TRAINED
from robojackson.rl.config.train_config import EvaluateConfig
from robojackson.rl.evaluation.controllers import drivers
from robojackson.rl.evaluation.rollout_records import RolloutScorer
from robojackson.rl.evaluation.rollouts import roll_out
from robojackson.rl.evaluation.starts import starts_of, summarise
from robojackson.rl.policy import Policy
from robojackson.rl.sim.reference_clip import Clip
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot

log = logging.getLogger(__name__)

BESIDE = "beside_feedback"
"""Name, in a policy's file, of how well the two dance."""
RESETS, SEED = 4, 20_261_127
"""Noisy starts a phase, and the seed of their noise, which no evaluation has by default."""
MARGIN = 0.03
"""Share of the starts, three of 97, by which one of the two must hold more to be taken for that.
Where neither does, the one of greater skill is taken."""


@dataclass(frozen=True)
class Tried:
    """How well one of the two dances: shares of the starts held strictly, and the mean skill, in
    which a fall counts 0; both 0..1."""

    strict: float
    skill: float

    def better_than(self, other: "Tried") -> bool:
        """Return whether it holds clearly more, or about as many with more skill."""
        more = self.strict - other.strict
        return self.skill > other.skill if abs(more) < MARGIN else more > 0


def better_of(
    policy: Policy, reference: ReferenceMotion, robot: Robot, clip: Clip, threads: int
) -> Policy:
    """Return the policy, or one whose actions are zero where the feedback alone dances better; a
    policy without feedback as it is.

    Args:
        policy: What was trained.
        reference: The motion.
        robot: The robot on which it was trained.
        clip: The motion with its feedback.
        threads: Threads that step the simulations.
    """
    policy = replace(policy, facts=json.loads(json.dumps(dict(policy.facts))))  # as a file has them
    config = EvaluateConfig(resets=RESETS, seed=SEED, threads=threads)
    found = drivers(policy, reference, robot, config.seed)
    if REGULATOR not in found:
        return policy
    starts, labels = starts_of(robot, clip, config)
    log.info("trying the policy and the feedback alone from %d starts each", len(labels))
    horizon = clip.horizon(starts.step, config.seconds)
    scorer, fall = RolloutScorer(robot, reference, config), Fall.of(robot)

    def tried(name: str) -> Tried:
        done = roll_out(robot, clip, found[name], starts, horizon, threads, fall)
        rows = [scorer.row(name, label, done, i) for i, label in enumerate(labels)]
        figures = summarise(rows)
        return Tried(figures["strict_success"], figures["skill"])

    trained, alone = tried(TRAINED), tried(REGULATOR)
    beside = {"trained": trained.strict, "feedback": alone.strict}
    skills = {"trained_skill": trained.skill, "feedback_skill": alone.skill}
    known = {name: value for name, value in skills.items() if np.isfinite(value)}  # no statue's
    facts = {**policy.facts, BESIDE: {**beside, **known}}
    if not alone.better_than(trained):
        return replace(policy, facts=facts)
    log.warning(
        "the feedback alone holds %.0f %% of %d starts with skill %.2f, with the policy %.0f %% "
        "with %.2f: the feedback is kept as the policy; train longer to improve it",
        *(100 * alone.strict, len(labels), alone.skill, 100 * trained.strict, trained.skill),
    )
    return replace(_silent(policy), facts=facts)


def _silent(policy: Policy) -> Policy:
    """Return a policy of the same shape whose actions are zero."""
    *others, (weight, bias) = policy.layers
    return replace(policy, layers=(*others, (np.zeros_like(weight), np.zeros_like(bias))))
