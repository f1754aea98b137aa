"""Train the temporal network and its flow, and write the weights that ship.

    python -m tools.pairs MOTIONS... -o pairs          (an hour or more; see there)
    python -m tools.temporal.train_temporal pairs --motions MOTIONS... -o temporal.safetensors

Reads the pairs, makes a bank of motions without pictures (kept beside the pairs), fits
the lifter, then the flow. Seeded; the state is kept beside the weights every 100 steps, and the
same command goes on from there. Writes the weights (half precision), and REPORT.json and REPORT.png
with the curve and the validation. Motions outside the list of `tools/pairs/sources.py` are refused
when the pairs are made; pairs of others are refused here.
"""

import argparse
import json
import logging
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import load_file, save_file

from robojackson.errors import BadWeights
from robojackson.mocap.temporal.features import COUNT
from robojackson.mocap.temporal.temporal_network import ALSO, SHARE
from tools.pairs import sources
from tools.temporal import calibration, fit, truths
from tools.temporal.depth_errors import HARDER, Change
from tools.temporal.examples import Example, load
from tools.temporal.fit_flow import fit_flow
from tools.temporal.net import Flow, Lifter

log = logging.getLogger("train_temporal")
INVENTED, GESTURES = "invented", "gestures"


def check_motions(examples: list[Example]) -> None:
    """Refuse pairs of a motion that may not be trained on.

    Raises:
        RefusedMotion: such a motion.
    """
    for name in {part for example in examples for part in example.motion.split("+")}:
        if name not in (INVENTED, GESTURES):
            sources.check_allowed(Path(name))


def bank_of(folder: Path, motions: list[Path], count: int, seed: int) -> truths.Bank:
    """Return the motions without pictures, made once."""
    path = folder / f"bank-{seed}-{count}.npz"
    if not path.exists():
        log.info("making %d motions without pictures", count)
    return truths.kept(path, motions, count, seed)


def train(
    pairs: Path, motions: list[Path], out: Path, config: fit.FitConfig, count: int, seed: int,
    flow_steps: int, first: Path | None = None, first_share: float = 0.0,
    device: str = "cpu",
) -> dict[str, object]:  # fmt: skip
    """Fit lifter and flow; returns the report."""
    training, validation = load(pairs)
    check_motions(training + validation)
    log.info("%d clips to train on, %d to validate", len(training), len(validation))
    progress = fit.begin(training, config, seed, device)
    if first:
        begin_with(progress, first)
    state = out.with_suffix(".state.pt")
    resume(progress, state)

    def watch(now: fit.Progress, step_s: float) -> None:
        if now.step % 300 == 0 or now.step == config.steps:
            now.curve[-1] |= validated(fit.averaged(now), validation)
        keep(now, state)
        figures = ", ".join(f"{k} {v:.4g}" for k, v in now.curve[-1].items())
        log.info("%s; %.0f s left", figures, (config.steps - now.step) * step_s)

    bank = bank_of(pairs, motions, count, seed) if count else None
    where = fit.source(training, bank, device)
    fit.fit(progress, where, config, seed, watch)
    lifter = fit.averaged(progress)
    if first:
        mix_in(lifter, first, first_share)
    spreads = calibration.factors(lifter, validation[::2])
    calibration.apply(lifter, spreads)
    flow_curve: list[dict[str, float]] = []

    def watch_flow(step: int, losses: dict[str, float]) -> None:
        flow_curve.append({"step": step, **losses})
        log.info("flow %d: %s", step, ", ".join(f"{k} {v:.3g}" for k, v in losses.items()))

    flow = fit_flow(lifter, where, flow_steps, seed, watch_flow)
    save(lifter, flow, out)
    return {
        "clips": len(training), "frames": sum(len(e.truth) for e in training),
        "validation_clips": len(validation), "bank": len(bank or ()), "seed": seed,
        "spread_factors": spreads.round(3).tolist(),
        "config": asdict(config), "curve": progress.curve, "flow": flow_curve,
        "validation": validated(lifter, validation),
    }  # fmt: skip


def validated(lifter: Lifter, examples: list[Example]) -> dict[str, float]:
    """Return the figures of clips whose up is not known, and, `_known`, of those whose is."""
    plain, known = (
        [e for e in examples if bool(np.any(e.sight.up)) == which] for which in (False, True)
    )
    found = {f"{name}_known": value for name, value in fit.validate(lifter, known).items()}
    return fit.validate(lifter, plain) | found


def save(lifter: Lifter, flow: Flow, path: Path) -> None:
    """Write both networks to one file, half precision but for the normalisation of the input; the
    head for contacts only trains."""
    arrays = {n: v for n, v in lifter.state_dict().items() if not n.startswith("feet.")}
    arrays |= {f"flow.{name}": value for name, value in flow.state_dict().items()}
    keep_exact = ("mean", "scale")
    save_file(
        {
            n: v.contiguous() if n in keep_exact else v.half().contiguous()
            for n, v in arrays.items()
        },
        path,
    )


