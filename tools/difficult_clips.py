"""A folder of clips of which a person knows at once which to dance, made from the bundled ones.

`python -m tools.difficult_clips FOLDER` copies the dancers and the real clip and spoils them in all
the ways in which a search result can be bad: two people, a slideshow, a cartoon, a cut, a shaken
camera, a black picture, a mirrored copy. Seeded: every run writes the same pictures.
"""

import argparse
import shutil
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from itertools import islice
from pathlib import Path

import av
import cv2
import numpy as np

from robojackson.clips.video import VideoLimits, probe, read_frames

CLIPS = Path(__file__).parent.parent / "clips"
DANCERS = ("hip_shake", "dance_a", "dance_b")
REAL = "person_cam1"
SHAKE_PX = 8
SLIDE_S = 0.5
Paint = tuple[int, int, int]
PAPER, INK, SKY, GRASS = (250, 240, 200), (40, 40, 40), (120, 200, 250), (90, 180, 90)
SKIN, SHIRT, TROUSERS = (240, 195, 160), (230, 60, 60), (50, 60, 160)
BONES = (
    ("L_Shoulder", "R_Shoulder"),
    ("L_Hip", "R_Hip"),
    ("L_Shoulder", "L_Elbow"),
    ("L_Elbow", "L_Wrist"),
    ("R_Shoulder", "R_Elbow"),
    ("R_Elbow", "R_Wrist"),
    ("L_Hip", "L_Knee"),
    ("L_Knee", "L_Ankle"),
    ("R_Hip", "R_Knee"),
    ("R_Knee", "R_Ankle"),
)
Images = Iterable[np.ndarray]
Joints = dict[str, np.ndarray]


def make(folder: Path) -> list[Path]:
    """Write all clips; those that are there already stay."""
    folder.mkdir(parents=True, exist_ok=True)
    copied = [_copy(name, folder) for name in (*DANCERS, REAL)]
    return copied + [_written(folder / f"{n}.mp4", images) for n, images in SPOILED.items()]


def two_people() -> Iterator[np.ndarray]:
    """Two dancers side by side in one room."""
    pairs = zip(frames("hip_shake"), frames("dance_a"), strict=False)
    for left, right in islice(pairs, 75):
        quarter = left.shape[1] // 4
        yield np.concatenate([left[:, quarter:-quarter], right[:, quarter:-quarter]], axis=1)


