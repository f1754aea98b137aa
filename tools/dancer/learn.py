"""Teach the dancer: one policy that follows every motion of a pack and its mirror image.

    pip install -r tools/dancer/requirements.txt
    python -m tools.dancer.learn PACK.npz -o OUT [--seconds 480] [--robots 8192] [--seed 0]
        [--start OUT/dancer.npz] [--device cuda] [--sees everything]
        [--experts EXPERTS --imitate 240]

OUT gets, every minute and at the end, `dancer.npz`, which a training goes on from, and
`average.npz`, the moving average of its networks; and `curve.csv`, a row every twenty rounds.
With experts (`tools.dancer.experts`) the network imitates them first for some seconds (DAgger), and
keeps near to them while it learns from rewards; files of experts that come meanwhile are read,
and `imitated.npz` is the average at the end of the imitation.
`tools.dancer.ship` writes the tracker's file. An H100 does 380,000 control
steps a second; `--device cpu`, which needs no Warp, a thousand.
"""

import argparse
import csv
import time
from pathlib import Path

import numpy as np
import torch
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from tools.dancer.expert_advice import Experts
from tools.dancer.imitation import Lessons
from tools.dancer.mujoco_robots import MujocoRobots, Robots
from tools.dancer.network import HIDDEN, Dancer, hidden_of, restore, save
from tools.dancer.ppo import Trainer
from tools.dancer.rehearsal import Rehearsal

HORIZON, REPORT_ROUNDS, SAVE_S, JUDGED_S = 16, 20, 60.0, 8.0
FIRST_RATE, LATER_RATE = 1e-3, 2e-5
AVERAGE = 0.995
"""Decay of the networks' moving average, a round: some seventy seconds of an H100."""


def robots_on(device: str, pack: dict[str, np.ndarray], n: int) -> Robots:
    """Return N robots that a device simulates."""
    if device == "cpu":
        return MujocoRobots(pack, n)
    from tools.dancer.warp_robots import WarpRobots

    return WarpRobots(pack, n, device)


@torch.no_grad()
def survival(rehearsal: Rehearsal, dancer: Dancer, seconds: float) -> float:
    """Return the share of robots, begun anywhere without pushes, that are not lost within the time
    or before the end of their motion."""
    rehearsal.calm(rehearsal.anywhere())
    done = torch.zeros(rehearsal.n, dtype=torch.bool, device=rehearsal.seen.device)
    lost = done.clone()
    for _ in range(round(seconds / rehearsal.motions.dt)):
        outcome = rehearsal.step(dancer.act(dancer.scale(rehearsal.seen)))
        lost |= outcome.lost & ~done
        done |= outcome.lost | outcome.over
    return 1.0 - float(lost.float().mean())


def main() -> None:
    """Train until the time is over."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pack", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--seconds", type=float, default=480.0)
    parser.add_argument("--robots", type=int, default=8192)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--start", type=Path)
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--sees", choices=["sensors", "everything"], default="sensors")
    parser.add_argument("--hidden", nargs="+", type=int, default=HIDDEN, help="widths of layers")
    parser.add_argument("--experts", type=Path)
    parser.add_argument("--imitate", type=float, default=0.0, help="seconds of imitation at first")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(given.seed)
    torch.set_float32_matmul_precision("high")
    with np.load(given.pack) as file:
        pack = {name: file[name] for name in file.files}
    robots = robots_on(given.device, pack, given.robots)
    rehearsal = Rehearsal(pack, robots, given.device, given.seed, given.sees == "everything")
    size, motors = rehearsal.seen.shape[1], rehearsal.action.shape[1]
    hidden = hidden_of(given.start) if given.start else tuple(given.hidden)
    dancer = Dancer(rehearsal.sight.actor_size, size, motors, hidden)
    steps = restore(dancer, given.start) if given.start else 0
    rate = LATER_RATE if given.start else FIRST_RATE
    experts = Experts(pack, rehearsal.motions, given.device) if given.experts else None
    trainer = Trainer(dancer.to(given.device), rehearsal, HORIZON, rate, experts)
    lessons = None
    if experts is not None:
        lessons = Lessons(trainer, experts, given.experts, given.imitate, given.seconds)
    average = averaged(dancer)
    steps = learn(trainer, average, lessons, given.out, given.seconds, steps)
    assert isinstance(average.module, Dancer)
    for name, one in (("last", dancer), ("average", average.module)):
        held = survival(rehearsal, one, JUDGED_S)
        line = f"{steps} steps, {name} networks: of robots begun anywhere {held:.3f} hold"
        print(f"{line} {JUDGED_S:g} s", flush=True)


def averaged(dancer: Dancer) -> AveragedModel:
    """Return the moving average of a dancer's networks and of its scale of the observations."""
    return AveragedModel(dancer, multi_avg_fn=get_ema_multi_avg_fn(AVERAGE), use_buffers=True)


def learn(
    trainer: Trainer,
    average: AveragedModel,
    lessons: Lessons | None,
    out: Path,
    seconds: float,
    steps: int,
) -> int:
    """Go on round by round; report, average and save; return the control steps so far."""

    def keep() -> None:
        save(trainer.dancer, out / "dancer.npz", steps)
        save(average.module, out / "average.npz", steps)

    began = saved = time.monotonic()
    number = 0
    with (out / "curve.csv").open("a", newline="") as file:
        table = csv.writer(file)
        while time.monotonic() - began < seconds:
            if lessons is not None and lessons.plan(time.monotonic() - began):
                save(average.module, out / "imitated.npz", steps)
            figures = trainer.round()
            average.update_parameters(trainer.dancer)
            steps, number = steps + trainer.round_steps, number + 1
            if number % REPORT_ROUNDS == 1:
                row = {"seconds": time.monotonic() - began, "steps": steps, **figures}
                if file.tell() == 0:
                    table.writerow(row)
                table.writerow([f"{value:.5g}" for value in row.values()])
                file.flush()
                print(" ".join(f"{key} {value:.4g}" for key, value in row.items()), flush=True)
            if time.monotonic() - saved > SAVE_S:
                keep()
                saved = time.monotonic()
    keep()
    return steps


if __name__ == "__main__":
    main()
