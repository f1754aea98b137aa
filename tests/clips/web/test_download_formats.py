"""The format that is downloaded, on lists of the shape that yt-dlp gives."""

from typing import Any

import pytest

from robojackson.clips.web.download_formats import FormatConfig, choose

CONFIG = FormatConfig()


def form(name: str, width: int | None, height: int | None, **more: Any) -> dict[str, Any]:
    return {"format_id": name, "width": width, "height": height, "protocol": "https", **more}


SHORT = [
    form("sb0", 48, 27, vcodec="none"),
    form("140", None, None, vcodec="none", acodec="mp4a"),
    form("160", 144, 256, filesize=200),
    form("134", 360, 640, filesize=900),
    form("18", 360, 640, filesize=1300),
    form("135", 480, 854, filesize=1800),
    form("137", 1080, 1920, filesize=9000, tbr=2500, fps=30),
    form("299", 1080, 1920, filesize=12000, tbr=4000, fps=60),
    form("400", 1440, 2560, filesize=20000),
]
"""An upright short: the short side is the width."""


@pytest.mark.parametrize(("purpose", "name"), [("score", "134"), ("dance", "299")])
def test_the_short_side_decides(purpose: Any, name: str) -> None:
    chosen = choose(SHORT, purpose, CONFIG)
    assert chosen is not None
    assert chosen["format_id"] == name


def test_lying_and_upright_videos_are_treated_alike() -> None:
    lying = [{**f, "width": f["height"], "height": f["width"]} for f in SHORT]
    names = [choose(lying, purpose, CONFIG)["format_id"] for purpose in ("score", "dance")]  # type: ignore[arg-type, index]
    assert names == ["134", "299"]


def test_where_all_are_small_the_largest_is_scored() -> None:
    chosen = choose(SHORT[:3], "score", CONFIG)
    assert chosen is not None
    assert chosen["format_id"] == "160"


def test_where_all_are_large_the_smallest_is_danced() -> None:
    chosen = choose([form("a", 2160, 3840), form("b", 1440, 2560)], "dance", CONFIG)
    assert chosen is not None
    assert chosen["format_id"] == "b"


def test_one_file_is_better_than_pieces() -> None:
    pieces = form("hls", 360, 640, protocol="m3u8_native", filesize=1)
    chosen = choose([pieces, form("file", 360, 640, filesize=999)], "score", CONFIG)
    assert chosen is not None
    assert chosen["format_id"] == "file"


def test_a_file_of_unknown_size_is_taken_when_it_is_all_there_is() -> None:
    assert choose([form("mp4", None, None)], "score", CONFIG) == form("mp4", None, None)


def test_sound_alone_is_nothing() -> None:
    assert choose(SHORT[:2], "score", CONFIG) is None


def test_a_locked_format_is_not_taken() -> None:
    assert choose([form("x", 720, 1280, has_drm=True)], "dance", CONFIG) is None


def test_of_two_images_of_one_size_the_one_with_sound_is_danced() -> None:
    silent = form("silent", 720, 1280, acodec="none", protocol="https", fps=60)
    heard = form("heard", 720, 1280, acodec="mp4a", protocol="m3u8_native", fps=30)
    assert choose([heard, silent], "dance", CONFIG) == heard
    larger = form("larger", 1080, 1920, acodec="none")
    assert choose([heard, larger], "dance", CONFIG) == larger


@pytest.mark.parametrize("purpose", ["score", "dance"])
def test_a_format_for_an_external_program_is_left_out(purpose: Any) -> None:
    best = form("rtmp", 1080, 1920, protocol="rtmp")
    assert choose([form("18", 360, 640), best], purpose, CONFIG) == form("18", 360, 640)
    assert choose([best], purpose, CONFIG) is None