def slideshow() -> Iterator[np.ndarray]:
    """Five pictures, each for less than a second."""
    for name in ("dance_a", "hip_shake", "dance_b", "walk", "dance_a"):
        images = list(frames(name))
        picture = images[len(images) // 2 if name != "dance_a" else 10]
        yield from [picture] * round(SLIDE_S * 30)


def stick_figure() -> Iterator[np.ndarray]:
    """A stick figure that dances the hip shake on paper."""
    yield from (_stick_figure(at) for at in islice(_hip_shake(), 60))


def cartoon() -> Iterator[np.ndarray]:
    """A cartoon character that a pose detector takes for a person, dancing the hip shake."""
    yield from (_character(at) for at in islice(_hip_shake(), 75))


def cut() -> Iterator[np.ndarray]:
    """Two dances glued together."""
    yield from list(frames("dance_a"))[:50]
    yield from list(frames("dance_b"))[-50:]


def shaken() -> Iterator[np.ndarray]:
    """The hip shake, filmed by a hand that jumps 8 px a frame in any direction."""
    rng = np.random.default_rng(8)
    where = np.zeros(2)
    for image in islice(frames("hip_shake"), 75):
        angle = rng.uniform(0, 2 * np.pi)
        where = np.clip(where + SHAKE_PX * np.array([np.cos(angle), np.sin(angle)]), -24, 24)
        shift = np.float32([[1, 0, where[0]], [0, 1, where[1]]])
        size = (image.shape[1], image.shape[0])
        yield cv2.warpAffine(image, shift, size, borderMode=cv2.BORDER_REPLICATE)


def black() -> Iterator[np.ndarray]:
    """Nothing at all."""
    yield from [np.zeros((480, 640, 3), np.uint8)] * 45


def mirrored() -> Iterator[np.ndarray]:
    """The hip shake as somebody else would upload it again."""
    for image in frames("hip_shake"):
        yield cv2.resize(np.ascontiguousarray(image[:, ::-1]), (560, 420))


SPOILED: dict[str, Callable[[], Iterator[np.ndarray]]] = {
    "two_people": two_people,
    "slideshow": slideshow,
    "stick_figure": stick_figure,
    "cartoon": cartoon,
    "cut": cut,
    "shaken": shaken,
    "black": black,
    "mirrored": mirrored,
}


def frames(name: str) -> Iterator[np.ndarray]:
    """The images of a bundled clip."""
    return read_frames(CLIPS / f"{name}.mp4")


def write(path: Path, images: Images, fps: int = 30) -> Path:
    """Images as an H.264 file."""
    with av.open(str(path), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(fps), options={"crf": "20"})
        stream.pix_fmt = "yuv420p"
        for number, image in enumerate(images):
            if number == 0:
                stream.height, stream.width = image.shape[:2]
            picture = av.VideoFrame.from_ndarray(np.ascontiguousarray(image))
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    return path


def _hip_shake() -> Iterator[Joints]:
    """Joints of the hip shake in the image, by name."""
    with np.load(CLIPS / "hip_shake_gt.npz") as truth:
        names, joints = truth["names"].tolist(), truth["joints"].astype(float)
        camera = truth["proj"] @ truth["view"]
    for points in _seen(joints, camera):
        yield dict(zip(names, points, strict=True))


def _seen(joints: np.ndarray, camera: np.ndarray) -> np.ndarray:
    """World points in pixels of a 640x480 image."""
    ones = np.ones((*joints.shape[:-1], 1))
    clip = np.concatenate([joints, ones], -1) @ camera.T
    flat = clip[..., :2] / clip[..., 3:]
    return (flat * [0.5, -0.5] + 0.5) * [640, 480]


def _stick_figure(at: Joints) -> np.ndarray:
    """A head, a trunk and limbs in ink on paper."""
    picture = np.full((480, 640, 3), PAPER, np.uint8)
    neck = (at["L_Shoulder"] + at["R_Shoulder"]) / 2
    hips = (at["L_Hip"] + at["R_Hip"]) / 2
    head = neck + 0.32 * (neck - hips)
    lines = [(at[a], at[b]) for a, b in BONES] + [(neck, hips), (neck, head)]
    for begin, end in lines:
        cv2.line(picture, _pixel(begin), _pixel(end), INK, 7, cv2.LINE_AA)
    cv2.circle(picture, _pixel(head), 26, INK, -1, cv2.LINE_AA)
    return picture


def _character(at: Joints) -> np.ndarray:
    """A face, a shirt and trousers in flat colours with black outlines."""
    picture = np.full((480, 640, 3), SKY, np.uint8)
    picture[330:] = GRASS
    neck, hips = (at["L_Shoulder"] + at["R_Shoulder"]) / 2, (at["L_Hip"] + at["R_Hip"]) / 2
    for side in "LR":
        _limb(picture, at[f"{side}_Hip"], at[f"{side}_Knee"], TROUSERS, 24)
        _limb(picture, at[f"{side}_Knee"], at[f"{side}_Ankle"], TROUSERS, 20)
    trunk = [_pixel(at[name]) for name in ("L_Shoulder", "R_Shoulder", "R_Hip", "L_Hip")]
    cv2.fillPoly(picture, [np.array(trunk)], SHIRT)
    cv2.polylines(picture, [np.array(trunk)], True, SHIRT, 20)
    for side in "LR":
        _limb(picture, at[f"{side}_Shoulder"], at[f"{side}_Elbow"], SHIRT, 18)
        _limb(picture, at[f"{side}_Elbow"], at[f"{side}_Wrist"], SKIN, 14)
        cv2.circle(picture, _pixel(at[f"{side}_Wrist"]), 10, SKIN, -1)
        cv2.ellipse(picture, _pixel(at[f"{side}_Ankle"] + [0, 8]), (14, 8), 0, 0, 360, INK, -1)
    _face(picture, neck + 0.34 * (neck - hips))
    return picture


def _limb(picture: np.ndarray, begin: np.ndarray, end: np.ndarray, paint: Paint, px: int) -> None:
    for colour, width in ((INK, px + 4), (paint, px)):
        cv2.line(picture, _pixel(begin), _pixel(end), colour, width, cv2.LINE_AA)


def _face(picture: np.ndarray, middle: np.ndarray) -> None:
    cv2.circle(picture, _pixel(middle), 26, INK, -1, cv2.LINE_AA)
    cv2.circle(picture, _pixel(middle), 24, SKIN, -1, cv2.LINE_AA)
    for across in (-8, 8):
        cv2.circle(picture, _pixel(middle + [across, -4]), 4, (255, 255, 255), -1)
        cv2.circle(picture, _pixel(middle + [across, -4]), 2, INK, -1)
    cv2.ellipse(picture, _pixel(middle + [0, 8]), (9, 5), 0, 0, 180, SHIRT, 2)
    cv2.ellipse(picture, _pixel(middle - [0, 10]), (24, 16), 0, 180, 360, INK, -1)


def _pixel(point: np.ndarray) -> tuple[int, int]:
    return round(float(point[0])), round(float(point[1]))


def _copy(name: str, folder: Path) -> Path:
    path = folder / f"{name}.mp4"
    if not path.exists():
        shutil.copy(CLIPS / path.name, path)
    return path


def _written(path: Path, images: Callable[[], Iterator[np.ndarray]]) -> Path:
    if not path.exists():
        part = path.with_suffix(".part")
        write(part, images()).replace(path)
    return path


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    for path in make(parser.parse_args().folder):
        info = probe(path, VideoLimits())
        print(f"{path}  {info.width}x{info.height}  {info.duration_s:.1f} s")


if __name__ == "__main__":
    main()
