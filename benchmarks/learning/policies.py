"""The moves of the learning benchmark, their files and their frozen reference motions."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from benchmarks.learning.split import load_split
from robojackson.motion.reference_motion import ReferenceMotion, poses_sha256

ROOT = Path(__file__).parents[2]
PAPER, CMU = "ROBOJACKSON_PAPER", "ROBOJACKSON_CMU"
"""Variables that name the folders of the authors' files and of CMU's BVH files."""
FROZEN = Path(__file__).parent / "references"
"""Reference motions of rows whose motion is ours to keep, `ROW.parquet`."""
HORIZONS_S = (10.0, 20.0)
BLAS, BLAS_FLAG = "SkylakeX", "avx512f"
"""Kernels of OpenBLAS that made the frozen references, and the processor's flag that they need."""


@dataclass(frozen=True)
class Move:
    """A row of the table of policies: what it may cost and what it must show.

    Attributes:
        clip: A video of the repository, or the name of a file in a folder of others'.
        cpu_minutes: Minutes of one core.
        success, worst: Least strict success, of the mean over seeds and of the worst seed (0: no
            bar).
        skill: Least skill.
        cyclic: Whether it is danced for a time; else to its end.
        authors: Whether it is a file of the authors'.
        robot: Name of the robot.
        mpjpe_mm: Largest mpjpe_l, fallen robots counted to the horizon; none for Humanoid-v5.
        cmu: Whether it is a BVH file of CMU.
        same_as: Row whose reference motion it has; its own when empty.
        observation: Inputs of the policy.
        trained: Whether policies are trained on it; else only trackers are measured there.
    """

    clip: str
    cpu_minutes: float
    success: float
    worst: float
    skill: float
    cyclic: bool = True
    authors: bool = False
    robot: str = "humanoid"
    mpjpe_mm: float | None = None
    cmu: bool = False
    same_as: str = ""
    observation: Literal["full", "onboard"] = "full"
    trained: bool = True

    @property
    def horizons_s(self) -> tuple[float, ...]:
        """Seconds that it is evaluated over, a row each."""
        return HORIZONS_S if self.cyclic else HORIZONS_S[:1]

    @property
    def is_foreign(self) -> bool:
        """Whether its file is not of the repository."""
        return self.authors or self.cmu


MOVES = {
    "hip_shake": Move("clips/hip_shake.mp4", 10, 0.95, 0.85, 0.5),
    "walk": Move("clips/walk.mp4", 20, 0.90, 0.80, 0.6),
    "dance_b": Move("clips/dance_b.mp4", 32, 0.85, 0.70, 0.5, cyclic=False),
    "authors_apt1": Move("apt1", 20, 0.85, 0.0, 0.5, cyclic=False, authors=True),
    "authors_walk": Move("walk", 20, 0.85, 0.0, 0.5, cyclic=False, authors=True),
    "g1_hip_shake": Move("clips/hip_shake.mp4", 10, 0.99, 0.95, 0.75, robot="g1", mpjpe_mm=12),
    "g1_walk": Move("clips/walk.mp4", 15, 0.98, 0.93, 0.7, robot="g1", mpjpe_mm=23),
    "g1_dance_b": Move("clips/dance_b.mp4", 15, 0.98, 0.92, 0.72, False, robot="g1", mpjpe_mm=32),
    "g1_walk_recaptured": Move("clips/walk.mp4", 15, 0.98, 0.93, 0.7, robot="g1", mpjpe_mm=23),
    "g1_walk_closed": Move("clips/walk.mp4", 15, 0.98, 0.93, 0.7, robot="g1", mpjpe_mm=23),
    "g1_dance_b_recaptured": Move(
        "clips/dance_b.mp4", 5, 0.98, 0.92, 0.72, False, robot="g1", mpjpe_mm=32
    ),
    "g1_dance_a": Move("clips/dance_a.mp4", 30, 0.88, 0.75, 0.55, False, robot="g1", mpjpe_mm=55),
    "g1_dance_a_loop": Move("clips/dance_a.mp4", 5, 0.88, 0.75, 0.55, robot="g1", mpjpe_mm=55),
    "g1_dance_a_closed": Move("clips/dance_a.mp4", 5, 0.88, 0.75, 0.55, robot="g1", mpjpe_mm=55),
    "g1_authors_apt1": Move("apt1", 15, 0.98, 0.93, 0.58, False, True, robot="g1", mpjpe_mm=12),
    "g1_authors_walk": Move("walk", 15, 0.98, 0.93, 0.68, False, True, robot="g1", mpjpe_mm=24),
    **{
        f"g1_cmu_{take}": Move(take, 25, 0.93, 0.8, 0.6, False, robot="g1", mpjpe_mm=42, cmu=True)
        for take in ("05_02", "05_09", "05_18")
    },
    **{
        f"g1_cmu_{take}_reimported": Move(
            take, 10, 0.93, 0.8, 0.6, False, robot="g1", mpjpe_mm=42, cmu=True
        )
        for take in ("05_09", "05_18")
    },
    **{
        f"g1_person_cam{camera}": Move(
            f"clips/person_cam{camera}.mp4", 15, 0, 0, 0, False, robot="g1", trained=False
        )
        for camera in (1, 2, 3, 4)
    },
}


def onboard(name: str, move: Move) -> Move:
    """Return the row of the same move for a policy that sees a robot's own sensors: twice the time,
    lower bars. Rows of hip_shake, walk and APT1 from before 28 November 2026, evening, had no
    feedback: today `--set track.control.feedback=0`."""
    assert move.mpjpe_mm is not None
    return replace(
        move,
        cpu_minutes=2 * move.cpu_minutes,
        success=0.9,
        worst=0.75,
        skill=round(move.skill - 0.1, 2),
        mpjpe_mm=move.mpjpe_mm + 10,
        same_as=name,
        observation="onboard",
    )


