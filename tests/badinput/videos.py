"""Videos that are none, damaged ones, bombs, and files that name others."""

import os
import struct
import wave
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from tests.badinput.base import CLIP
from tests.badinput.case import Case, Maker, nothing, writes

OUT = ("-o", "out")
LISTS = {
    "HLS playlist": ("a.m3u8", "#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\nfile://{clip}\n"),
    "HLS playlist called mp4": ("a.mp4", "#EXTM3U\n#EXTINF:9,\n{clip}\n#EXT-X-ENDLIST\n"),
    "HLS of a network": ("a.m3u8", "#EXTM3U\n#EXTINF:9,\nhttp://127.0.0.1:9/x.ts\n"),
    "HLS with a key file": ("a.m3u8", '#EXTM3U\n#EXT-X-KEY:METHOD=AES-128,URI="/etc/passwd"\n'),
    "concat script": ("a.ffconcat", "ffconcat version 1.0\nfile {clip}\n"),
    "concat script called mp4": ("a.mp4", "ffconcat version 1.0\nfile '/etc/passwd'\n"),
    "DASH manifest": ("a.mpd", '<?xml version="1.0"?><MPD><BaseURL>file:/x</BaseURL></MPD>'),
    "pls playlist": ("a.pls", "[playlist]\nFile1={clip}\n"),
    "session description": ("a.sdp", "v=0\nc=IN IP4 127.0.0.1\nm=video 5004 RTP/AVP 96\n"),
}
CONTENTS: dict[str, bytes] = {
    "empty": b"",
    "one byte": b"\0",
    "text": b"this is no video\n" * 100,
    "random bytes": np.random.default_rng(0).bytes(100_000),
    "zeros": bytes(100_000),
    "zip": b"PK\x03\x04" + bytes(200),
    "pickle": b"\x80\x04cos\nsystem\n(S'touch planted'\ntR.",
    "html": b"<html><body>not found</body></html>",
    "svg": b'<svg xmlns="http://www.w3.org/2000/svg"><image href="file:///etc/passwd"/></svg>',
    "png": b"\x89PNG\r\n\x1a\n" + bytes(100),
    "only ftyp": b"\0\0\0\x18ftypisom\0\0\2\0isomiso2",
    "ftyp and a huge box": b"\0\0\0\x18ftypisom\0\0\2\0isomiso2" + struct.pack(">I4s", 2**31, b"moov"),
    "ebml alone": b"\x1a\x45\xdf\xa3\x9f",
    "riff alone": b"RIFF\xff\xff\xff\xffAVI LIST\xff\xff\xff\x7fhdrl",
    "gif of 65535 pixels": b"GIF89a\xff\xff\xff\xff\x80\0\0" + bytes(6)
    + b",\0\0\0\0\xff\xff\xff\xff\0\x02\x02L\x01\0;",
    "annex b noise": b"\0\0\0\x01\x67" + np.random.default_rng(1).bytes(5000),
    "y4m of a million pixels a side": b"YUV4MPEG2 W1000000 H1000000 F30:1 C420\nFRAME\n",
    "y4m of no size": b"YUV4MPEG2 W0 H0 F30:1 C420\nFRAME\n",
    "elf": b"\x7fELF" + bytes(60),
    "nul in text": b"a\0b" * 1000,
}  # fmt: skip


def cases() -> Iterator[Case]:
    for name, (file, text) in LISTS.items():
        yield Case("video", name, ("mocap", file, *OUT), writes(file, text.format(clip=CLIP)))
    for name, data in CONTENTS.items():
        yield Case("video", name, ("mocap", "a.mp4", *OUT), writes("a.mp4", data))
    for share in (0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99):
        yield Case("video", f"cut at {share:.0%}", ("mocap", "a.mp4", *OUT), _cut(share))
    for name, make in MADE.items():
        yield Case("video", name, ("mocap", "a.mkv", *OUT), _film(*make))
    for name, link in LINKS.items():
        yield Case("video", name, ("mocap", "a.mp4", *OUT), link)
    for name, path in PATHS.items():
        yield Case("video", name, ("mocap", path, *OUT))
    for command in ("score", "dance"):
        for name in ("empty", "text", "only ftyp"):
            make = writes("a.mp4", CONTENTS[name])
            yield Case("video", f"{command}: {name}", (command, "a.mp4"), make)
        yield Case("video", f"{command}: a playlist", (command, "a.mp4"),
                   writes("a.mp4", LISTS["HLS playlist"][1].format(clip=CLIP)))  # fmt: skip
        yield Case(
            "video", f"{command}: empty folder", (command, "f"), lambda here: (here / "f").mkdir()
        )
    yield Case("video", "people of a text", ("mocap", "a.mp4", "--people", *OUT),
               writes("a.mp4", "text"))  # fmt: skip
    yield Case("video", "escape sequence in the name", ("mocap", "\x1b[31m\x07.mp4", *OUT),
               writes("\x1b[31m\x07.mp4", "text"))  # fmt: skip
    twice = ("mocap", str(CLIP), str(CLIP), *OUT)
    yield Case("video", "two clips of one camera", twice, says="from one place")
    yield Case("video", "second clip black", ("mocap", str(CLIP), "a.mkv", *OUT),
               _film(320, 240, 90, 30), says="a.mkv: no person")  # fmt: skip
    yield Case("video", "second clip a pipe", ("mocap", str(CLIP), "a.mp4", *OUT), _fifo)
    for name, (file, make) in MUSIC.items():
        words = ("dance", str(CLIP), "--config", "smoke", "--music", file)
        yield Case("video", f"music {name}", words, make, says="m.")
    yield Case("video", "results in a file", ("mocap", str(CLIP), "-o", "f"), writes("f", ""))
    yield Case("video", "results in /proc", ("mocap", str(CLIP), "-o", "/proc/x"))


