"""Measure how fast Ctrl-C is acknowledged and obeyed.

    python -m benchmarks.orchestration.interruption_times

Every command is started with an empty store and interrupted at moments spread over the time that it
takes, by turns with SIGINT and SIGTERM, to the process group and to the process alone. Bars:
acknowledged within 1 s, ended within 3 s; where a training saves its checkpoint, which the
acknowledgement must announce, within 30 s. Each end has exit code 130, no traceback, no process
left and no half-written file. Writes results/interruption.json.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from typing import Any

from tools.stack.interrupted_command import CLIP, LIMIT_S, ROOT, End, Running

RESULTS = Path(__file__).parents[1] / "results" / "interruption.json"
ACKNOWLEDGED_S, ENDED_S, SAVED_S = 1.0, 3.0, 30.0
FIRST_S = 0.05
"""The first moment: before, Python itself is starting."""
EARLIER = 0.8
"""Share of the usual duration of a command after which it is interrupted."""
WAYS = [(how, alone) for how in (signal.SIGINT, signal.SIGTERM) for alone in (False, True)]
LEARNING = ("--set=checkpoint_seconds=5", "--set=progress_seconds=1")


def commands(inputs: Path) -> dict[str, list[str]]:
    """Return every command that is measured; `OUT` stands for a folder of its own."""
    smpl, reference = str(inputs / "smpl.parquet"), str(inputs / "reference.parquet")
    policy = str(inputs / "policy.safetensors")
    dance = ["--config=smoke", "--set=train.steps=15000", "--set=train.checkpoint_seconds=5"]
    train = ["train", reference, "-o", "OUT", "--force", *LEARNING]
    return {
        "dance": ["dance", CLIP, *dance],
        "mocap": ["mocap", CLIP, "-o", "OUT"],
        "retarget": ["retarget", smpl, "-o", "OUT", "--video"],
        "train": [*train, "--steps=15000"],
        "train sb3": [*train, "--steps=4000", "--trainer=sb3"],
        "pretrain": ["pretrain", "-o", "OUT", "--steps=6000", *LEARNING],
        "evaluate": ["evaluate", policy, reference, "-o", "OUT"],
        "score": ["score", CLIP],
        "export": ["export", reference, "--to=csv", "-o", "OUT.csv"],
        "find": ["find", str(ROOT / "clips"), "--source=folder"],
        "refresh": ["refresh"],
        "ablation": ["ablation", "smoke", "--move=hip_shake", "--set=steps=3000"],
    }


def prepare(inputs: Path) -> None:
    """Make the motion and the policy that commands start from."""
    smpl, reference = str(inputs / "smpl.parquet"), str(inputs / "reference.parquet")
    for words in (
        ["mocap", CLIP, "-o", str(inputs)],
        ["retarget", smpl, "-o", str(inputs)],
        ["train", reference, "-o", str(inputs), "--steps=600", "--trainer=sb3", "--force"],
    ):
        subprocess.run([sys.executable, "-m", "robojackson", *words], check=True, cwd=ROOT)


def interrupted(
    words: Sequence[str], moment_s: float, how: signal.Signals, alone: bool
) -> End | None:
    """Run a command in a folder of its own and interrupt it; None if it has ended before."""
    with tempfile.TemporaryDirectory(prefix="robojackson-bench-") as name:
        running = Running(_placed(words, Path(name)), Path(name) / "store")
        try:
            running.process.wait(moment_s)
        except subprocess.TimeoutExpired:
            return running.end(running.interrupt(how, alone))
        return None


def duration_s(words: Sequence[str]) -> float:
    """Return the time that a command takes when nothing interrupts it, at most `LIMIT_S`."""
    with tempfile.TemporaryDirectory(prefix="robojackson-bench-") as name:
        running = Running(_placed(words, Path(name)), Path(name) / "store")
        try:
            running.process.wait(LIMIT_S)
        except subprocess.TimeoutExpired:
            running.interrupt()
            running.process.wait()
        return min(time.monotonic() - running.began, LIMIT_S)


def measure(words: Sequence[str], count: int, rng: random.Random) -> dict[str, Any]:
    """Interrupt a command at moments spread over its time; return seconds and faults."""
    takes_s = duration_s(words)
    ends: list[End] = []
    for number in range(count):
        moment = FIRST_S + (number + rng.random()) / count * (takes_s - FIRST_S)
        while (end := interrupted(words, moment, *WAYS[number % len(WAYS)])) is None:
            moment *= EARLIER
        ends.append(end)
    plain = [end for end in ends if not end.saving]
    saved = [end for end in ends if end.saving]
    acknowledged = [end.acknowledged_s for end in ends]
    return {
        "takes_s": round(takes_s, 1),
        "moments": len(ends),
        "acknowledged_s": _both(acknowledged),
        "ended_s": _both([end.ended_s for end in plain]),
        "saving": len(saved),
        "saved_and_ended_s": _both([end.ended_s for end in saved]),
        "faults": [fault for end in ends for fault in end.faults],
        "passed": all(_passes(end) for end in ends),
        "ends": [asdict(end) for end in ends],
    }


def _placed(words: Sequence[str], folder: Path) -> list[str]:
    """Return the words of a command, with a folder for its results."""
    return [word.replace("OUT", str(folder / "out")) for word in words]


def _passes(end: End) -> bool:
    limit = SAVED_S if end.saving else ENDED_S
    return end.acknowledged_s <= ACKNOWLEDGED_S and end.ended_s <= limit and not end.faults


def _both(seconds: list[float]) -> dict[str, float] | None:
    if not seconds:
        return None
    return {"max": round(max(seconds), 3), "median": round(median(seconds), 3)}


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--moments", type=int, default=8, help="of each command")
    parser.add_argument("--commands", nargs="*", help="only these")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    made: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(prefix="robojackson-bench-") as inputs:
        prepare(Path(inputs))
        for name, words in commands(Path(inputs)).items():
            if options.commands and name not in options.commands:
                continue
            how = {
                "command": " ".join(
                    ["python -m benchmarks.orchestration.interruption_times", *sys.argv[1:]]
                ),
                "date": datetime.now(UTC).isoformat(timespec="seconds"),
                "load_before": round(os.getloadavg()[0], 2),
            }
            made[name] = how | measure(words, options.moments, rng)
            shown = {key: value for key, value in made[name].items() if key != "ends"}
            print(name, json.dumps(shown), flush=True)
            for end in made[name]["ends"]:
                del end["lines"]
                end |= {
                    key: round(end[key], 3) for key in ("moment_s", "acknowledged_s", "ended_s")
                }
    known = json.loads(RESULTS.read_text())["commands"] if RESULTS.exists() else {}
    result = {"what": __doc__, "cores": os.cpu_count(), "commands": known | made}
    RESULTS.write_text(json.dumps(result, indent=1) + "\n")
    if not all(one["passed"] for one in made.values()):
        raise SystemExit("a bar is missed or an end has faults: see above")


if __name__ == "__main__":
    main()
