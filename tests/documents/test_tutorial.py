"""The commands of the tutorial run in order, and those that only look at what is there."""

import shutil
from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.documents.documented import ROOT, section
from tests.fixtures.commands import robojackson

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("stages")]
TINY = ("--trainer=sb3", "--set=tqc.n_envs=4", "--set=tqc.warmup=100", "--set=tqc.batch=32",
        "--set=tqc.updates_per_round=1")  # fmt: skip
MORE: dict[str, Sequence[str]] = {
    "train": ("--steps=400", *TINY),
    "evaluate": ("--seconds=0.3",),
    "dance": ("--config", "smoke", "--trainer=sb3"),
}
"""What makes a command short; all other words are the tutorial's own."""
LOOKING = (
    ("README.md", ("robots",)),
    ("docs/commands.md", ("doctor",)),
    ("docs/commands.md", ("catalogue",)),
    ("docs/ablation.md", ("metrics",)),
    ("docs/commands.md", ("clean",)),
    ("docs/commands.md", ("licences",)),
    ("docs/robots.md", ("robots", "check", "humanoid")),
    ("docs/trackers.md", ("trackers",)),
)


def shortened(words: Sequence[str], clip: Path) -> list[str]:
    """Return a command of the tutorial with another clip and without its minutes."""
    named = [str(clip) if word == "clips/hip_shake.mp4" else word for word in words]
    if "--minutes" in named:
        at = named.index("--minutes")
        del named[at : at + 2]
    return [*named, *MORE.get(named[0], ())]


@pytest.mark.heavy
@pytest.mark.timeout(1500)
def test_the_tutorial_ends_with_a_dancing_robot(
    tmp_path: Path, short_clip: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    named = section("docs/tutorial.md", "robojackson")
    first_dance = [each.words[1] for each in named].index("dance") + 1
    commands, variants = named[:first_dance], named[first_dance:]
    stages = [each.words[1] for each in commands]
    assert stages == [
        "doctor",
        "score",
        "mocap",
        "retarget",
        "train",
        "evaluate",
        "export",
        "dance",
    ]
    # `tests/flows/test_dance.py` dances with music
    assert {each.words[1] for each in variants} <= {"dance"}
    store = str(tmp_path / "store")
    for each in commands:
        done = robojackson(*shortened(each.words[1:], short_clip), ROBOJACKSON_STORE=store)
        assert done.code == 0, f"{each}\n{done.out[-2000:]}\n{done.err[-3000:]}"
    made = (
        "run/mocap/mocap.png", "run/retarget/reference.parquet", "run/training/policy.safetensors",
        "run/evaluation/evaluation.json", "run/motion.npz",
    )  # fmt: skip
    assert [path for path in made if not (tmp_path / path).is_file()] == []
    assert len(list((tmp_path / "store" / "dances").glob("*/dance.mp4"))) == 1


@pytest.mark.parametrize(("page", "words"), LOOKING, ids=lambda value: str(value))
def test_a_command_that_looks_at_what_is_there_ends_well(
    page: str, words: tuple[str, ...], tmp_path: Path
) -> None:
    store = tmp_path / "store"
    if words == ("metrics",):
        shutil.copytree(ROOT / "benchmarks" / "results" / "ablation", store)
    store.mkdir(exist_ok=True)
    if words == ("robots", "check", "humanoid"):
        words = (*words, "-o", str(tmp_path / "humanoid.png"))
    done = robojackson(*words, ROBOJACKSON_STORE=str(store))
    assert done.code == 0, f"{page}: {done.err[-3000:]}"
    assert done.out.strip()
