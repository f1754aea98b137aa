"""Motions without pictures: many more truths than can be rendered, for the invented detector."""

from pathlib import Path

import numpy as np

from robojackson.mocap.landmarks.blazepose import LANDMARK_NAMES
from robojackson.mocap.landmarks.pinhole_camera import guess_focal
from robojackson.mocap.temporal.features import INPUT_LANDMARKS
from tools.pairs import people, scenery, sources
from tools.pairs.clips import choose_motion
from tools.render import deepmimic
from tools.render.anny_body import Body
from tools.temporal.examples import VALIDATION_MOTIONS, Truth, along_rays

PEOPLE = 60
NEAREST_M = 1.0


def make(folders: list[Path], count: int, seed: int) -> list[Truth]:
    """Return so many clips: landmarks along the rays, distance, and the guessed focal over the
    true."""
    rng = np.random.default_rng([seed, count])
    files = [
        path for path in sources.find(folders)
        if sources.motion_name(path) not in VALIDATION_MOTIONS
    ]  # fmt: skip
    body, cache = Body(), dict[Path, deepmimic.Motion]()
    crowd = [people.draw_person(body, rng) for _ in range(PEOPLE)]
    made: list[Truth] = []
    while len(made) < count:
        person = crowd[rng.integers(PEOPLE)]
        posed = person.posed(choose_motion(files, cache, rng)[1])
        view = scenery.film(posed, rng)
        truth, distance = along_rays(view.see(person.landmarks(posed, LANDMARK_NAMES)))
        if distance.min() < NEAREST_M or not np.isfinite(truth[:, INPUT_LANDMARKS]).all():
            continue
        wrong = guess_focal(view.width, view.height) / view.focal
        made.append((np.nan_to_num(truth).astype(np.float32), distance, wrong))
    return made
