"""What robots did in a performance, as rows a run and a part."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from typing_extensions import TypedDict

from robojackson.metrics.joint_position_error import mpjpe
from robojackson.retarget.performance.programme import Part, Programme
from robojackson.rl.evaluation.rollout_records import SITES


class RunRow(TypedDict):
    """What became of a run; metres, seconds."""

    seed: int
    finished: bool
    survived_s: float
    fell_in: str
    given_up: str
    danced_share: float
    carried: int
    mpjpe_l_m: float
    away_m: float


class PartRow(TypedDict):
    """How many runs did a part, and how near they were; metres, seconds."""

    part: str
    is_dance: bool
    seconds: float
    infeasible_share: float
    began: int
    whole: int
    mpjpe_l_m: float | None


class Summary(TypedDict):
    """Counts and means over all runs; metres, seconds."""

    robot: str
    tracker: str
    pushes: float
    runs: int
    finished: int
    uninterrupted: int
    survived_s: float
    danced_share: float
    mpjpe_l_m: float


@dataclass(frozen=True)
class Performance:
    """Records of N robots in a programme, T control steps long.

    Attributes:
        programme: The programme.
        length: Number of steps that each was up, at most T.
        fell: Whether each run fell.
        step: Step of the programme of each after every step.
        waits: Whether each run has abandoned its part and stands.
        qpos: Their states, world; after the end of a run they repeat.
        points: Keypoints, in the frame of the programme, m.
        roots: Positions of the roots likewise, m.
        carried: Number of times that each continued from another place within a part.
        given_up: Names of the parts that each gave up.
    """

    programme: Programme
    length: Int[np.ndarray, " N"]
    fell: Bool[np.ndarray, " N"]
    step: Int[np.ndarray, "T N"]
    waits: Bool[np.ndarray, "T N"]
    qpos: Float[np.ndarray, "T N nq"]
    points: Float[np.ndarray, "T N K 3"]
    roots: Float[np.ndarray, "T N 3"]
    carried: Int[np.ndarray, " N"]
    given_up: tuple[tuple[str, ...], ...]

    def recorded(self, i: int) -> int:
        """Return how many steps of a run there are to show: those it was up, and its fall."""
        return max(1, min(int(self.length[i]) + bool(self.fell[i]), len(self.step)))

    def runs(self, seed: int) -> list[RunRow]:
        """Return a row a run, the first with this seed."""
        return [self._run(i, seed + i) for i in range(len(self.length))]

    def _run(self, i: int, seed: int) -> RunRow:
        parts, length = self.programme.parts, max(1, int(self.length[i]))
        dances = [part for part in parts if part.is_dance]
        danced = sum(self._shown(i, part) for part in dances)
        whole = sum(part.danced[1] - part.danced[0] for part in dances)
        last = self.step[length - 1, i]
        where = next(part.name for part in parts if last < part.end)
        return {
            "seed": seed,
            "finished": not bool(self.fell[i]),
            "survived_s": length * self.programme.motion.dt,
            "fell_in": where if self.fell[i] else "",
            "given_up": " ".join(self.given_up[i]),
            "danced_share": danced / whole,
            "carried": int(self.carried[i]),
            "mpjpe_l_m": self._error(i, ~self.waits[:length, i]),
            "away_m": float(np.linalg.norm(self.qpos[length - 1, i, :2] - self.qpos[0, i, :2])),
        }

    def parts(self) -> list[PartRow]:
        """Return a row a part: how many did it to its end, and how near they were."""
        return [self._part(part) for part in self.programme.parts]

    def _part(self, part: Part) -> PartRow:
        began, whole, errors = 0, 0, []
        for i in range(len(self.length)):
            rows = self._within(i, part)
            began += bool(rows.any())
            if rows.any() and (self.step[: self.length[i], i] >= part.end - 1).any():
                whole += not (self.waits[: len(rows), i] & self._steps_of(i, part)).any()
                errors.append(self._error(i, rows))
        return {
            "part": part.name,
            "is_dance": part.is_dance,
            "seconds": (part.end - part.start) * self.programme.motion.dt,
            "infeasible_share": part.infeasible_share,
            "began": began,
            "whole": whole,
            "mpjpe_l_m": float(np.mean(errors)) if errors else None,
        }

    def _steps_of(self, i: int, part: Part) -> Bool[np.ndarray, " L"]:
        step = self.step[: self.length[i], i]
        result: np.ndarray = (step >= part.start) & (step < part.end)
        return result

    def _within(self, i: int, part: Part) -> Bool[np.ndarray, " L"]:
        """Return the steps at which a run is in a part that it has not abandoned."""
        return np.asarray(self._steps_of(i, part) & ~self.waits[: self.length[i], i])

    def _shown(self, i: int, part: Part) -> int:
        """Return how many steps of a dance a run showed; one that it repeated counts once."""
        step = self.step[: self.length[i], i]
        shows = (step >= part.danced[0]) & (step < part.danced[1])
        return len(np.unique(step[shows & self._within(i, part)]))

    def _error(self, i: int, when: Bool[np.ndarray, " L"]) -> float:
        motion, rows = self.programme.motion, np.flatnonzero(when)
        at = self.step[rows, i]
        own = (self.points[rows, i, :SITES], np.asarray(motion.keypoints_w)[at, :SITES])
        return mpjpe(*own, self.roots[rows, i], motion.qpos[at, :3])
