"""The regulator along a path beside a motion, where the motion itself cannot be held."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from robojackson.rl.feedback import path_refinement, path_search, path_trial
from robojackson.rl.feedback.keypoint_rule import KeypointRule
from robojackson.rl.feedback.nominal_path import Gains, Linear, Path, Progress, no_progress
from robojackson.rl.feedback.path_refinement import ROUNDS, refinements
from robojackson.rl.feedback.path_search import RULE_SHARE, PathSearch
from robojackson.rl.feedback.path_trial import AS_MANY, POOR, Held, Trial
from robojackson.rl.feedback.regulator import (
    following,
    linearised,
    reference_path,
    regulator,
    riccati,
)
from robojackson.rl.feedback.standing_feet import LOW_M, Feet
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.model import Robot

PASSES, PASSES_A_S = 6, 2.0
"""Searches at most: so many, and so many for every second of the motion."""
BACK_S, AGAIN_S = 1.2, 0.6
"""How far before a fall a path is kept; how far before that the next search begins."""
STALLS, ADVANCE_S = 3, 0.1
"""Searches in a row at most that do not come so much further; each is broader than the one before
and begins earlier."""
TRIES, TRIED_S, ENOUGH = 6, 45.0, 0.9
"""Searches from the beginning, of which the best is taken: at most so many, and of so long a motion
in all; and none after one that holds so great a share of its starts."""
POOR_TRIES = 4
"""So many at least, however long the motion is, while little is held: what a single search of a
long motion finds is decided by the last digits of sums, which processors round differently."""
EFFORTS = (1.0, 0.5, 0.25)
"""Factors on the cost of the feedback's offsets, of which the smaller ones are stiffer: the first
where it holds nearly all starts, else the second where no other holds clearly more."""
CYCLES_S = 4.0
"""A motion that repeats is simulated for so long at least; the last cycle but one is kept."""


def sampled_regulator(
    robot: Robot,
    sim: Simulation,
    clip: Clip,
    action: Float[np.ndarray, " nu"],
    seed: int = 0,
    progress: Progress = no_progress,
    most_tries: int | None = None,
    most_rounds: int | None = None,
) -> Gains:
    """Return the regulator along a motion, or along a path beside it where that holds it better.

    Where no path to the end is found, the motion itself is the nominal path from there on.

    Args:
        sim: One robot under the control law, without disturbances.
        clip: One motion.
        action: Radians that a full action moves each target.
        seed: Seed of the samples.
        progress: Called with a name, the steps that are done, and all.
        most_tries: Searches from the beginning at most; `TRIES` when None.
        most_rounds: Rounds of refinement at most; `ROUNDS` when None.
    """
    feet, rule = Feet(robot), KeypointRule(robot, RULE_SHARE)
    bare, motion, linear = regulator(sim, clip, action, feet.count, progress)
    trial = Trial(robot, sim, clip, action, motion)
    best = _best_effort(trial, partial(_of_motion, bare, linear, action, clip.cyclic))
    if best.held.strictly >= ENOUGH:
        return best.result
    cycles = max(3, int(np.ceil(CYCLES_S / (clip.steps * clip.dt)))) if clip.cyclic else 1
    reference = reference_path(sim, clip, cycles * clip.steps)
    linear = _repeated(linear, cycles)
    tries = int(np.clip(TRIED_S / (len(reference) * clip.dt), 1, most_tries or TRIES))
    chosen = None
    for number in range(max(tries, min(POOR_TRIES, most_tries or TRIES))):
        if number >= tries and best.held.strictly >= POOR:
            break
        rng = np.random.default_rng([seed, number])
        search = PathSearch(sim, action, feet, rule, reference, rng)
        path, along, ended = _searched(search, sim, reference, linear, action, clip.dt, progress)
        nominal = _followed(sim, clip, path, along)
        now = _best_effort(trial, partial(_gains, clip, action, feet, *nominal, reference))
        if now.held.beats(best.held):
            best, chosen = now, (path, along) if ended else None
        if best.held.strictly >= ENOUGH:
            break
    most, ends = best.held.strictly, best.held.to_end
    for number, (path, along) in enumerate(
        refinements(sim, *chosen, reference, action, most_rounds) if chosen else ()
    ):
        progress("refined path", number + 1, ROUNDS)
        nominal = _followed(sim, clip, path, along)
        found = _gains(clip, action, feet, *nominal, reference, best.effort)
        held = trial.held(found)
        least = most - AS_MANY if most < ENOUGH else max(ENOUGH, most - AS_MANY)
        if held.strictly >= least and (most >= POOR or held.to_end >= ends - AS_MANY):
            best, most = _Tried(found, held, best.effort), max(most, held.strictly)
    return best.result


class _Tried(NamedTuple):
    """A regulator, what it holds, and the factor on the cost of its offsets."""

    gains: Gains
    held: Held
    effort: float

    @property
    def result(self) -> Gains:
        """The regulator with the share of the starts that it holds."""
        return replace(self.gains, held=np.array([self.held.strictly]))


def _best_effort(trial: Trial, gains_of: Callable[[float], Gains]) -> _Tried:
    """Return the regulator of the effort that holds most (`EFFORTS`)."""

    def tried(effort: float) -> _Tried:
        gains = gains_of(effort)
        return _Tried(gains, trial.held(gains), effort)

    usual, stiffer = tried(EFFORTS[0]), EFFORTS[1:]
    if usual.held.strictly >= 1 - AS_MANY or not stiffer:
        return usual
    best = tried(stiffer[0])
    if best.held.strictly == usual.held.strictly == 0.0:
        return usual
    for other in (usual, *map(tried, stiffer[1:])):
        if other.held.strictly > best.held.strictly + AS_MANY:
            best = other
    return best


def _of_motion(
    bare: Gains, linear: Linear, action: np.ndarray, cyclic: bool, effort: float
) -> Gains:
    """Return the regulator along the motion itself at an effort."""
    law = riccati(linear, action, cyclic, effort=effort)
    return Gains(law.gain, law.offset, bare.qpos, bare.qvel, bare.places)


def _searched(
    search: PathSearch,
    sim: Simulation,
    path: Path,
    linear: Linear,
    action: np.ndarray,
    dt: float,
    progress: Progress,
) -> tuple[Path, Linear, bool]:
    """Return a path that was searched from a motion's, the system along it, and whether a robot
    goes along it to the end."""
    begin, furthest, stalls = 0, 0, 0
    for _ in range(PASSES + round(PASSES_A_S * len(path) * dt)):
        law = riccati(linear, action, False)
        found, ended = search.run(path, law, begin, 1 + stalls, progress)
        end = begin + len(found) - 1
        stalls = 0 if end > furthest + ADVANCE_S / dt else stalls + 1
        furthest = max(furthest, end)
        back = round((1 + stalls / 2) * BACK_S / dt)
        kept = end + 1 if ended else max(0, end - back)
        first, last = min(begin, kept), max(begin, kept)
        path = search.joined(path, found, first, kept)
        linear = _with(linear, np.arange(first, min(last + 1, len(path))), sim, path)
        if ended or stalls > STALLS:
            break
        begin = max(0, kept - round(AGAIN_S / dt))
    return path, linear, ended


def _repeated(linear: Linear, cycles: int) -> Linear:
    parts = (linear.by_state, linear.by_target, linear.defect)
    return Linear(*(np.tile(part, (cycles,) + (1,) * (part.ndim - 1)) for part in parts))


def _with(linear: Linear, rows: Int[np.ndarray, " R"], sim: Simulation, path: Path) -> Linear:
    """Return the system along a path that has changed at some steps, which follow each other."""
    after = np.minimum(rows + 1, len(path) - 1)
    part = Path(path.qpos[rows], path.qvel[rows], path.targets[rows])
    new = linearised(sim, part, (path.qpos[after], path.qvel[after]))
    whole = Linear(linear.by_state.copy(), linear.by_target.copy(), linear.defect.copy())
    for name in ("by_state", "by_target", "defect"):
        getattr(whole, name)[rows] = getattr(new, name)
    return whole


def _followed(sim: Simulation, clip: Clip, path: Path, linear: Linear) -> tuple[Path, Linear]:
    """Return the part of a path that is followed, and the system along it: of a motion that
    repeats, the last cycle but one."""
    if not clip.cyclic:
        return path, linear
    first = len(path) - 2 * clip.steps
    rows = slice(first, first + clip.steps)
    qpos = path.qpos[rows].copy()
    qpos[:, :3] -= clip.at(np.array([first])).qpos[0, :3] - clip.at(np.array([0])).qpos[0, :3]
    cycle = Path(qpos, path.qvel[rows], path.targets[rows])
    return cycle, linearised(sim, cycle, following(cycle, clip))


def _gains(
    clip: Clip,
    action: np.ndarray,
    feet: Feet,
    path: Path,
    linear: Linear,
    reference: Path,
    effort: float,
) -> Gains:
    """Return the regulator along a path at an effort."""
    law = riccati(linear, action, clip.cyclic, effort=effort)
    lead = path.targets - reference.targets[: len(path)]
    places = feet.places(path.qpos)
    return Gains(law.gain, law.offset - lead, path.qpos, path.qvel, places)


def settings() -> list[float]:
    """Return the numbers that decide what is found."""
    return [
        PASSES,
        PASSES_A_S,
        BACK_S,
        STALLS,
        ADVANCE_S,
        AGAIN_S,
        CYCLES_S,
        ENOUGH,
        AS_MANY,
        TRIES,
        TRIED_S,
        POOR,
        POOR_TRIES,
        *EFFORTS,
        LOW_M,
        *path_search.settings(),
        *path_refinement.settings(),
        *path_trial.settings(),
    ]
