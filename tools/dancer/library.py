"""Motions that the dancer learns: captured ones of the split's training list, and invented dances.

    python -m tools.dancer.library CAPTURED OUT [--robot g1] [--invented 120] [--slow] [--part 0/2]

CAPTURED holds BVH files of CMU's subject 5 (`05_01.bvh.gz`) and DeepMimic files
(`humanoid3d_jog.txt.gz`); what `benchmarks/learning/split.yaml` does not list for training is
refused or passed over. OUT gets one reference motion each, and with `--slow` a slower one of each
BVH file, too; those that are there stay.
"""

import argparse
import gzip
import re
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from benchmarks.learning.split import load_split
from robojackson import load_robot, read_motion
from robojackson.errors import RoboJacksonError
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.retarget.retarget_config import RepairConfig, RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.retarget.targets.tails import TailConfig
from robojackson.robot.model import Robot
from tools.dancer.smpl_motion import smpl_sequence
from tools.pairs import gestures, sources

FPS, SECONDS = 30.0, 8.0
INVENTED = "invented_"
"""How the name of an invented dance begins."""
SLOW, SLOW_TEMPO = "_slow", 0.75
"""How the name of a slower copy ends; its tempo."""
PART = re.compile(rf"(_\d|{SLOW})$")
"""The end of the name of a part of one of DeepMimic's motions, or of a slower copy."""
TAILED = 3
"""Every third invented dance begins and ends standing; captured dances do."""
MOST_INFEASIBLE = 0.25
"""Share of steps that a robot cannot do; motions beyond it are left out."""
Tempos = tuple[Literal["auto"] | float, ...]
TEMPOS: Tempos = ("auto", 0.7)
"""Tried in turn."""
Maker = Callable[[], SmplSequence]


def sequences(folder: Path, invented: int) -> Iterator[tuple[str, Maker, bool]]:
    """Yield name, motion and whether it gets tails."""
    for name in load_split().train:
        path = folder / f"{name.removeprefix('cmu_')}.bvh.gz"
        if path.is_file():
            yield name, partial(_bvh, path), True
    for path in sorted(folder.glob("humanoid3d_*.txt.gz")):
        if (name := sources.motion_name(path)) in load_split().train:
            motion = sources.read(path, FPS)
            count = round(FPS * SECONDS)
            for part in range(max(1, min(2, len(motion) // count))):
                cut = sources.window(motion, part * count, min(count, len(motion)))
                yield f"{name}_{part}", partial(smpl_sequence, cut), False
    for seed in range(invented):
        rng = np.random.default_rng([seed, 24])
        dance = gestures.invent(rng, round(FPS * SECONDS), FPS)
        yield f"{INVENTED}{seed:03}", partial(smpl_sequence, dance), seed % TAILED == 0


def source_of(name: str) -> str | None:
    """Return the captured motion that a reference is of; none for an invented dance."""
    return None if name.startswith(INVENTED) else PART.sub("", name)


def make(
    name: str, maker: Maker, tails: bool, robot: Robot, out: Path, tempos: Tempos = TEMPOS
) -> str:
    """Retarget one motion; return a line about it."""
    path = out / f"{name}.parquet"
    if path.is_file():
        return f"{name}: there already"
    captured = name.removesuffix(SLOW) in load_split().train
    sequence, repair = maker(), RepairConfig(target_share=0.95 if captured else 0)
    for tempo in tempos:
        config = RetargetConfig(
            tails=TailConfig(use="yes" if tails else "no"), repair=repair, tempo=tempo
        )
        try:
            reference = retarget_motion(sequence, robot, config)
        except RoboJacksonError as error:
            return f"{name}: {error}"
        bad = reference.scorecard["infeasible_share"]
        if bad <= MOST_INFEASIBLE:
            reference.save(path)
            return f"{name}: {reference!r} infeasible {bad:.2f}"
    return f"{name}: left out, infeasible {bad:.2f} at tempo {tempo}"


def _bvh(path: Path) -> SmplSequence:
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / path.name.removesuffix(".gz")
        plain.write_bytes(gzip.decompress(path.read_bytes()))
        motion = read_motion(plain)
    assert isinstance(motion, SmplSequence)
    return motion


def main() -> None:
    """Make what is missing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("captured", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--robot", default="g1")
    parser.add_argument("--invented", type=int, default=120)
    parser.add_argument("--slow", action="store_true", help="BVH files at .75 of their tempo, too")
    parser.add_argument("--part", default="0/1", help="i/n: every n-th motion from the i-th")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    robot = load_robot(given.robot)
    first, step = map(int, given.part.split("/"))
    for i, (name, maker, tails) in enumerate(sequences(given.captured, given.invented)):
        if i % step == first:
            print(make(name, maker, tails, robot, given.out), flush=True)
            if given.slow and name in load_split().train:
                slow = make(name + SLOW, maker, tails, robot, given.out, (SLOW_TEMPO,))
                print(slow, flush=True)


if __name__ == "__main__":
    main()
