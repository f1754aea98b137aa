"""Faults of the machine under the real command: full disks, read-only places, two at a time, ends.

    python -m tests.chaos.faults [--only disk,temporary,home,store,pair,exits] [--exits 60]

`disk` runs a command once to see which files it writes, then once for each of them on a disk that
has room for those before it and not for this one. The disks are small tmpfs: it takes root, and
Linux. Exit code 1 where a command ends otherwise than well or in one line, or leaves half a file.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from robojackson.clips.trim import trim
from robojackson.files.local_folder import TEMPORARY
from tests.badinput.base import BASE, CLIP, base
from tests.badinput.run import Warm
from tests.chaos.kills import Place
from tests.fixtures.commands import environment
from tools.stack.service import ROOT

RESULTS = ROOT / "benchmarks" / "results" / "faults.json"
DISK_MB, ROOM_MB, PAGE = 64, 400, 4096
SMPL, REFERENCE, POLICY = (
    str(BASE / name) for name in ("smpl.parquet", "reference.parquet", "policy.safetensors")
)
COMMANDS = {
    "mocap": ("mocap", "{clip}", "-o", "{out}"),
    "retarget": ("retarget", SMPL, "-o", "{out}"),
    "train": ("train", REFERENCE, "-o", "{out}", "--steps", "300", "--trainer", "sb3"),
    "evaluate": ("evaluate", POLICY, REFERENCE, "-o", "{out}", "--seconds", "0.5"),
    "export bvh": ("export", SMPL, "--to", "bvh", "-o", "{out}/motion.bvh"),
    "export onnx": ("export", POLICY, "--to", "onnx", "-o", "{out}/policy.onnx"),
    "import": ("import", str(BASE / "amass.npz"), "-o", "{out}"),
}
NEED_NO_ROOM = ("retarget", "evaluate", "export bvh", "import")


@dataclass(frozen=True)
class Row:
    """What a command did under a fault; `wrong` is empty where that is right."""

    fault: str
    command: str
    code: int
    line: str
    wrong: str


class Machine:
    """Runs commands in forks of a warm process, in a scratch folder."""

    def __init__(self, scratch: Path) -> None:
        self.scratch, self._warm = scratch, Warm()
        self.clip = scratch / "clip.mp4"
        trim(CLIP, 0.0, 0.5, self.clip)
        (scratch / "here").mkdir()

    def run(self, words: tuple[str, ...], out: Path, **variables: str) -> tuple[int, str]:
        """Return the exit code and the text on stderr."""
        given = [word.format(clip=self.clip, out=out) for word in words]
        env = {"HOME": str(self.scratch), "TMPDIR": str(self.scratch), "OMP_NUM_THREADS": "1"}
        env |= {"PATH": os.environ["PATH"], "PYTHONPATH": str(ROOT)}
        env |= {"ROBOJACKSON_STORE": f"{self.scratch}/store", **variables}
        for name in ("stdout.txt", "stderr.txt"):
            (self.scratch / name).unlink(missing_ok=True)
        code, *_, err = self._warm(given, self.scratch / "here", env, self.scratch, False)
        return code, err.decode(errors="replace")


@contextmanager
def disk(folder: Path, free: int | None = None, size_mb: int = DISK_MB) -> Iterator[Path]:
    """Mount a small disk with a number of free bytes; None leaves all of it free."""
    folder.mkdir(exist_ok=True)
    subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size_mb}m", "tmpfs", str(folder)], check=True
    )
    try:
        if free is not None:
            (folder / "filler").write_bytes(b"\0" * (DISK_MB * 2**20 - free))
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def full_disks(machine: Machine) -> Iterator[Row]:
    for name, words in COMMANDS.items():
        with disk(machine.scratch / "disk") as place:
            code, err = machine.run(words, place / "out")
            files = [(f.stat().st_mtime_ns, _pages(f), f.name) for f in _files(place / "out")]
        yield Row("room", name, code, _last(err), "" if not code else "failed with room enough")
        before = 0
        for _, size, file in sorted(files):
            with disk(machine.scratch / "disk", before + size - PAGE) as place:
                code, err = machine.run(words, place / "out")
                half = [f.name for f in _files(place) if f.name.startswith(TEMPORARY)]
            wrong = _refused(code, err, "No space left")
            wrong = wrong or (f"left {half}" if half else "")
            yield Row(f"disk full at {file}", name, code, _last(err, machine), wrong)
            before += size


def temporary(machine: Machine) -> Iterator[Row]:
    with disk(machine.scratch / "disk", 0) as place:
        for name, words in COMMANDS.items():
            out = machine.scratch / f"t-{name}"
            code, err = machine.run(words, out, TMPDIR=str(place))
            wrong = _refused(code, err, "No space left") if code else ""
            if name in NEED_NO_ROOM and code:
                wrong = "needs no temporary file"
            yield Row("TMPDIR full", name, code, _last(err, machine), wrong)


def home(machine: Machine) -> Iterator[Row]:
    for name, words in COMMANDS.items():
        code, err = machine.run(words, machine.scratch / f"h-{name}", HOME="/proc/nobody")
        wrong = "needs no home" if code else ""
        yield Row("HOME cannot be written", name, code, _last(err, machine), wrong)


def read_only_store(machine: Machine) -> Iterator[Row]:
    with disk(machine.scratch / "disk", size_mb=ROOM_MB) as place:
        subprocess.run(["mount", "-o", "remount,ro", str(place)], check=True)
        for words, code in {
            ("metrics",): 0,
            ("catalogue",): 0,
            ("clean",): 0,
            ("dance", "{clip}", "--config", "smoke"): 1,
            ("find", str(CLIP.parent), "--source", "folder"): 1,
            ("refresh",): 1,
        }.items():
            found, err = machine.run(words, place, ROBOJACKSON_STORE=str(place))
            wrong = _refused(found, err, "Read-only") if code else ""
            wrong = wrong or ("" if found == code else f"expected {code}")
            yield Row("store read-only", words[0], found, _last(err, machine), wrong)


def pair(machine: Machine) -> Iterator[Row]:
    """Yield two dances of one clip at once in one store, and one alone.

    The second may be refused in one line while the first trains; repeated, it ends well.
    """
    place = Place(machine.scratch / "pair")
    place.wipe()
    alone = place.start().wait(1200)
    expected = place.tables()
    place.wipe()
    log = place.folder / "log.txt"
    log.unlink()
    both = [place.start(), place.start()]
    codes = [each.wait(1200) for each in both]
    refusals = log.read_text().count("another training is running there; wait for it to end")
    again = place.start().wait(1200)
    wrong = "" if place.tables() == expected else "other tables than one alone makes"
    if alone or again or sorted(codes) != [0, refusals] or refusals > 1:
        wrong = f"exit codes {alone}, {codes}, {again}; {refusals} refused"
    line = "one waits or is refused in one line" if refusals else ""
    yield Row("two processes on one store", "dance", again, line, wrong or ", ".join(place.left()))


def exits(machine: Machine, count: int) -> Iterator[Row]:
    """Yield a row for each command that loads MediaPipe, MuJoCo, PyTorch and JAX in a process of
    its own."""
    kinds = {
        "score": ("score", str(machine.clip)),
        "retarget": ("export", SMPL, "--to", "csv", "-o", "{out}/m.csv"),
        "train sbx": ("train", REFERENCE, "-o", "{out}", "--steps", "300", "--trainer", "sbx"),
    }
    for name, words in kinds.items():
        codes: Counter[int] = Counter()
        for number in range(count // len(kinds)):
            out = machine.scratch / f"e-{name}-{number}"
            given = [word.format(out=out) for word in words]
            done = subprocess.run(
                [sys.executable, "-m", "robojackson", *given], env=environment(), check=False,
                capture_output=True, cwd=machine.scratch,
            )  # fmt: skip
            codes[done.returncode] += 1
        result = ", ".join(f"{number} times {code}" for code, number in codes.items())
        yield Row("normal exits", name, max(codes), result, "" if set(codes) == {0} else result)


def _refused(code: int, err: str, says: str) -> str:
    own = [line for line in err.splitlines() if line.startswith("robojackson: ")]
    if code != 1:
        return f"exit code {code}"
    if "Traceback" in err or "InternalError" in err or len(own) != 1:
        return "not one line"
    return "" if says in own[0] else f"does not say {says!r}"


def _files(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


def _pages(file: Path) -> int:
    return max(-(-file.stat().st_size // PAGE), 1) * PAGE


def _last(err: str, machine: Machine | None = None) -> str:
    line = (err.splitlines() or [""])[-1]
    return line.replace(str(machine.scratch), "") if machine else line


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--only", default="disk,temporary,home,store,pair,exits")
    parser.add_argument("--exits", type=int, default=60)
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args()
    base()
    kinds = {"disk": full_disks, "temporary": temporary, "home": home, "store": read_only_store}
    rows, began = [], time.monotonic()
    with tempfile.TemporaryDirectory(prefix="robojackson-faults-") as scratch:
        machine = Machine(Path(scratch))
        for kind in options.only.split(","):
            made = exits(machine, options.exits) if kind == "exits" else None
            made = made or ({**kinds, "pair": pair}[kind])(machine)
            for row in made:
                rows.append(row)
                print("BAD" if row.wrong else "ok ", *asdict(row).values(), sep=" | ", flush=True)
            facts = {"command": f"python -m tests.chaos.faults --exits {options.exits}",
                    "rows": [asdict(row) for row in rows]}  # fmt: skip
            options.out.write_text(json.dumps(facts, indent=1) + "\n")
    bad = sum(bool(row.wrong) for row in rows)
    print(f"{len(rows)} faults, {bad} bad, {(time.monotonic() - began) / 60:.0f} minutes")
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
