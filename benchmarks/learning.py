"""What learning costs and what comes out of it (`make bench-learning`).

`speed`: our parts beside their peers, interleaved in one process on one core, in CPU time, so that
a busy machine changes both alike. `policies`: one row a move and a seed, trained for the row's
CPU minutes, judged on stock physics; a row that exists is not computed again, so that it may take
several sittings. Rows are Parquet with the command in `learning.json`.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from rich.console import Console
from rich.table import Table

from configs.loader import load
from robojackson.retarget.robot import RobotDescription, load_robot
from robojackson.rl.config import ControlConfig, PaperConfig, TqcConfig, TrackConfig
from robojackson.rl.physics import Simulation
from robojackson.rl.replay import buffer_of
from robojackson.rl.standing import standing
from robojackson.rl.tracking import TrackingCore
from robojackson.rl.trainer import make_trainer
from robojackson.rl.vec_env import TrackingVecEnv

ROOT = Path(__file__).parent.parent
RESULTS = Path(__file__).parent / "results"
ROWS = RESULTS / "learning"
SPEED = RESULTS / "learning_speed.json"
POLICIES = RESULTS / "learning.json"


@dataclass(frozen=True)
class Move:
    """A row of the table of policies: what it may cost and what it must show."""

    clip: str
    cpu_minutes: float
    success: float
    worst: float
    skill: float


MOVES = {
    "hip_shake": Move("clips/hip_shake.mp4", 10, 0.95, 0.85, 0.5),
    "walk": Move("clips/walk.mp4", 20, 0.90, 0.80, 0.6),
    "dance_b": Move("clips/dance_b.mp4", 40, 0.85, 0.70, 0.5),
}
HORIZONS_S = (10.0, 20.0)
LIMBS = ("left_foot", "right_foot", "left_hand", "right_hand", "head")


# ---- speed -------------------------------------------------------------------------------------


def speed(repeats: int, seconds: float) -> list[dict[str, Any]]:
    """One row a comparison: ours, the peer's, their ratio and the bar."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    load_average = os.getloadavg()[0]
    rows = [_updates(repeats, seconds), _paper_steps(repeats, seconds), _core(repeats)]
    return [{**row, "load_average": load_average} for row in rows]


def _updates(repeats: int, seconds: float) -> dict[str, Any]:
    """Gradient updates a CPU second at equal hyper-parameters, on the tracking observation."""
    tqc = TqcConfig(policy_delay=1, warmup=1)
    work = {name: _rounds(name, TrackConfig(threads=1), tqc) for name in ("sbx", "sb3")}
    ours, theirs = _interleaved(work, repeats, seconds)
    return _row("updates/s, sbx over sb3-contrib", ours, theirs, ours / theirs, ">= 4")


def _paper_steps(repeats: int, seconds: float) -> dict[str, Any]:
    """CPU seconds a step of paper mode: 348 observations, one update a step, same networks."""
    tqc = TqcConfig(preset="paper", warmup=1)
    work = {name: _rounds(name, PaperConfig(), tqc, step=True) for name in ("sbx", "sb3")}
    ours, theirs = (1 / rate for rate in _interleaved(work, repeats, seconds))
    return _row("paper mode, CPU s a step, sbx over sb3-contrib", ours, theirs, ours / theirs,
                "<= 0.45")  # fmt: skip


def _rounds(
    trainer_name: str, environment: TrackConfig | PaperConfig, tqc: TqcConfig, step: bool = False
) -> Callable[[], int]:
    """A function that does one round (its steps, too, where asked) and tells its updates."""
    robot = load_robot(load(RobotDescription, "robots/humanoid"))
    env = TrackingVecEnv(TrackingCore(robot, standing(robot), environment, tqc.n_envs, 0))
    trainer = make_trainer(trainer_name, env, tqc, seed=0)
    model: Any = trainer.model  # type: ignore[attr-defined]
    rng = np.random.default_rng(0)
    seen = env.reset()
    buffer = buffer_of(model)

    def act(action: np.ndarray) -> None:
        nonlocal seen
        after, reward, done, infos = env.step(action)
        buffer.add(seen, after, action, reward, done, infos)
        seen = after

    for _ in range(256):
        act(rng.uniform(-1, 1, (tqc.n_envs, env.core.action_size)))

    def one_round() -> int:
        for _ in range(tqc.steps_per_round if step else 0):
            act(model.predict(seen, deterministic=False)[0])
        model.train(tqc.updates_per_round, tqc.batch)
        if trainer_name == "sbx":
            import jax

            jax.block_until_ready(trainer._state())  # type: ignore[attr-defined]
        return tqc.updates_per_round

    one_round()
    return one_round


def _interleaved(
    work: Mapping[str, Callable[[], int]], repeats: int, seconds: float
) -> tuple[float, ...]:
    """Units a CPU second of each, turn by turn; the median over turns."""
    rates: dict[str, list[float]] = {name: [] for name in work}
    for _ in range(repeats):
        for name, one_round in work.items():
            began, done = time.process_time(), 0
            while time.process_time() - began < seconds:
                done += one_round()
            rates[name].append(done / (time.process_time() - began))
    return tuple(float(np.median(found)) for found in rates.values())


