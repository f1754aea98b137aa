"""Configurations: files that are none, values that no key takes, and keys that no one knows."""

from collections.abc import Iterator, Mapping

from tests.badinput.base import CLIP
from tests.badinput.case import Case, writes

FILES: Mapping[str, bytes | str] = {
    "empty list": "[]",
    "a number": "3",
    "damaged": "a: [",
    "tabs": "a:\n\tb: 1",
    "unknown key": "evil: 1",
    "unknown key with a bracket": "a[: 1",
    "unknown key of Pydantic's": "mocap: {dataclass: 1}",
    "unknown inner key": "mocap: {evil: 1}",
    "section of text": "mocap: x",
    "key twice": "detector: full\ndetector: lite",
    "nul": b"a: \0",
    "invalid utf-8": b"\xff\xfe\xff",
    "utf-16": "detector: full".encode("utf-16"),
    "deep": "a: " + "{a: " * 3000,
    "aliases": "\n".join(f"a{n}: &a{n} [{f'*a{n - 1}, ' * 9 if n else '1'}]" for n in range(9)),
    "python": "detector: !!python/name:os.system",
    "a date": "detector: 2001-01-01",
    "huge integer": f"minutes: {'9' * 5000}",
    "nan": "minutes: .nan",
    "infinite": "minutes: .inf",
    "negative": "minutes: -1",
    "extends a circle": "extends: ./c.yaml",
    "extends nothing": "extends: nowhere",
    "extends a list": "extends: [a]",
    "keys of lists": "? [a]\n: 1",
    "too large": "# " + "x" * 2_000_000,
}
VALUES = (
    "evil=1", "mocap.evil=1", "detector=huge", "detector=[full]", "minutes=x", "minutes=nan",
    "minutes=0", "minutes=1e400", "video.max_duration_s=-1", "video.min_frames=0",
    "video.min_frames=1.5", "video.max_duration_s=.inf", "dancer.number=0", "dancer.number=-1",
    "retarget.method=evil", "=1", "evil", "a..b=1", "detector={a: 1}", "detector=!!python/name:os",
    "detector=[", "network.hybrik=/dev/zero", "network.niki=x", "dancer=3", "mocap=null",
)  # fmt: skip
TRAIN_VALUES = (
    "steps=-1", "seed=x", "evil=1", "mode=evil", "tqc.batch=0", "tqc.batch=1000000000", "seed=0x1_0",
    "tqc.n_envs=1000000000", "tqc.actor=[100000, 100000]", "tqc.critic=[]",
)  # fmt: skip


def cases() -> Iterator[Case]:
    for number, (name, content) in enumerate(FILES.items()):
        command = ("mocap", str(CLIP), "-o", "out", "--config", "c.yaml")
        if number % 3 == 1:
            command = ("retarget", "@/smpl.parquet", "-o", "out", "--config", "c.yaml")
        elif number % 3 == 2:
            command = ("dance", str(CLIP), "--config", "c.yaml")
        yield Case("configuration", name, command, writes("c.yaml", content))
    for value in VALUES:
        words = ("mocap", str(CLIP), "-o", "out", "--set", value)
        yield Case("configuration", f"--set {value}", words)
    for name in ("nowhere", "/dev/zero", "../../etc/passwd", "robots/humanoid", "", "x.yaml"):
        words = ("mocap", str(CLIP), "-o", "out", "--config", name)
        yield Case("configuration", f"--config {name!r}", words)
    for value in TRAIN_VALUES:
        words = ("train", "@/reference.parquet", "-o", "out", "--set", value)
        yield Case("configuration", f"train --set {value}", words)
    for value in ("filters.evil=1", "web.retries=-1", "web.timeout_s=0", "web.evil=1"):
        words = ("find", ".", "--source", "folder", "--set", value)
        yield Case("configuration", f"find --set {value}", words)
