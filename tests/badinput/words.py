"""Words of the command line that no command takes."""

from collections.abc import Iterator

from tests.badinput.base import CLIP
from tests.badinput.case import Case

WORDS: tuple[tuple[str, ...], ...] = (
    ("evil",),
    ("mocap",),
    ("mocap", str(CLIP)),
    ("mocap", str(CLIP), "-o"),
    ("mocap", str(CLIP), "-o", ""),
    ("mocap", str(CLIP), "-o", "out", "--evil"),
    ("mocap", str(CLIP), "-o", "out", "--person", "x"),
    ("mocap", str(CLIP), "-o", "out", "--person", "9" * 400),
    ("mocap", str(CLIP), "-o", "out", "--hypotheses", "-1"),
    ("mocap", str(CLIP), "-o", "out", "--hypotheses", "101"),
    ("mocap", str(CLIP), "-o", "out", "--quality", "evil"),
    ("mocap", str(CLIP), "-o", "x" * 300),
    ("retarget", "@/smpl.parquet", "-o", "out", "--method", "evil"),
    ("retarget", "@/smpl.parquet", "@/smpl.parquet", "-o", "out"),
    ("export", "@/smpl.parquet", "--to", "evil", "-o", "x"),
    ("export", "@/smpl.parquet", "--to", "beyondmimic", "-o", "x"),
    ("export", "@/reference.parquet", "--to", "bvh", "-o", "x"),
    ("export", "@/policy.safetensors", "--to", "bvh", "-o", "x"),
    ("export", "@/smpl.parquet", "--to", "bvh", "-o", "/proc/x/y"),
    ("export", "@/smpl.parquet", "--to", "bvh", "-o", "."),
    ("export", "@/smpl.parquet", "--to", "bvh", "-o", "/dev/full"),
    ("train", "@/reference.parquet", "-o", "out", "--steps", "0"),
    ("train", "@/reference.parquet", "-o", "out", "--seed", "-1"),
    ("train", "@/reference.parquet", "-o", "out", "--minutes", "nan"),
    ("train", "@/reference.parquet", "-o", "out", "--trainer", "evil"),
    ("train", "@/reference.parquet", "-o", "out", "--setup", "evil"),
    ("train", "@/reference.parquet", "-o", "out", "--steps", "300", "--run-id", "../../x"),
    ("evaluate", "nobody", "@/reference.parquet"),
    ("evaluate", "@/policy.safetensors", "nothing.parquet"),
    ("evaluate", "@/policy.safetensors", "@/reference.parquet", "--seconds", "nan"),
    ("evaluate", "@/reference.parquet", "@/reference.parquet"),
    ("robots", "evil"),
    ("robots", "new", "nothing.xml"),
    ("trackers", "add", "evil"),
    ("trackers", "add", "twist2", "--file", "/dev/zero"),
    ("score",),
    ("score", "--person", "0", str(CLIP)),
    ("catalogue", "--evil"),
    ("metrics", "evil"),
)


def cases() -> Iterator[Case]:
    for number, given in enumerate(WORDS):
        shown = " ".join(word.replace(str(CLIP), "CLIP")[:20] or "''" for word in given)
        yield Case("words", f"{number}: {shown}", given)
