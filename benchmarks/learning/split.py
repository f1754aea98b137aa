"""The split of motions: what may be trained on, what is evaluated, and how near they are.

    python -m benchmarks.learning.split FOLDER

prints, for every evaluated motion of a folder of SMPL motions (`NAME.parquet`), which ones contain
it. `split.yaml` holds the lists.
"""

import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from benchmarks.learning.motion_distance import contained_share, windows
from robojackson.motion.smpl_sequence import SmplSequence

FILE = Path(__file__).with_suffix(".yaml")
DUPLICATE_SHARE = 0.5
"""Share of an evaluated motion's windows from which on a motion that contains them is left out."""
WORTH_TELLING = 0.1


@dataclass(frozen=True)
class Split:
    """The lists of `split.yaml`.

    Attributes:
        held_out: Motions that no training, pretraining or tuning may see.
        train: Motions that trainings may see.
        excluded: Near-duplicates of evaluated ones, with the motion and the share of it.
        exceptions: What sees a motion that it may not, with these motions and those on which
            nothing is claimed of it therefore.
        references: sha256 of the poses of frozen references, by row.
    """

    held_out: tuple[str, ...]
    train: tuple[str, ...]
    excluded: Mapping[str, Mapping[str, Any]]
    exceptions: Mapping[str, Mapping[str, list[str]]]
    references: Mapping[str, str]

    def require_trainable(self, names: Iterable[str]) -> None:
        """Refuse motions that are not for training.

        Raises:
            ValueError: with the motions and where they stand.
        """
        bad = [name for name in names if name not in self.train]
        if bad:
            raise ValueError(
                f"not for training: {', '.join(bad)}; {FILE.name} lists as train: "
                f"{', '.join(self.train)}"
            )


def load_split(path: Path = FILE) -> Split:
    """Read the split."""
    result = yaml.safe_load(path.read_text())
    return Split(
        held_out=tuple(result["held_out"]),
        train=tuple(result["train"]),
        excluded=result["excluded"],
        exceptions=result["exceptions"],
        references=result["references"],
    )


def shares(motions: Mapping[str, SmplSequence], held_out: Iterable[str]) -> list[dict[str, Any]]:
    """Return, for every evaluated motion, the others that contain some of it, plain or mirrored."""
    plain = {name: windows(motion) for name, motion in motions.items()}
    mirrored = {name: windows(motion, mirrored=True) for name, motion in motions.items()}
    rows = []
    for name in held_out:
        for other in motions:
            if name == other or name not in motions:
                continue
            share = max(
                contained_share(plain[name], plain[other]),
                contained_share(plain[name], mirrored[other]),
            )
            rows.append({"held_out": name, "motion": other, "share": share})
    return rows


def main() -> None:
    """Print what contains the evaluated motions."""
    folder = Path(sys.argv[1])
    motions = {path.stem: SmplSequence.load(path) for path in sorted(folder.glob("*.parquet"))}
    for row in shares(motions, load_split().held_out):
        if row["share"] >= WORTH_TELLING:
            mark = "  near-duplicate" if row["share"] >= DUPLICATE_SHARE else ""
            print(f"{row['held_out']:>14} in {row['motion']:<14} {row['share']:.2f}{mark}")


if __name__ == "__main__":
    main()
