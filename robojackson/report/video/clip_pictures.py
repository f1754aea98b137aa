"""Some pictures of a clip, read as a stream: a minute of them does not fit into memory.

Pictures that are requested in their order are decoded once. Those of a motion that repeats are held
where they fit into `MOST_BYTES`; where they do not, the clip is read again every cycle.
"""

from collections.abc import Callable, Collection
from pathlib import Path

from robojackson.clips.video import read_frames
from robojackson.report.video.canvas import Picture

MOST_BYTES = 256 * 2**20
"""Size of the pictures that are held, bytes: 86 of 1080 x 960 pixels."""


class ClipPictures:
    """Pictures of a clip, each cut by one function.

    Args:
        source: The clip.
        rows: Places in the clip of the pictures that will be requested.
        cut: Function that makes a picture of a frame of the clip.
        most_bytes: Size of the pictures that are held, bytes; the last one always is.
    """

    def __init__(
        self,
        source: Path,
        rows: Collection[int],
        cut: Callable[[Picture], Picture],
        most_bytes: int = MOST_BYTES,
    ) -> None:
        self._source, self._rows, self._cut = source, frozenset(rows), cut
        self._most_bytes = most_bytes
        self._held: dict[int, Picture] = {}
        self._next, self._frames = 0, read_frames(source)
        self._count: int | None = None

    @property
    def held_bytes(self) -> int:
        """Size of the pictures that are held, bytes."""
        return sum(picture.nbytes for picture in self._held.values())

    def at(self, row: int) -> Picture | None:
        """Return the picture at a place of the clip; None beyond its end.

        Raises:
            UnreadableVideo, TruncatedVideo: the clip cannot be decoded to there.
        """
        if row in self._held:
            return self._held[row]
        if self._count is not None and row >= self._count:
            return None
        if row < self._next:
            self._next, self._frames = 0, read_frames(self._source)
        for frame in self._frames:
            self._next += 1
            if self._next - 1 in self._rows:
                self._hold(self._next - 1, self._cut(frame))
            if self._next > row:
                return self._held[row]
        self._count = self._next
        return None

    def _hold(self, row: int, picture: Picture) -> None:
        """Hold a picture, in place of the oldest where there is no room."""
        while self._held and self.held_bytes + picture.nbytes > self._most_bytes:
            del self._held[next(iter(self._held))]
        self._held[row] = picture
