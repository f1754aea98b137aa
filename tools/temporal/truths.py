"""Motions without pictures: many more than can be rendered, filmed again in every batch."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from benchmarks.mocap.figures import true_contacts
from benchmarks.mocap.truth import soles
from robojackson.mocap.landmarks.blazepose import LANDMARK_NAMES
from robojackson.mocap.temporal import features
from robojackson.mocap.temporal.features import INPUT_LANDMARKS
from tools.temporal.examples import VALIDATION_MOTIONS, body_size

PEOPLE = 80
FRAMES = 150


@dataclass(frozen=True)
class Bank:
    """Motions of bodies of size one (`body_size`), world z up.

    Attributes:
        points: The landmarks that the network reads.
        lengths: Frames of each motion; the last frame is held up to `FRAMES`.
        contact: States of the foot points.
    """

    points: torch.Tensor
    lengths: torch.Tensor
    contact: torch.Tensor

    def __len__(self) -> int:
        return len(self.points)

    def on(self, device: torch.device | str) -> "Bank":
        """Return the bank on a device."""
        return Bank(self.points.to(device), self.lengths.to(device), self.contact.to(device))


def make(folders: list[Path], count: int, seed: int) -> Bank:
    """Return a number of motions of people of all shapes: captured, changed or invented."""
    from tools.pairs import people, sources
    from tools.pairs.clips import choose_motion
    from tools.render import deepmimic
    from tools.render.anny_body import Body

    rng = np.random.default_rng([seed, count])
    files = [
        path for path in sources.find(folders)
        if sources.motion_name(path) not in VALIDATION_MOTIONS
    ]  # fmt: skip
    body, cache = Body(), dict[Path, deepmimic.Motion]()
    crowd = [people.draw_person(body, rng) for _ in range(PEOPLE)]
    points = np.zeros((count, FRAMES, len(INPUT_LANDMARKS), 3), np.float32)
    lengths, contact = np.zeros(count, int), np.zeros((count, FRAMES, 4), np.int8)
    for row in range(count):
        person = crowd[rng.integers(PEOPLE)]
        posed = person.posed(choose_motion(files, cache, rng)[1])
        marks = person.landmarks(posed, LANDMARK_NAMES)[:FRAMES]
        marks = marks[:, INPUT_LANDMARKS] / body_size(marks)
        lengths[row] = len(marks)
        index = np.minimum(np.arange(FRAMES), len(marks) - 1)
        points[row] = marks[index]
        feet = soles(posed.heads[:FRAMES], person.body.bone_names)
        contact[row] = true_contacts(feet, features.FPS)[index]
    return Bank(*map(torch.from_numpy, (points, lengths, contact)))


def kept(path: Path, folders: list[Path], count: int, seed: int) -> Bank:
    """Return the bank of a file, made if it is not there."""
    if not path.exists():
        bank = make(folders, count, seed)
        np.savez(
            path, points=bank.points.numpy(), lengths=bank.lengths.numpy(),
            contact=bank.contact.numpy(),
        )  # fmt: skip
    with np.load(path) as data:
        names = ("points", "lengths", "contact")
        return Bank(*(torch.from_numpy(data[name]) for name in names))
