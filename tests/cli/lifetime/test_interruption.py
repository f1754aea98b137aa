"""Ctrl-C at chosen moments of real commands: acknowledged, ended, nothing left, resumed."""

import signal
import sqlite3
import time
from pathlib import Path

import pytest

from tests.fixtures.commands import robojackson
from tools.stack.interrupted_command import CLIP, End, Running

pytestmark = pytest.mark.xdist_group("interruption")

ACKNOWLEDGED_S, ENDED_S, SAVED_S = 5.0, 10.0, 40.0
"""Generous multiples of 1 and 3 s, for a busy machine, and what a checkpoint may take."""
LEARNT = 8
"""Progress lines after which a training has learnt something, also on a busy machine."""
SMALL = ("tqc.n_envs=4", "tqc.warmup=100", "tqc.batch=32", "progress_seconds=0.2")
DANCE = ("dance", CLIP, "--config=smoke", "--set=train.steps=1000000")
LEARN = (*DANCE, "--trainer=sb3", *(f"--set=train.{setting}" for setting in SMALL))
WAYS = {"group": (signal.SIGINT, False), "process": (signal.SIGINT, True)}
EITHER_WAY = ("group", pytest.param("process", marks=pytest.mark.heavy))
MOMENTS = {
    "import": ("", 0.4),
    "server": ("", 4.0),
    "landmarks": ("Beginning flow run", 1.5),
    "compilation": ("of a perfect dance's reward", 1.0),
}


def interrupted(
    words: tuple[str, ...], store: Path, text: str, delay_s: float, way: str, more: int = 0
) -> End:
    """Return how a command ended that was interrupted some time after a line with a text.

    Without a text: after its supervisor began. `more`: lines to wait for after that one.
    """
    running = Running(words, store)
    running.wait_until_guarded()
    if text:
        running.wait_for(text, more)
    time.sleep(delay_s)
    end = running.end(running.interrupt(*WAYS[way]))
    assert end.faults == (), running.output()
    assert end.acknowledged_s < ACKNOWLEDGED_S
    assert end.ended_s < (SAVED_S if end.saving else ENDED_S)
    return end


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a store in which the stages that have ended are cached from test to test."""
    return tmp_path_factory.mktemp("interrupted") / "store"


@pytest.fixture(scope="module")
def motion(tmp_path_factory: pytest.TempPathFactory, short_clip: Path) -> Path:
    """Return a folder with the inputs of the stages after mocap."""
    folder = tmp_path_factory.mktemp("motion")
    robojackson("mocap", short_clip, "-o", folder)
    robojackson("retarget", folder / "smpl.parquet", "-o", folder, "--config", "smoke")
    return folder


def answer(end: End) -> tuple[str, ...]:
    """Return what a command wrote from the acknowledgement on; a line may just precede it."""
    first = next(i for i, line in enumerate(end.lines) if line.startswith("robojackson: "))
    return end.lines[first:]


@pytest.mark.slow
@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("way", EITHER_WAY)
def test_a_dance_that_has_nothing_to_save_ends_at_once(moment: str, way: str, store: Path) -> None:
    end = interrupted(DANCE, store, *MOMENTS[moment], way)
    assert not end.saving
    assert answer(end)[0] == "robojackson: interrupted, ending ..."
    assert end.lines[-1].startswith(f"robojackson: interrupted: resume: robojackson dance {CLIP}")
    assert len(answer(end)) == 2


@pytest.mark.slow
def test_a_dance_that_learns_saves_its_checkpoint_and_says_so(store: Path) -> None:
    others = set(store.glob("work/*/checkpoint/run.json"))  # of the dances above, on this store
    for text in (" steps ", "resuming at"):  # the second time from the checkpoint of the first
        end = interrupted(LEARN, store, text, 3.0, "group", LEARNT)
        assert "the training is saving its checkpoint" in answer(end)[0]
        assert len(set(store.glob("work/*/checkpoint/run.json")) - others) == 1
    with sqlite3.connect(store / "prefect" / "prefect.db") as database:
        assert database.execute("pragma integrity_check").fetchone() == ("ok",)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["mocap", "retarget", "score", "find", "pretrain"])
@pytest.mark.parametrize("way", EITHER_WAY)
def test_a_command_ends_at_once_while_it_is_imported(
    name: str, way: str, motion: Path, tmp_path: Path
) -> None:
    words = commands(motion, tmp_path / "out")[name]
    end = interrupted(words, tmp_path / "store", "", 0.3, way)
    assert answer(end)[0] == "robojackson: interrupted, ending ..."


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "text"),
    [("mocap", "landmarks of"), ("retarget", "cycle: "), ("pretrain", "landmarks of")],
)
def test_a_stage_that_is_interrupted_leaves_no_result_and_is_done_by_the_same_command(
    name: str, text: str, motion: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    words = commands(motion, out)[name]
    end = interrupted(words, tmp_path / "store", text, 0.0, "group")
    assert end.lines[-1].startswith(f"robojackson: interrupted: resume: robojackson {name}")
    assert [path for path in out.rglob("*") if path.is_file()] == []
    again = Running(words, tmp_path / "store")
    again.wait_for(text)
    again.end(again.interrupt())


@pytest.mark.slow
@pytest.mark.parametrize("way", EITHER_WAY)
def test_a_training_that_has_learnt_nothing_ends_at_once(
    way: str, motion: Path, tmp_path: Path
) -> None:
    words = ("train", str(motion / "reference.parquet"), "-o", str(tmp_path / "out"), "--force")
    words += ("--trainer=sb3", "--set=tqc.warmup=100000", "--set=progress_seconds=0.2")
    end = interrupted(words, tmp_path / "store", " steps ", 1.0, way)
    assert answer(end)[0] == "robojackson: interrupted, ending ..."


@pytest.mark.slow
@pytest.mark.parametrize("way", EITHER_WAY)
def test_a_training_that_learns_saves_its_checkpoint_and_resumes(
    way: str, motion: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    words = ("train", str(motion / "reference.parquet"), "-o", str(out), "--force", "--trainer=sb3")
    words += ("--steps=1000000", *(f"--set={setting}" for setting in SMALL))
    for text in (" steps ", "resuming at"):
        end = interrupted(words, tmp_path / "store", text, 2.0, way, LEARNT)
        assert "the training is saving its checkpoint" in answer(end)[0]
        assert f"interrupted: the checkpoint is in {out}; resume: robojackson" in end.lines[-1]
    assert (out / "checkpoint" / "run.json").exists()


def commands(motion: Path, out: Path) -> dict[str, tuple[str, ...]]:
    """Return commands that take more than a second, by name."""
    given = {
        "mocap": (CLIP, "-o", str(out)),
        "retarget": (str(motion / "smpl.parquet"), "-o", str(out)),
        "score": (CLIP,),
        "find": (str(Path(CLIP).parent), "--source=folder"),
        "pretrain": ("-o", str(out), "--steps=100000"),
    }
    return {name: (name, *words) for name, words in given.items()}