MOVES |= {
    f"{name}_onboard": onboard(name, move)
    for name, move in list(MOVES.items())
    if move.robot == "g1" and move.trained
}
TRAINED = {name: move for name, move in MOVES.items() if move.trained}
"""Rows of the table of policies."""


@dataclass(frozen=True)
class Folders:
    """Folders of a benchmark.

    Attributes:
        work: Motions, checkpoints, policies: not for the repository.
        results: Tables for the repository.
    """

    work: Path
    results: Path

    @staticmethod
    def at(folder: Path | None) -> "Folders":
        """Return the usual ones, or both within one folder."""
        if folder is None:
            return Folders(ROOT / "store" / "bench-learning", Path(__file__).parents[1] / "results")
        return Folders(folder.absolute() / "work", folder.absolute() / "results")

    @property
    def rows(self) -> Path:
        """One Parquet a move, a seed and a horizon."""
        return self.results / "learning"

    def row(self, name: str, seed: int | str, seconds: float, minutes: float | None = None) -> Path:
        """Return the file of a row; one of another budget than the move's own is in no table."""
        suffix = "" if seconds == HORIZONS_S[0] else f"-{seconds:g}s"
        return self.rows / f"{name}{budget(minutes)}-s{seed}{suffix}.parquet"


def budget(minutes: float | None) -> str:
    """Return the CPU minutes that the name of a row gives, where they are not the move's own."""
    return "" if minutes is None else f"-{minutes:g}min"


def command(*words: object, core: int | None = None, blas: str | None = None) -> int:
    """Run one of our commands on one thread; return its exit status.

    Args:
        core: The core that it is pinned to.
        blas: Kernels of OpenBLAS, which it otherwise chooses by the processor.
    """
    line = [sys.executable, "-m", "robojackson", *map(str, words)]
    if core is not None:
        line = ["taskset", "-c", str(core), *line]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    environment |= {"OPENBLAS_CORETYPE": blas} if blas else {}
    return subprocess.run(line, check=False, cwd=ROOT, env=environment).returncode


def must(*words: object, core: int | None = None, blas: str | None = None) -> None:
    """Run a command without which the rest cannot go on."""
    if status := command(*words, core=core, blas=blas):
        raise SystemExit(f"`robojackson {' '.join(map(str, words))}` ended with {status}")


def source_of(move: Move) -> Path | None:
    """Return the file that a move comes from; None where the authors' are not at hand."""
    if not move.is_foreign:
        return ROOT / move.clip
    variable, suffix = (CMU, ".bvh") if move.cmu else (PAPER, ".pt")
    found = Path(os.environ.get(variable, "")) / f"{move.clip}{suffix}"
    return found if variable in os.environ and found.is_file() else None


def reference_of(name: str, folders: Folders) -> Path:
    """Return the motion of a move for the robot, made once; `gate.json` beside it has the
    verdict."""
    move, work = MOVES[name], folders.work / name
    name = move.same_as or name
    reference = work / "reference.parquet"
    if (work / "gate.json").is_file() and reference.is_file():
        require_frozen(name, reference)
        return reference
    frozen = FROZEN / f"{name}.parquet"
    refused = 0
    if frozen.is_file():
        work.mkdir(parents=True, exist_ok=True)
        reference.write_bytes(frozen.read_bytes())
        refused = not load(reference).scorecard.get("passed", 1.0)
    else:
        refused = _made(move, work)
    if not reference.is_file():
        raise SystemExit(f"{name}: no reference motion was made (status {refused})")
    require_frozen(name, reference)
    (work / "gate.json").write_text(json.dumps({"forced": bool(refused)}))
    return reference


def require_frozen(name: str, reference: Path) -> None:
    """Refuse a reference that is not the one that the row was frozen with (`split.yaml`)."""
    frozen_reference = load_split().references.get(name)
    found = poses_sha256(load(reference))
    if frozen_reference is not None and frozen_reference != found:
        raise SystemExit(
            f"{name}: {reference} has the poses {found[:12]}, the row is measured on "
            f"{frozen_reference[:12]}: another mocap or retargeting made it, or a processor "
            f"without {BLAS_FLAG}, which rounds otherwise; freeze it again or use the old one"
        )


def load(reference: Path) -> ReferenceMotion:
    """Return a reference motion."""
    return ReferenceMotion.load(reference)


def _made(move: Move, work: Path) -> int:
    """Make the motion of a move from its source; return the exit status of the gate."""
    source = source_of(move)
    assert source is not None
    blas = frozen_kernels()
    must("import" if move.is_foreign else "mocap", source, "-o", work, blas=blas)
    options = ["--set", "retarget.slower_tempos=[]"]  # as they were frozen
    options += ["--set", "retarget.cyclic=no"] if move.authors else []
    words = ("retarget", work / "smpl.parquet", "-o", work, "--robot", move.robot, *options)
    return command(*words, blas=blas)


def frozen_kernels() -> str | None:
    """Return the kernels of OpenBLAS that the frozen references were made with, where this
    processor runs them: others round differently, and a repair may come out at another tempo."""
    processor = Path("/proc/cpuinfo")
    known = processor.read_text() if processor.is_file() else ""
    return BLAS if BLAS_FLAG in known else None


def forced(name: str, folders: Folders) -> bool:
    """Return whether the gate refused the move's motion, so that it was forced."""
    gate = folders.work / name / "gate.json"
    return gate.is_file() and bool(json.loads(gate.read_text())["forced"])