def _core(repeats: int, n: int = 16, steps: int = 60) -> dict[str, Any]:
    """Substeps a CPU second of the whole environment over a bare mj_step loop, same physics.

    The bare loop replays the controls that the environment wrote, from the same states, so that
    both compute the same contacts.
    """
    robot = load_robot(load(RobotDescription, "robots/humanoid"))
    ours, bare = [], []
    for _ in range(repeats):
        core = TrackingCore(robot, standing(robot), TrackConfig(threads=1), n, 0)
        core.reset()
        begin = np.concatenate([core.sim.qpos, core.sim.qvel], 1)
        spent, controls, kept = _run_core(core, steps)
        ours.append(kept / spent)
        bare.append(_run_bare(robot.model, begin, controls))
    a, b = float(np.median(ours)), float(np.median(bare))
    return _row("environment, substeps/s, over a bare mj_step loop", a, b, a / b, ">= 0.88")


def _run_core(core: TrackingCore, steps: int) -> tuple[float, list[np.ndarray], int]:
    """CPU seconds, controls of the first episodes (substep by substep), and substeps done."""
    controls: list[np.ndarray] = []
    original = core.sim._controls

    def spy(lo: int, hi: int, targets: np.ndarray) -> np.ndarray:
        found = original(lo, hi, targets)
        controls.append(found)
        return found

    core.sim._controls = spy  # type: ignore[method-assign]
    nothing = np.zeros((core.n, core.action_size))
    began = time.process_time()
    for _ in range(steps):
        core.step(nothing)
    return time.process_time() - began, controls, core.n * steps * core.sim.control.substeps


def _run_bare(model: mujoco.MjModel, begin: np.ndarray, controls: Sequence[np.ndarray]) -> float:
    datas = [mujoco.MjData(model) for _ in begin]
    for data, state in zip(datas, begin, strict=True):
        data.qpos[:], data.qvel[:] = state[: model.nq], state[model.nq :]
    began = time.process_time()
    for control in controls:
        for data, ctrl in zip(datas, control, strict=True):
            data.ctrl[:] = ctrl
            mujoco.mj_step(model, data)
    return len(datas) * len(controls) / (time.process_time() - began)


def threads(repeats: int = 5, n: int = 32, steps: int = 100) -> dict[str, Any]:
    """Wall time of one thread over two, on two cores that must be idle."""
    robot = load_robot(load(RobotDescription, "robots/humanoid"))
    motion = standing(robot)
    rates: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(repeats):
        for count, found in rates.items():
            sim = Simulation(robot, ControlConfig(), n, count)
            sim.place(np.arange(n), np.repeat(motion.qpos[:1], n, 0), np.zeros((n, 23)))
            targets = np.repeat(motion.qpos[:1, 7:][:, sim.motors.hinge], n, 0)
            began = time.perf_counter()
            for _ in range(steps):
                sim.step(targets)
            found.append(n * steps / (time.perf_counter() - began))
            sim.close()
    one, two = (float(np.median(found)) for found in rates.values())
    row = _row("environment steps/s, two threads over one (wall)", two, one, two / one, ">= 1.6")
    return {**row, "load_average": os.getloadavg()[0]}


def _row(name: str, ours: float, theirs: float, ratio: float, bar: str) -> dict[str, Any]:
    word, limit = bar.split()
    holds = ratio >= float(limit) if word == ">=" else ratio <= float(limit)
    return {"what": name, "ours": ours, "peer": theirs, "ratio": ratio, "bar": bar, "holds": holds}


# ---- policies ----------------------------------------------------------------------------------


def policy_row(name: str, seed: int, minutes: float | None) -> None:
    """Train one move with one seed and keep the rows of its evaluation; nothing if they exist."""
    move = MOVES[name]
    made = ROWS / f"{name}-s{seed}.parquet"
    if made.exists():
        return
    work = ROOT / "store" / "bench-learning" / name
    reference = work / "reference.parquet"
    if not reference.exists():
        _cli("mocap", move.clip, "-o", work)
        _cli("retarget", work / "smpl.parquet", "-o", work)
    out = work / f"s{seed}"
    budget = minutes or move.cpu_minutes
    options = ["--seed", seed, "--set", f"cpu_minutes={budget}", "--move", name]
    _cli("train", reference, "-o", out, *options, pinned=True)
    ROWS.mkdir(parents=True, exist_ok=True)
    for seconds in HORIZONS_S[::-1]:
        told = out / f"judged-{seconds:g}s"
        policy = out / "policy.safetensors"
        _cli("evaluate", policy, reference, "-o", told, "--seconds", seconds)
        suffix = "" if seconds == HORIZONS_S[0] else f"-{seconds:g}s"
        kept = ROWS / f"{name}-s{seed}{suffix}.parquet"
        kept.write_bytes((told / "evaluations.parquet").read_bytes())