PATHS = {
    "missing": "nothing.mp4",
    "folder": ".",
    "dash": "-",
    "http": "http://127.0.0.1:9/x.mp4",
    "http of one slash": "http:/host/x.mp4",
    "file url": "file:///etc/passwd",
    "pipe": "pipe:0",
    "concat protocol": "concat:a.mp4|b.mp4",
    "data protocol": "data:video/mp4;base64,AAAA",
    "subfile protocol": "subfile,,start,0,end,9,,:/etc/passwd",
    "tcp": "tcp://127.0.0.1:9",
    "dev zero": "/dev/zero",
    "dev stdin": "/dev/stdin",
    "passwd": "/etc/passwd",
    "too long": "x" * 300 + ".mp4",
    "very long": "/".join(["x" * 200] * 30),
    "spaces": "   ",
    "empty word": "",
    "newline": "a\nb.mp4",
}


def _fifo(here: Path) -> None:
    os.mkfifo(here / "a.mp4")


def _silence(here: Path) -> None:
    with wave.open(str(here / "m.wav"), "wb") as file:
        file.setparams((1, 2, 8000, 0, "NONE", ""))
        file.writeframes(bytes(16_000))


MUSIC: dict[str, tuple[str, Maker]] = {
    "a text": ("m.mp3", writes("m.mp3", "text")),
    "a pipe": ("m.mp3", lambda here: os.mkfifo(here / "m.mp3")),
    "a playlist": ("m.mp3", writes("m.mp3", "#EXTM3U\nfile:///etc/passwd\n")),
    "missing": ("m.mp3", nothing),
    "silent": ("m.wav", _silence),
}
LINKS: dict[str, Maker] = {
    "fifo": _fifo,
    "loop of links": lambda here: (here / "a.mp4").symlink_to("a.mp4"),
    "dangling link": lambda here: (here / "a.mp4").symlink_to("nothing"),
    "link to a device": lambda here: (here / "a.mp4").symlink_to("/dev/zero"),
    "folder called mp4": lambda here: (here / "a.mp4").mkdir(),
}


def _cut(share: float) -> Maker:
    def make(here: Path) -> None:
        data = CLIP.read_bytes()
        (here / "a.mp4").write_bytes(data[: int(len(data) * share)])

    return make


def _film(width: int, height: int, frames: int, rate: int, noise: bool = False) -> Maker:
    def make(here: Path) -> None:
        rng = np.random.default_rng(0)
        with av.open(str(here / "a.mkv"), "w") as container:
            stream = container.add_stream("mjpeg", rate=Fraction(rate))
            stream.width, stream.height, stream.pix_fmt = width, height, "yuvj420p"
            picture = np.zeros((height, width, 3), np.uint8)
            for _ in range(frames):
                if noise:
                    picture = rng.integers(0, 255, picture.shape, np.uint8)
                frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
                container.mux(stream.encode(frame.reformat(format="yuvj420p")))
            container.mux(stream.encode())

    return make


MADE = {
    "black": (320, 240, 10, 30),
    "noise": (320, 240, 10, 30, True),
    "one frame": (320, 240, 1, 30),
    "two pixels": (2, 2, 10, 30),
    "a line": (2048, 2, 10, 30),
    "ten minutes": (16, 16, 600, 1),
    "9000 pixels a side": (9000, 9000, 2, 30),
    "100000 frames a second": (16, 16, 50, 100_000),
}