def begin_with(progress: fit.Progress, path: Path) -> None:
    """Take the lifter of a weights file as the first one; a file without a head for the ground
    leaves the fresh one."""
    arrays = widened(path)
    own = progress.net.state_dict()
    if other := [n for n, v in arrays.items() if n in own and v.shape != own[n].shape]:
        raise BadWeights(f"{path}: a lifter of another size ({other[0]}): set --width and --blocks")
    missing, unknown = progress.net.load_state_dict(arrays, strict=False)
    if unknown or any(not name.startswith(("ground.", "feet.")) for name in missing):
        raise BadWeights(f"{path}: not the lifter of this version: {[*missing, *unknown]}")
    for name, value in arrays.items():
        progress.mean[name].copy_(value)


def widened(path: Path) -> dict[str, torch.Tensor]:
    """Return the first lifter of a weights file; one that does not read up ignores it."""
    first = {n: v for n, v in load_file(path).items() if not n.startswith(("flow.", ALSO))}
    arrays = {n: v.float() for n, v in first.items() if n != SHARE}
    if extra := COUNT - len(arrays["mean"]):
        for name, value in (("mean", 0.0), ("scale", 1.0), ("enter.weight", 0.0)):
            arrays[name] = torch.nn.functional.pad(arrays[name], (0, extra), value=value)
    return arrays


def mix_in(lifter: Lifter, path: Path, share: float) -> None:
    """Move the lifter's weights by a share of the way back to those that it began with.

    Weights between the first and the trained ones err less on people unlike those of the training
    than either (Wortsman et al. 2022). The head for the ground stays as it is if it was fresh.
    """
    own = lifter.state_dict()
    for name, value in widened(path).items():
        if name in own:
            own[name].lerp_(value, share)


def keep(progress: fit.Progress, path: Path) -> None:
    """Write the state of the run."""
    content = {
        "step": progress.step, "net": progress.net.state_dict(), "mean": progress.mean,
        "optimiser": progress.optimiser.state_dict(), "curve": progress.curve,
    }  # fmt: skip
    torch.save(content, path.with_suffix(".tmp"))
    path.with_suffix(".tmp").rename(path)


def resume(progress: fit.Progress, path: Path) -> None:
    """Go on from a kept state, if there is one."""
    if not path.exists():
        return
    content = torch.load(path, weights_only=True, map_location=progress.net.mean.device)
    progress.step, progress.curve = content["step"], content["curve"]
    progress.net.load_state_dict(content["net"])
    progress.mean.update(content["mean"])
    progress.optimiser.load_state_dict(content["optimiser"])
    log.info("going on from step %d", progress.step)


def draw_curve(report: dict[str, object], path: Path) -> None:
    """Draw the curve as a picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    curve = report["curve"]
    assert isinstance(curve, list)
    figure, axes = pyplot.subplots(figsize=(7, 4))
    axes.plot([c["step"] for c in curve], [1e3 * c["place"] for c in curve], label="training")
    evaluated = [c for c in curve if "rr_network" in c]
    for key, label in (("rr_network", "validation"), ("pa_network", "validation, PA")):
        axes.plot([c["step"] for c in evaluated], [c[key] for c in evaluated], "o-", label=label)
    for key in ("rr_detector", "pa_detector"):
        axes.axhline(evaluated[-1][key], ls=":", c="grey")
    axes.set(xlabel="step", ylabel="MPJPE, mm (dotted: the detector)", ylim=(0, None))
    axes.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pairs", type=Path)
    parser.add_argument("--motions", type=Path, nargs="*", default=[])
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--report", type=Path, help="path without a suffix; default beside --out")
    parser.add_argument("--steps", type=int, default=fit.FitConfig().steps)
    parser.add_argument("--flow-steps", type=int, default=600)
    parser.add_argument("--first", type=Path, help="weights to begin with, as of a shorter run")
    parser.add_argument(
        "--first-share", type=float, default=0.4, help="share of them in the final weights"
    )
    for name in ("width", "blocks", "batch", "warm_up", "rate"):
        default = getattr(fit.FitConfig(), name)
        flag = "--" + name.replace("_", "-")
        parser.add_argument(flag, type=type(default), default=default)
    parser.add_argument("--harder", action="store_true", help="a detector that errs more")
    parser.add_argument("--invented", type=float, nargs=2, default=fit.FitConfig().invented)
    parser.add_argument("--device", default="cpu", help="cpu or cuda")
    parser.add_argument("--bank", type=int, default=6000)
    parser.add_argument("--seed", type=int, default=7)
    options = parser.parse_args(arguments)
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    torch.set_num_threads(1)
    config = fit.FitConfig(
        width=options.width, blocks=options.blocks, steps=options.steps, batch=options.batch,
        rate=options.rate, warm_up=options.warm_up, invented=tuple(options.invented),
        change=HARDER if options.harder else Change(),
    )  # fmt: skip
    report = train(
        options.pairs, options.motions, options.out, config, options.bank, options.seed,
        options.flow_steps, options.first, options.first_share, options.device,
    )  # fmt: skip
    target = options.report or options.out.with_suffix("")
    target.with_suffix(".json").write_text(json.dumps(report, indent=1) + "\n")
    draw_curve(report, target.with_suffix(".png"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
