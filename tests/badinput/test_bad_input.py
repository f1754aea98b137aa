"""A part of the corpus through the real command, a few of every group; `make badinput` runs all."""

from collections.abc import Iterator

import pytest

from tests.badinput.base import MADE, base
from tests.badinput.case import Case
from tests.badinput.corpus import corpus
from tests.badinput.run import Warm, run

EVERY = 12
"""One in this number of cases is tried, of the bad ones and of the valid ones."""
SLOW = ("endless work", "endless recursion", "zip bomb", "800000", "300000", "million")


def sample() -> list[Case]:
    found = [case for case in corpus() if not any(word in case.name for word in SLOW)]
    return found[::EVERY]


@pytest.fixture(scope="module")
def warm() -> Iterator[Warm]:
    started = Warm()
    yield started
    started.end()


@pytest.mark.slow
@pytest.mark.xdist_group("badinput")
@pytest.mark.timeout(180)
@pytest.mark.parametrize("case", sample(), ids=lambda case: f"{case.group}: {case.name}"[:60])
def test_a_bad_input_is_refused_in_one_line(case: Case, warm: Warm) -> None:
    outcome = run(case, base(), warm)
    assert not outcome.faults, f"{outcome.faults}: {outcome.line}"


def test_the_files_that_cases_name_are_those_that_are_made() -> None:
    named = {w[2:] for case in corpus() for w in case.words if w.startswith("@/")}
    made = {*(name for name, _ in MADE), "networks.safetensors", "aist.pkl"}
    assert named <= made


def test_the_corpus_is_large_and_covers_every_entry() -> None:
    bad = [case for case in corpus() if not case.valid]
    assert len(bad) >= 250
    assert sum(case.valid for case in corpus()) >= 60
    entries = {case.words[0] for case in bad}
    assert {
        "mocap",
        "retarget",
        "score",
        "dance",
        "import",
        "export",
        "train",
        "evaluate",
    } <= entries
    assert {"robots", "trackers", "find", "metrics", "catalogue", "restore", "deploy"} <= entries
