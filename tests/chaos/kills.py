"""SIGKILL at random instants of whole dances, from the video to the page, Prefect included.

    python -m tests.chaos.kills [--kills 30] [--seed 0] [--folder FOLDER]

A dance (configuration `smoke`) is killed at an instant drawn over the time of an undisturbed run:
the command, the worker that does the work, or one of the processes that they started. Then it is
started again, and killed again, until a run comes to its end: its tables and networks must be byte
for byte those of the undisturbed run, no process and no temporary file left. Then the store is
emptied and the next dance begins. Linux only. Exit code 1 where anything differs.
"""

import argparse
import hashlib
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from robojackson.clips.trim import trim
from tests.chaos.trial import leftovers_in
from tools.stack.processes import Found, under
from tools.stack.service import ROOT

RESULTS = ROOT / "benchmarks" / "results" / "kills.json"
CLIP = ROOT / "clips" / "hip_shake.mp4"
LENGTH_S = 1.5
"""Of the clip that is danced."""
COMPARED = (".parquet", ".safetensors")
STAGES = (
    *("probe_video", "detect_landmarks", "score_stability", "recover_motion", "retarget_motion"),
    *("train_policy", "evaluate_policy", "evaluate_dance", "render_video", "draw_snapshot"),
    "write_page",
)
DIGEST = re.compile(r"(?<=^dances/clip)-[0-9a-f]{8}/")
CACHE = "torchinductor_"
"""PyTorch's cache of a user, which every process that imports it shares and keeps."""
QUIET_S, PATIENCE_S = 60.0, 900.0


@dataclass
class Kill:
    """One of them.

    Attributes:
        number: Number of the kill.
        moment_s: After the start of its run, seconds.
        victim: Process that was killed.
        done: Stages whose records were in the store.
        ended: How the command ended: by the signal, by itself with a code, or it went on.
    """

    number: int
    moment_s: float
    victim: str
    done: list[str]
    ended: str


@dataclass
class Dance:
    """A dance that was killed some times and came to its end.

    Attributes:
        kills: Those before its end.
        code: Exit code of the last run.
        different: Tables and networks that are not those of the undisturbed run.
        left: Processes and files that no one owns.
    """

    kills: list[Kill] = field(default_factory=list)
    code: int = -1
    different: list[str] = field(default_factory=list)
    left: list[str] = field(default_factory=list)

    @property
    def good(self) -> bool:
        return not (self.code or self.different or self.left)


