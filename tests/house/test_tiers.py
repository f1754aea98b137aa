"""`make test-fast` is most of the tests, and of every folder at least one."""

import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LEAST_SHARE = 0.7
BY_THEMSELVES = {"browser"}
"""Folders that a command of their own runs (`make test-browser`): they need more than Python."""
FAST = "not slow and not medium"
COLLECT = """
import sys, pytest
class Names:
    def pytest_collection_finish(self, session):
        for item in session.items:
            fast = not any(item.get_closest_marker(name) for name in ("slow", "medium"))
            print("collected", "fast" if fast else "rest", item.path.parent.as_posix())
sys.exit(pytest.main(["--collect-only", "-qq", "-p", "no:cacheprovider"], plugins=[Names()]))
"""


def folders_of_tests() -> set[str]:
    """Return the folders of tests/ that hold a test of `make test`, by its file's name."""
    return {
        path.relative_to(ROOT / "tests").parts[0] for path in (ROOT / "tests").rglob("test_*.py")
    }


def tops(folders: Iterable[str]) -> set[str]:
    return {Path(folder).relative_to(ROOT / "tests").parts[0] for folder in folders}


@pytest.mark.slow
def test_the_fast_tests_are_most_of_all_and_of_every_folder() -> None:
    done = subprocess.run(
        [sys.executable, "-c", COLLECT], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:]
    found = re.findall(r"(?m)^collected (fast|rest) (\S+)$", done.stdout)
    count = Counter(tier for tier, _ in found)
    assert count.total() > 3000
    assert count["fast"] / count.total() >= LEAST_SHARE
    fast = tops(folder for tier, folder in found if tier == "fast")
    assert folders_of_tests() - fast == BY_THEMSELVES


def test_make_test_fast_leaves_out_what_is_marked_and_make_test_nothing() -> None:
    recipes = dict(
        re.findall(r"(?m)^(test|test-fast): setup\n\t@(.+)$", (ROOT / "Makefile").read_text())
    )
    assert f'-m "{FAST}"' in recipes["test-fast"]
    assert recipes["test"] == "$(PYTEST) $(ARGS)"
