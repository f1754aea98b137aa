"""The cost of assessing a clip, as ratios within one run (`make bench`; results/search.json).

1. Algorithm 1 through our code over a bare loop of decode + PoseLandmarker lite: at most 1.1.
2. The same with every filter: at most 1.35.
3. A batch of 8 clips on two idle cores over the same batch on one: at least 1.7 times as fast.

The first two run on one core; the ways take turns, clip by clip, and each keeps its best of several
rounds, so that a busy machine hits all alike. The bare loop is written here, with no code of ours.
"""

import argparse
import json
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

RESULTS = Path(__file__).parents[1] / "results" / "search.json"
CLIPS = Path(__file__).parents[2] / "clips"
NAMES = ("hip_shake", "dance_a", "dance_b", "walk", "person_cam1")
BATCH = ("hip_shake", "dance_a", "dance_b", "walk") * 2


def bare(path: Path) -> int:
    """Decode and detect, and nothing else."""
    import av
    import mediapipe
    from mediapipe.tasks import python as tasks
    from mediapipe.tasks.python import vision

    model = Path(__file__).parents[2] / "robojackson/assets/pose_landmarker_lite.task"
    options = vision.PoseLandmarkerOptions(
        base_options=tasks.BaseOptions(model_asset_path=str(model)),
        running_mode=vision.RunningMode.VIDEO,
    )
    count = 0
    with vision.PoseLandmarker.create_from_options(options) as landmarker, av.open(path) as file:
        file.streams.video[0].thread_type = "NONE"
        for count, frame in enumerate(file.decode(video=0), 1):
            image = np.ascontiguousarray(frame.to_ndarray(format="rgb24"))
            picture = mediapipe.Image(image_format=mediapipe.ImageFormat.SRGB, data=image)
            landmarker.detect_for_video(picture, count * 33)
    return count


def scored(path: Path) -> float:
    """Return Algorithm 1."""
    from robojackson.clips.pose_detector import detect
    from robojackson.clips.quality.stability import StabilityConfig, stability
    from robojackson.clips.video import VideoLimits, probe

    track = detect(path, probe(path, VideoLimits()), "lite")
    return stability(track, StabilityConfig()).stability_score


def assessed(path: Path) -> float:
    """Return Algorithm 1 and every filter."""
    from robojackson.clips.quality.assessment import AssessmentConfig, assess_video

    return assess_video(path, AssessmentConfig()).stability.stability_score


WAYS: dict[str, Callable[[Path], float]] = {"bare": bare, "scored": scored, "assessed": assessed}


def seconds(way: Callable[[Path], float], path: Path) -> float:
    """Return CPU seconds of this process, which a neighbour's work does not lengthen much."""
    began = time.process_time()
    way(path)
    return time.process_time() - began


def costs(rounds: int) -> dict[str, dict[str, float]]:
    """Return the best seconds of each way on each clip."""
    paths = [CLIPS / f"{name}.mp4" for name in NAMES]
    best = {path.stem: dict.fromkeys(WAYS, np.inf) for path in paths}
    for way in WAYS.values():
        way(paths[0])
    for _ in range(rounds):
        for path in paths:
            for name, way in WAYS.items():
                best[path.stem][name] = min(best[path.stem][name], seconds(way, path))
    return best


def batch(cores: Sequence[int]) -> float:
    """Return wall seconds of eight clips in one process a core, the loading of the model not
    counted."""
    paths = [CLIPS / f"{name}.mp4" for name in BATCH]
    context = get_context("spawn")
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, cores)
    try:
        with ProcessPoolExecutor(len(cores), context, initializer=_begin) as pool:
            list(pool.map(assessed, paths[: len(cores)] * 2))
            began = time.perf_counter()
            list(pool.map(assessed, paths))
            return time.perf_counter() - began
    finally:
        os.sched_setaffinity(0, before)


def _begin() -> None:
    import cv2

    cv2.setNumThreads(1)


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    every = sorted(os.sched_getaffinity(0))
    two = [min(batch(every[:2]) for _ in range(2)), min(batch(every[:1]) for _ in range(2))]
    os.sched_setaffinity(0, every[:1])
    _begin()
    best = costs(rounds)
    total = {way: sum(clip[way] for clip in best.values()) for way in WAYS}
    found = {
        "scored_over_bare": total["scored"] / total["bare"],
        "assessed_over_bare": total["assessed"] / total["bare"],
        "two_cores_over_one": two[1] / two[0],
        "batch_s": {"two_cores": two[0], "one_core": two[1]},
        "clips": best,
    }
    RESULTS.write_text(json.dumps(found, indent=1) + "\n")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
