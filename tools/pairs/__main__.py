"""Make training pairs: people rendered and seen by BlazePose, the truth beside what it saw.

    python -m tools.pairs FOLDER... -o pairs --clips 900 --seed 1

FOLDERs hold the motion files of `tools/pairs/sources.py` (others are passed over). One npz a clip;
clips that are there already are kept, so the command resumes. Every clip depends only on the seed,
its number and the motions. Needs `tools/requirements.txt`.
"""

import argparse
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("LP_NUM_THREADS", "1")

import cv2
import numpy as np
import torch
from rich.console import Console

from tools.pairs import scenery, sources
from tools.pairs.clips import make_clip
from tools.render import deepmimic
from tools.render.anny_body import Body


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--clips", type=int, default=900)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    console = Console(stderr=True)
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    files = sources.find(options.folders)
    console.print("motions:", ", ".join(sources.motion_name(f) for f in files))
    options.out.mkdir(parents=True, exist_ok=True)
    body, cache = Body(), dict[Path, deepmimic.Motion]()
    studio = scenery.Studio(body.triangles, len(body.rest_vertices))
    started, frames = time.process_time(), 0
    for number in range(options.clips):
        path = options.out / f"{options.seed}_{number:05d}.npz"
        if path.exists():
            continue
        clip = make_clip(number, options.seed, body, studio, files, cache)
        np.savez(path.with_suffix(".tmp.npz"), **clip)
        path.with_suffix(".tmp.npz").rename(path)
        frames += len(clip["seen"])
        rate = frames / (time.process_time() - started)
        found = np.isfinite(clip["seen"][:, 0, 0]).mean()
        console.print(
            f"{number + 1}/{options.clips} {clip['motion']} {len(clip['seen'])} frames, "
            f"found {found:.0%}, {rate:.0f} frames a CPU second"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