def _cli(*words: object, pinned: bool = False) -> None:
    """One of our commands; `pinned` to one core, as the CPU minutes of a bar are meant."""
    command = [sys.executable, "-m", "flows.cli", *map(str, words)]
    if pinned:
        command = ["taskset", "-c", str(min(os.sched_getaffinity(0))), *command]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    subprocess.run(command, check=True, cwd=ROOT, env=environment)


def summary() -> list[dict[str, Any]]:
    """One line a move and a horizon over the seeds that there are."""
    rows = []
    for name, move in MOVES.items():
        for seconds in HORIZONS_S:
            suffix = "" if seconds == HORIZONS_S[0] else f"-{seconds:g}s"
            found = sorted(ROWS.glob(f"{name}-s?{suffix}.parquet"))
            if found:
                rows.append(_line(name, move, seconds, [_trained(path) for path in found]))
    return rows


def _trained(path: Path) -> list[dict[str, Any]]:
    from storage import tables
    from storage.schemas import EVALUATION_RECORD

    rows = tables.decode_rows(EVALUATION_RECORD, path.read_bytes(), str(path))
    return [row for row in rows if row["policy"] == "trained"]


def _line(
    name: str, move: Move, seconds: float, seeds: list[list[dict[str, Any]]]
) -> dict[str, Any]:
    mean = lambda key: [_mean([row.get(key) for row in rows]) for rows in seeds]  # noqa: E731
    success, skill = mean("strict_success"), mean("skill")
    low, high = cluster_interval(success)
    line = {
        "move": name,
        "cpu_minutes": move.cpu_minutes,
        "horizon_s": seconds,
        "seeds": len(seeds),
        "strict_success": float(np.mean(success)),
        "strict_success_95": [low, high],
        "worst_seed": float(np.min(success)),
        "survived_s": float(np.mean(mean("survived_s"))),
        "skill": float(np.mean(skill)),
        "bar": f">= {move.success:.2f} / {move.worst:.2f}, skill >= {move.skill}",
        "holds": bool(
            np.mean(success) >= move.success
            and np.min(success) >= move.worst
            and np.mean(skill) >= move.skill
        ),
    }
    for kind in ("limb_gain", "limb_r2", "excess_speed"):
        line[kind] = {limb: _mean(mean(f"{kind}_{limb}")) for limb in LIMBS}
    return line


def cluster_interval(by_seed: Sequence[float], draws: int = 2000) -> tuple[float, float]:
    """95 % interval of the mean by resampling seeds; rollouts of one seed are no evidence."""
    rng = np.random.default_rng(0)
    values = np.asarray(by_seed)
    means = rng.choice(values, (draws, len(values))).mean(1)
    return float(np.quantile(means, 0.025)), float(np.quantile(means, 0.975))


def _mean(values: Sequence[Any]) -> float | None:
    finite = [float(v) for v in values if v is not None and np.isfinite(v)]
    return float(np.mean(finite)) if finite else None


# ---- command -----------------------------------------------------------------------------------


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("speed", "threads", "policies", "table"), nargs="*")
    parser.add_argument("--moves", nargs="*", default=list(MOVES))
    parser.add_argument("--seeds", nargs="*", type=int, default=[0, 1, 2, 3, 4])
    parser.add_argument("--cpu-minutes", type=float, help="instead of the row's own")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=4.0, help="of CPU a turn")
    given = parser.parse_args()
    wanted = given.what or ["speed", "threads", "policies"]
    command = f"python -m benchmarks.learning {' '.join(sys.argv[1:])}".strip()
    if "threads" in wanted:
        _write(SPEED, [threads()], command)
    if "speed" in wanted:
        _write(SPEED, speed(given.repeats, given.seconds), command)
    if "policies" in wanted:
        for name in given.moves:
            for seed in given.seeds:
                policy_row(name, seed, given.cpu_minutes)
    if {"policies", "table"} & set(wanted):
        POLICIES.write_text(json.dumps({"command": command, "rows": summary()}, indent=1))
    _show()


def _write(path: Path, rows: list[dict[str, Any]], command: str) -> None:
    """Put rows in the place of those that told the same."""
    old = json.loads(path.read_text()) if path.exists() else []
    named = {row["what"]: row for row in old} | {
        row["what"]: {**row, "command": command} for row in rows
    }
    path.write_text(json.dumps(list(named.values()), indent=1))


def _show() -> None:
    console = Console()
    for path, columns in (
        (SPEED, ("what", "ours", "peer", "ratio", "bar", "holds", "load_average")),
        (POLICIES, ("move", "horizon_s", "seeds", "strict_success", "worst_seed", "skill",
                    "survived_s", "bar", "holds")),
    ):  # fmt: skip
        if path.exists():
            held = json.loads(path.read_text())
            rows = held["rows"] if isinstance(held, dict) else held
            table = Table(*columns)
            for row in rows:
                table.add_row(*(_cell(row[column]) for column in columns))
            console.print(table)


def _cell(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    main()