class Place:
    """A home, a store and a folder for temporary files."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.home, self.store = folder, folder / "home", folder / "store"
        self.clip = folder / "clip.mp4"
        folder.mkdir(parents=True, exist_ok=True)
        trim(CLIP, 0.0, LENGTH_S, self.clip)

    def wipe(self) -> None:
        for name in ("home", "store", "tmp"):
            shutil.rmtree(self.folder / name, ignore_errors=True)
            (self.folder / name).mkdir()

    def start(self) -> subprocess.Popen[bytes]:
        own = {"HOME": str(self.home), "TMPDIR": str(self.folder / "tmp")}
        own |= {"ROBOJACKSON_STORE": str(self.store), "PYTHONPATH": str(ROOT)}
        host = {k: os.environ[k] for k in ("LANG", "PATH", "LD_LIBRARY_PATH") if k in os.environ}
        words = ("dance", str(self.clip), "--config", "smoke", "--trainer", "sb3", "--force")
        with (self.folder / "log.txt").open("ab") as log:
            return subprocess.Popen(
                [sys.executable, "-m", "robojackson", *words, "--json"], cwd=ROOT, stdout=log,
                stderr=log, env={**host, **own, "OMP_NUM_THREADS": "1"}, stdin=subprocess.DEVNULL,
            )  # fmt: skip

    def done(self) -> list[str]:
        return [name for name in STAGES if any((self.store / "records" / name).glob("*"))]

    def tables(self) -> dict[str, str]:
        """Return the digests of tables and networks by their names in the store.

        The name of a dance's folder ends with a digest of all its results, of which the log of the
        training has clock times; a dance has one folder, whatever its digest.
        """
        dances = [path.name for path in (self.store / "dances").glob("*")]
        found = {"dances": " ".join(name.rpartition("-")[0] for name in dances)}
        for file in self.store.rglob("*"):
            if file.suffix in COMPARED and file.is_file():
                name = DIGEST.sub("/", file.relative_to(self.store).as_posix(), count=1)
                found[name] = hashlib.sha256(file.read_bytes()).hexdigest()
        return found

    def different(self, expected: dict[str, str]) -> list[str]:
        found = self.tables()
        both = sorted(found.keys() | expected.keys())
        return [name for name in both if found.get(name) != expected.get(name)]

    def left(self) -> list[str]:
        """Return what is left when the processes have had time to end."""
        end = time.monotonic() + QUIET_S
        while under(self.home) and time.monotonic() < end:
            time.sleep(0.3)
        alive = [f"{found.pid} {found.command[:90]}" for found in under(self.home)]
        temporary = [
            path for path in (self.folder / "tmp").iterdir()
            if path.name[:1] != "." and not path.name.startswith(CACHE)
        ]  # fmt: skip
        return [*alive, *map(str, [*leftovers_in(self.store), *temporary])]


def killed(place: Place, number: int, rng: random.Random, usual_s: float) -> Kill | int:
    """Start a run and kill at a random instant; return its exit code where it was over before."""
    run = place.start()
    moment_s = rng.uniform(0.02, 1.0) * usual_s
    with suppress(subprocess.TimeoutExpired):
        return run.wait(moment_s)
    victim = _victim(rng, run.pid, under(place.home))
    done = place.done()
    os.kill(victim.pid, signal.SIGKILL)
    try:
        code = run.wait(PATIENCE_S)
    except subprocess.TimeoutExpired:
        run.kill()
        run.wait()
        code = 99
    ended = f"signal {-code}" if code < 0 else f"exit {code}"
    return Kill(number, round(moment_s, 1), _name(victim.command), done, ended)


def _victim(rng: random.Random, command: int, found: list[Found]) -> Found:
    """Return the command, its worker, or any other process, each with the same chance."""
    own = [each for each in found if each.pid == command]
    worker = [each for each in found if _parent(each.pid) == command]
    others = [each for each in found if each not in (*own, *worker)]
    return rng.choice(rng.choice([kind for kind in (own, worker, others) if kind]))


def _parent(pid: int) -> int:
    with suppress(OSError):
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    return 0


def _name(command: str) -> str:
    words = command.split()
    return " ".join(Path(word).name for word in words[1:4])[:60]


def campaign(place: Place, kills: int, seed: int, out: Path) -> list[Dance]:
    """Kill so often; write down what is known after every dance."""
    rng, dances, count = random.Random(seed), [Dance()], 0
    place.wipe()
    began = time.monotonic()
    if place.start().wait(PATIENCE_S):
        raise SystemExit(f"the undisturbed run failed: {place.folder / 'log.txt'}")
    usual_s, expected = time.monotonic() - began, place.tables()
    print(f"undisturbed: {usual_s:.0f} s, {len(expected)} tables and networks", flush=True)
    place.wipe()
    while count < kills or dances[-1].kills:
        if count < kills:
            ended = killed(place, count + 1, rng, usual_s)
        else:
            ended = place.start().wait(PATIENCE_S)
        now = dances[-1]
        if isinstance(ended, Kill):
            count += 1
            now.kills.append(ended)
            print(f"{asdict(ended)}", flush=True)
            if ended.ended != "exit 0":
                continue
            ended = 0
        now.code, now.different, now.left = ended, place.different(expected), place.left()
        print(f"dance after {len(now.kills)} kills: {'good' if now.good else now}", flush=True)
        _write(out, kills, seed, usual_s, len(expected), dances)
        place.wipe()
        dances.append(Dance())
    return dances[:-1]


def _write(
    out: Path, kills: int, seed: int, usual_s: float, tables: int, dances: list[Dance]
) -> None:
    done = [kill for dance in dances for kill in dance.kills]
    facts: dict[str, Any] = {
        "command": f"python -m tests.chaos.kills --kills {kills} --seed {seed}",
        "undisturbed_s": round(usual_s, 1),
        "tables_and_networks": tables,
        "kills": len(done),
        "resumed_to_equal_tables": sum(len(dance.kills) for dance in dances if dance.good),
        "dances": [asdict(dance) for dance in dances],
    }
    out.write_text(json.dumps(facts, indent=1) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--folder", type=Path, default=None, help="for logs and data")
    parser.add_argument("--out", type=Path, default=RESULTS, help="what has been shown, as JSON")
    options = parser.parse_args()
    folder = options.folder or Path(tempfile.mkdtemp(prefix="robojackson-kills-"))
    folder.mkdir(parents=True, exist_ok=True)
    dances = campaign(Place(folder.resolve()), options.kills, options.seed, options.out)
    bad = [dance for dance in dances if not dance.good]
    print(f"{len(dances) - len(bad)} of {len(dances)} dances good")
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
