"""`make badinput`: every case of the corpus through the real command, and a table of the results.

    python -m tests.badinput.run [--groups NAME,...] [--workers 2] [--table FILE]

A bad case passes when the command ends with 1 or 2 and one line, without control bytes or a
traceback, leaves nothing behind and takes at most `MARGIN_MB` more memory than the same command
needs for a bundled clip; an odd but valid one when it ends with 0.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from queue import Queue

from tests.badinput.base import ROOT, base
from tests.badinput.case import Case
from tests.badinput.corpus import corpus
from tests.fixtures.commands import environment

MARGIN_MB = 1024
USUAL_MB = {"mocap": 620, "score": 620, "dance": 700, "train": 900, "evaluate": 600}
"""Peak memory of commands on a bundled clip (docs/bad_input.md); other commands are below 500."""
PROGRESS = 25
"""Cases between two lines on stderr."""
LONGEST_S = 180.0
"""Where ten others want the processor, too; on an idle machine a third of it."""
KEPT_VARIABLES = ("PATH", "LANG", "VIRTUAL_ENV", "PYTHONPATH", "OMP_NUM_THREADS")


@dataclass(frozen=True)
class Outcome:
    """The result of a case.

    Attributes:
        faults: What is wrong; nothing where it passed.
        line: The last line on stderr.
    """

    case: Case
    code: int
    seconds: float
    cpu_s: float
    peak_mb: float
    line: str
    faults: tuple[str, ...]


def run(case: Case, made: Path, runner: "Warm") -> Outcome:
    """Run one case in a folder of its own."""
    with tempfile.TemporaryDirectory(prefix="badinput-") as scratch:
        here, outside = Path(scratch) / "here", Path(scratch) / "outside"
        here.mkdir()
        outside.mkdir()
        try:
            case.make(here)
        except Exception as cause:
            return Outcome(case, 70, 0.0, 0.0, 0.0, "", (f"cannot be made: {cause!r:.100}",))
        before = _listed(here)
        words = [str(made / w[2:]) if w.startswith("@/") else w for w in case.words]
        began = time.monotonic()
        code, cpu_s, peak_mb, out, err = runner(
            words, here, _environment(case, here, outside), outside, case.group == "environment"
        )
        left = sorted(_listed(here) - before)
        seconds = time.monotonic() - began
    faults = _faults(case, code, peak_mb, out, err, left)
    lines = err.decode(errors="replace").splitlines() or [""]
    return Outcome(case, code, seconds, cpu_s, peak_mb, lines[-1], tuple(faults))


def _environment(case: Case, here: Path, outside: Path) -> Mapping[str, str]:
    known = {name: value for name, value in environment().items() if name in KEPT_VARIABLES}
    home = {"HOME": str(outside), "TMPDIR": str(outside), "ROBOJACKSON_STORE": f"{outside}/store"}
    own = {name: value.replace("{here}", str(here)) for name, value in case.env.items()}
    return {**known, "OMP_NUM_THREADS": "1", **home, **own}


Result = tuple[int, float, float, bytes, bytes]
"""Exit code, processor time of all its processes (s), peak of resident memory of the largest process (MB), stdout and stderr."""


class Warm:
    """A process of `tests.badinput.warm`, and a lock: one case at a time."""

    def __init__(self, cold: bool = False) -> None:
        self.cold = cold
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.badinput.warm"], cwd=ROOT, env=environment(),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip

    def __call__(
        self, words: list[str], here: Path, env: Mapping[str, str], outside: Path, cold: bool
    ) -> Result:
        out, err = outside / "stdout.txt", outside / "stderr.txt"
        request = {"words": words, "here": str(here), "env": dict(env), "seconds": LONGEST_S}
        request |= {"cold": self.cold or cold}
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write(json.dumps({**request, "out": str(out), "err": str(err)}) + "\n")
        self._process.stdin.flush()
        answer = json.loads(self._process.stdout.readline())
        figures = answer["code"], answer["cpu_s"], answer["peak_kb"] / 1024
        return *figures, out.read_bytes(), err.read_bytes()

    def end(self) -> None:
        """End the process."""
        assert self._process.stdin
        self._process.stdin.close()
        self._process.wait()


def _faults(
    case: Case, code: int, peak_mb: float, out: bytes, err: bytes, left: list[str]
) -> Iterable[str]:
    result = err.decode(errors="replace")
    own = [line for line in result.splitlines() if line.startswith("robojackson: ")]
    if "Traceback" in result or "InternalError" in result:
        yield "traceback"
    if any((byte < 32 and byte not in (9, 10)) or byte in (27, 127) for byte in out + err):
        yield "control bytes"
    if peak_mb > USUAL_MB.get(case.words[0] if case.words else "", 500) + MARGIN_MB:
        yield f"{peak_mb:.0f} MB"
    if case.valid:
        if code:
            yield f"exit code {code}, it is valid"
        return
    if code not in (1, 2):
        yield f"exit code {code}"
    checked = case.words[:2] == ("robots", "check") and out  # a list of problems is its answer
    if not checked and (len(own) != 1 or not result.splitlines()[-1].startswith("robojackson: ")):
        yield f"{len(own)} lines of ours"
    if case.says and case.says not in result:
        yield f"does not say {case.says!r}"
    if left:
        yield f"left {', '.join(left)[:80]}"


def _listed(folder: Path) -> set[str]:
    found = set()
    for where, folders, files in os.walk(folder):
        found |= {os.path.relpath(os.path.join(where, name), folder) for name in folders + files}
    return found


def main() -> int:
    """Run the corpus, print its table, and return how many cases failed."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--groups", default="", help="names, a comma between them")
    parser.add_argument("--name", default="")
    parser.add_argument("--cold", action="store_true", help="a fresh process for every case")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--table", type=Path)
    given = parser.parse_args()
    began, made = time.monotonic(), base()
    expected = [name for name in given.groups.split(",") if name]
    cases = [c for c in corpus() if c.group in (expected or [c.group]) and given.name in c.name]
    free: Queue[Warm] = Queue()
    for _ in range(given.workers):
        free.put(Warm(given.cold))

    def in_turn(case: Case) -> Outcome:
        runner = free.get()
        try:
            return run(case, made, runner)
        finally:
            free.put(runner)

    with ThreadPoolExecutor(given.workers) as pool:
        outcomes = []
        for done in as_completed([pool.submit(in_turn, case) for case in cases]):
            outcome = done.result()
            outcomes.append(outcome)
            if not len(outcomes) % PROGRESS:
                sys.stderr.write(f"{len(outcomes)} of {len(cases)}\n")
            if outcome.faults:
                print(_row(outcome), flush=True)
    failed = [each for each in outcomes if each.faults]
    lines = _summary(outcomes, time.monotonic() - began)
    if given.table:
        rows = [_row(each) for each in outcomes]
        given.table.write_text("\n".join([*lines, "", *HEAD, *rows, ""]))
    print("\n".join(lines))
    return min(len(failed), 100)


