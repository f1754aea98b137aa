"""Clips that are hard or bad for motion capture, each made of a bundled one; no randomness.

    python -m tools.bad_clips FOLDER [NAME ...]

Every function yields (seconds, RGB picture); `make` writes one as H.264 at exactly those times.
"""

import sys
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from robojackson.clips.video import timed_frames
from tools.crossing import CLIPS, crossing, empty_room

CLOCK = 90_000
QUARTER_TURN = (0, 1 << 16, 0, -(1 << 16), 0, 0)
"""Matrix of a track header that turns the picture a quarter clockwise, 16.16 fixed point."""
Timed = Iterator[tuple[float, np.ndarray]]


def frames(name: str) -> Timed:
    """A bundled clip."""
    return timed_frames(CLIPS / f"{name}.mp4")


def two_people() -> Timed:
    """Two dancers cross, one in front of the other."""
    yield from ((index / 30, picture) for index, picture in enumerate(crossing()[0]))


def returns() -> Timed:
    """The person is gone for a second in the middle."""
    room = empty_room("dance_a")
    yield from ((t, room if 1.0 <= t < 2.0 else image) for t, image in frames("dance_a"))


def cut_at_knees() -> Timed:
    """Nothing is seen below the knees."""
    yield from ((t, image[60:330, 140:500]) for t, image in frames("hip_shake"))


def upper_body() -> Timed:
    """Nothing is seen below the chest."""
    yield from ((t, _larger(image[90:210, 240:400], 3)) for t, image in frames("hip_shake"))


def face_only() -> Timed:
    """A face that fills the picture."""
    yield from ((t, _larger(image[98:162, 290:354], 8)) for t, image in frames("hip_shake"))


def lying() -> Timed:
    """The picture of a standing dancer lies on its side."""
    yield from ((t, np.rot90(image)) for t, image in frames("dance_b"))


def turned_away() -> Timed:
    """The hip shake from behind."""
    return timed_frames(CLIPS / "heldout" / "hip_shake_back.mp4")


def fps_8() -> Timed:
    """Eight frames a second."""
    yield from _at(np.arange(0, 3.2, 1 / 8), "dance_a")


def fps_120() -> Timed:
    """120 frames a second, those between two frames a mixture of both."""
    yield from _at(np.arange(0, 2.0, 1 / 120), "dance_a", mixed=True)


def variable_rate() -> Timed:
    """A phone that drops to 12 frames a second for half of the time."""
    yield from (f for i, f in enumerate(frames("dance_a")) if not 20 <= i < 60 or i % 5 in (0, 2))


def portrait() -> Timed:
    """Upright and narrow."""
    yield from ((t, image[:, 200:470]) for t, image in frames("hip_shake"))


def four_k() -> Timed:
    """2160 x 3840."""
    yield from ((t, _larger(image, 2)) for t, image in frames("person_cam1"))


def two_seconds() -> Timed:
    """Two seconds."""
    yield from ((t, image) for t, image in frames("hip_shake") if t < 2.0)


def sixty_seconds() -> Timed:
    """A minute: fifteen laps."""
    for lap in range(15):
        yield from ((4.0 * lap + t, image) for t, image in frames("hip_shake"))


def grey() -> Timed:
    """Without colour."""
    for t, image in frames("dance_b"):
        yield t, np.repeat(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)[..., None], 3, -1)


def rotated() -> Timed:
    """A phone held upright: the picture is stored lying, a tag says how to turn it."""
    yield from ((t, np.rot90(image)) for t, image in frames("person_cam1"))


def damaged() -> Timed:
    """Some frames in the middle are overwritten after the clip is made."""
    return frames("dance_a")


KINDS: dict[str, Callable[[], Timed]] = {
    made.__name__: made
    for made in (
        two_people, returns, cut_at_knees, upper_body, face_only, lying, turned_away, fps_8,
        fps_120, variable_rate, rotated, portrait, four_k, two_seconds, sixty_seconds, grey,
        damaged,
    )
}  # fmt: skip


def make(name: str, folder: Path) -> Path:
    """One of `KINDS` as a file; one that is there stays."""
    path = folder / f"{name}.mp4"
    if path.exists():
        return path
    part = path.with_suffix(".part")
    write_timed(part, KINDS[name]())
    if name == "rotated":
        turn_by_tag(part)
    if name == "damaged":
        damage(part)
    return part.replace(path)


def write_timed(path: Path, images: Iterable[tuple[float, np.ndarray]]) -> None:
    """Images at their times as an H.264 file."""
    with av.open(str(path), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=30, options={"crf": "20"})
        stream.pix_fmt = "yuv420p"
        stream.time_base = stream.codec_context.time_base = Fraction(1, CLOCK)
        for number, (time_s, image) in enumerate(images):
            even = np.ascontiguousarray(image[: len(image) // 2 * 2, : image.shape[1] // 2 * 2])
            if number == 0:
                stream.height, stream.width = even.shape[:2]
            picture = av.VideoFrame.from_ndarray(even)
            picture.pts, picture.time_base = round(time_s * CLOCK), Fraction(1, CLOCK)
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))


def turn_by_tag(path: Path) -> None:
    """Write a quarter turn clockwise into the track header, as a phone does."""
    data = bytearray(path.read_bytes())
    start = data.index(b"tkhd") + 4 + 40
    for index, value in enumerate(QUARTER_TURN):
        data[start + 4 * index : start + 4 * index + 4] = value.to_bytes(4, "big", signed=True)
    path.write_bytes(bytes(data))


def damage(path: Path) -> None:
    """Overwrite what a bad copy would: 1 % of the file, in its middle."""
    data = bytearray(path.read_bytes())
    middle = len(data) // 2
    data[middle : middle + len(data) // 100] = b"\x00" * (len(data) // 100)
    path.write_bytes(bytes(data))


def main() -> None:
    """Entry point."""
    folder, *names = sys.argv[1:]
    for name in names or KINDS:
        make(name, Path(folder))


def _at(times: np.ndarray, name: str, mixed: bool = False) -> Timed:
    """A clip at other times: its nearest frames, or mixtures of both neighbours."""
    images = [image for _, image in frames(name)]
    for time_s in times:
        at = min(time_s * 30, len(images) - 1)
        before, after = int(at), min(int(at) + 1, len(images) - 1)
        share = at - before if mixed else float(round(at - before))
        yield float(time_s), cv2.addWeighted(images[before], 1 - share, images[after], share, 0)


def _larger(image: np.ndarray, factor: int) -> np.ndarray:
    return cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)


if __name__ == "__main__":
    main()
