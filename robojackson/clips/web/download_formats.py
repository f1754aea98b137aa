"""Choose the format to download: a small one to score, a good one to dance.

Nothing is ever merged: of images of one size the one with sound is danced, and where a site has
sound and image only apart, the dance is silent. The short side of the image counts: shorts stand
upright.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from pydantic import Field

from robojackson.config import config_dataclass

Purpose = Literal["score", "dance"]
Format = Mapping[str, Any]
DIRECT_PROTOCOLS = ("http", "https")
"""Protocols that fetch one file, which can be resumed."""
EXTERNAL_PROTOCOLS = ("rtmp", "rtmpe", "rtmp_ffmpeg")
"""Protocols for which yt-dlp starts an external program, without our guard and limits."""


@config_dataclass
class FormatConfig:
    """Configuration of the formats of downloads.

    Attributes:
        score_short_side: Fewest pixels of the short side of the image that is scored.
        dance_short_side: Most pixels of the short side of the image that is danced.
    """

    score_short_side: int = Field(default=360, ge=16)
    dance_short_side: int = Field(default=1080, ge=16)


def choose(formats: Sequence[Format], purpose: Purpose, config: FormatConfig) -> Format | None:
    """Return the format to download, None when none has an image.

    To score: the smallest of at least `score_short_side`, or the largest there is. To dance: the
    largest of at most `dance_short_side`, or the smallest there is. A format whose size is unknown
    (a link to a file) is taken only when there is no other.
    """
    seen = [f for f in formats if f.get("vcodec") != "none" and not _is_refused(f)]
    sized = [f for f in seen if short_side(f)]
    if not sized:
        return seen[-1] if seen else None
    if purpose == "score":
        enough = [f for f in sized if short_side(f) >= config.score_short_side]
        return min(enough, key=_cost) if enough else max(sized, key=_quality)
    fitting = [f for f in sized if short_side(f) <= config.dance_short_side]
    return max(fitting, key=_quality) if fitting else min(sized, key=_cost)


def short_side(format_: Format) -> int:
    """Return pixels of the shorter side of the image; 0 when the format does not give it."""
    width, height = format_.get("width"), format_.get("height")
    sides = [int(side) for side in (width, height) if side]
    return min(sides) if sides else 0


def _is_refused(format_: Format) -> bool:
    return bool(format_.get("has_drm")) or format_.get("protocol") in EXTERNAL_PROTOCOLS


def _cost(format_: Format) -> tuple[int, bool, float]:
    """Return the least first: the smaller image, one file rather than pieces, fewer bytes."""
    return short_side(format_), format_.get("protocol") not in DIRECT_PROTOCOLS, _bytes(format_)


def _quality(format_: Format) -> tuple[int, bool, bool, float]:
    """Return a sort key, best greatest: larger image, with sound, one file rather than pieces, more
    frames, more bits."""
    rate = float(format_.get("fps") or 0) + 1e-6 * float(format_.get("tbr") or 0)
    heard = format_.get("acodec") not in (None, "none")
    return short_side(format_), heard, format_.get("protocol") in DIRECT_PROTOCOLS, rate


def _bytes(format_: Format) -> float:
    """Return the size of the file, or its bit rate, which orders formats of one video alike."""
    size = format_.get("filesize") or format_.get("filesize_approx")
    return float(size or format_.get("tbr") or float("inf"))