HEAD = ("| group | case | code | s | CPU s | MB | line | |", "|---|---|---|---|---|---|---|---|")


def _row(outcome: Outcome) -> str:
    case = outcome.case
    line = outcome.line.replace("|", "/").replace(str(ROOT), "")[:110]
    verdict = "; ".join(outcome.faults) or "ok"
    return (
        f"| {case.group} | {case.name} | {outcome.code} | {outcome.seconds:.1f} | "
        f"{outcome.cpu_s:.1f} | "
        f"{outcome.peak_mb:.0f} | {line} | {verdict} |"
    )


def _summary(outcomes: list[Outcome], seconds: float) -> list[str]:
    rows = ["| group | bad | odd but valid | failed | CPU s | most CPU s | most MB |"]
    rows.append("|---|---|---|---|---|---|---|")
    for group in dict.fromkeys(each.case.group for each in outcomes):
        of = [each for each in outcomes if each.case.group == group]
        failed, valid = sum(bool(e.faults) for e in of), sum(e.case.valid for e in of)
        cpu_s, most = [e.cpu_s for e in of], max(e.peak_mb for e in of)
        rows.append(
            f"| {group} | {len(of) - valid} | {valid} | {failed} | {sum(cpu_s):.0f} | "
            f"{max(cpu_s):.1f} | {most:.0f} |"
        )
    kinds = Counter(each.case.valid for each in outcomes)
    failed = sum(bool(each.faults) for each in outcomes)
    cpu_min = sum(each.cpu_s for each in outcomes) / 60
    result = f"{kinds[False]} bad and {kinds[True]} odd but valid cases, {failed} failed; "
    result += f"{cpu_min:.1f} minutes of processor time, {seconds / 60:.1f} minutes by the clock"
    return [*rows, "", result]


if __name__ == "__main__":
    shutil.rmtree(Path(tempfile.gettempdir()) / "badinput", ignore_errors=True)
    sys.exit(main())
