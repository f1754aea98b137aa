"""The bookkeeping of one training run: task, budget, checkpoints, episodes, progress.

The rows of episodes contain no clock: repeating a run in steps gives the same table.
"""

import json
import logging
import time
from collections import deque
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from robojackson.errors import TrainingDiverged
from robojackson.rl import checkpoint_folder, walkers
from robojackson.rl.checkpoint_folder import newest_checkpoint, write_checkpoint
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.policy import Policy
from robojackson.rl.policy_facts import outline_facts, require_same_path
from robojackson.rl.tensorboard_log import LOGS, ScalarLog
from robojackson.rl.tqc.actor_average import ActorAverage
from robojackson.rl.tqc.network_arrays import Networks, Tensors
from robojackson.rl.tqc.trainer import Trainer
from robojackson.rl.training_budget import TrainingBudget
from robojackson.rl.training_hooks import BudgetSpent, Choice, Hooks, Row, as_trained
from robojackson.rl.training_task import Task, TrainResult

log = logging.getLogger(__name__)

RECENT_EPISODES = 100
RECENT_FIGURES = ("survived_s", "episode_return", "site_error_m")


class Run:
    """The bookkeeping of one training run: budget, checkpoints, episodes, progress.

    Everything happens between two rounds of updates, where the state of the trainer and of the
    environment is whole: a killed and resumed run ends like an uninterrupted one.
    """

    def __init__(
        self, out: Path, config: TrainConfig, core: TrackingCore, task: Task, hooks: Hooks
    ) -> None:
        self.out, self.config, self.core, self.task = out, config, core, task
        self._hooks, self._replay = hooks, out / checkpoint_folder.REPLAY
        self._recent: deque[Row] = deque(maxlen=RECENT_EPISODES)
        self._budget, self._has_learnt = TrainingBudget(config), False
        self._saved = self._reported = time.monotonic()
        self._scalars = ScalarLog(out / LOGS) if config.tensorboard else None
        self.callback = _Callback(self)
        self._average = ActorAverage(config.tqc.actor_average)

    def bind(self, trainer: Trainer) -> None:
        """Attach the trainer; continue from a checkpoint if there is one."""
        self.trainer, self._saved_updates = trainer, 0
        folder = newest_checkpoint(self.out)
        if folder is None:  # existing files without one are another training's
            checkpoint_folder.begin(self.out)
            return
        with checkpoint_folder.restoring(folder):
            state = json.loads((folder / "run.json").read_text())
            self.task.require_same(state["configuration"], self.task.identity(self.config), folder)
            require_same_path(self.out / "policy.safetensors", self.core.clip.outline)
            trainer.load(folder, self._replay, state["steps"], state["updates"])
            with np.load(folder / "environment.npz", allow_pickle=False) as arrays:
                self.core.restore(dict(arrays))
            self._average.load(folder)
            self.core.rng.bit_generator.state = state["random"]
            self._budget.resume(state["steps"], state["seconds"], state["cpu_seconds"])
            self._saved_updates = state["updates"]
        log.info("resuming at %d steps", state["steps"])

    def finished(self) -> str:
        """Return the budget that is used up, or an empty string."""
        return self._budget.used_up(self.trainer.steps())

    def episodes(self, rows: list[Row]) -> None:
        """Collect rows of finished episodes and report them."""
        steps, first = self.trainer.steps() + self.core.n, self.core.episode - len(rows) + 1
        for number, row in enumerate(rows, first):
            row |= {"step": steps, "episode": number}
        self._recent.extend(rows)
        self._hooks.sink(rows)

    def tick(self) -> None:
        """Save, report progress, or stop; called between two rounds.

        Raises:
            BudgetSpent: the budget is used up.
            TrainingDiverged: the actor's weights are not finite.
            KeyboardInterrupt: the caller stopped the run; a checkpoint was written.
        """
        now = time.monotonic()
        layers, updates = self.trainer.acting()
        self._require_finite(array for layer in layers for array in layer)
        self._average.add(layers, updates)
        if not self._has_learnt and self.trainer.updates() > self._saved_updates:
            self._has_learnt = True
            self._hooks.on_learning()
        try:
            started = self._budget.has_advanced(self.trainer.steps())
            if started and now - self._reported >= self.config.progress_seconds:
                self._reported = now
                self._report()
            if self._hooks.stop():
                raise KeyboardInterrupt
        except KeyboardInterrupt:
            self.checkpoint()
            raise
        if self.finished():
            raise BudgetSpent
        if now - self._saved >= self.config.checkpoint_seconds:
            self.checkpoint()
            self._saved = time.monotonic()

    def checkpoint(self, choice: Choice = as_trained) -> None:
        """Write the chosen policy and everything needed to continue, whole or not at all.

        Raises:
            TrainingDiverged: weights are not finite; nothing is written.
            StoreError: the folder cannot be written.
        """
        networks = self.require_finite()
        self._hooks.saving()
        write_checkpoint(self.out, self._save, self._results(networks, choice))
        self.trainer.saved()

    def require_finite(self) -> Tensors:
        """Return the networks.

        Raises:
            TrainingDiverged: values are not finite.
        """
        networks = self.trainer.networks()
        self._require_finite(networks.values())
        return networks

    def result(self) -> TrainResult:
        """Return the result of the run."""
        return TrainResult(
            self.out / "policy.safetensors",
            self.trainer.steps(),
            self.trainer.updates(),
            self._budget.seconds(),
            self.finished(),
        )

    def _save(self, folder: Path) -> None:
        """Write everything needed to continue into a folder."""
        self.trainer.save(folder, self._replay)
        np.savez(folder / "environment.npz", **self.core.state())
        self._average.save(folder)
        (folder / "run.json").write_text(json.dumps(self._state()))

    def _state(self) -> dict[str, object]:
        return {
            "configuration": self.task.identity(self.config),
            "steps": self.trainer.steps(),
            "updates": self.trainer.updates(),
            "seconds": self._budget.seconds(),
            "cpu_seconds": self._budget.cpu_seconds(),
            "random": self.core.rng.bit_generator.state,
        }

    def _results(self, networks: Tensors, choice: Choice) -> dict[str, bytes]:
        """Return the policy, and the networks that other trainings can start from."""
        facts, of_files = self._facts(), self.core.mode.of_files
        layers = self._average.layers(self.trainer.layers(), self.trainer.updates())
        kept = Networks(networks, facts).without_unseen(self.core.actor_size)
        return {
            "policy.safetensors": choice(Policy(layers, facts).with_first(of_files)).to_bytes(),
            checkpoint_folder.NETWORKS: kept.with_first(of_files).to_bytes(),
        }

    def _require_finite(self, arrays: Iterable[np.ndarray]) -> None:
        if all(np.isfinite(array).all() for array in arrays):
            return
        kept = newest_checkpoint(self.out)
        where = f"{kept} is older" if kept else "no checkpoint exists"
        raise TrainingDiverged(
            f"{self.out}: the training diverged: after {self.trainer.steps()} steps its networks "
            f"hold values that are not finite ({where}); take a lower tqc.learning_rate or another "
            "seed, in another folder"
        )

    def _facts(self) -> dict[str, object]:
        """Return the facts of the training."""
        config = self.config
        return {
            "robot": self.task.robot,
            "model_sha256": self.task.model_sha256,
            "reference_sha256": self.task.reference_sha256,
            "mode": config.mode,
            "trainer": config.trainer,
            "seed": config.seed,
            "setup": self._hooks.setup,
            "start": walkers.start_name(config.start),
            "curiosity": config.curiosity,
            "steps": self.trainer.steps(),
            "updates": self.trainer.updates(),
            "control": asdict(self.core.sim.control),
            "actuation": self.core.sim.actuation,
            "repeats": self.core.mode.repeats,
            **outline_facts(self.core.clip.outline),
            "environment": json.loads(json.dumps(asdict(self.core.config))),
        }

    def _report(self) -> None:
        status = self._status()
        if self._scalars is not None:
            rewards = {
                k for row in self._recent for k in row if k.startswith(("reward_", "train_"))
            }
            means = {key: float(np.mean([r[key] for r in self._recent])) for key in sorted(rewards)}
            self._scalars.add(int(status["steps"]), status | means)
        self._hooks.progress(status)

    def _status(self) -> Row:
        steps = self.trainer.steps()
        recent = list(self._recent)

        def mean(key: str) -> float:
            return float(np.mean([row[key] for row in recent])) if recent else float("nan")

        row = {"steps": steps, "updates": self.trainer.updates(), **self._budget.progress(steps)}
        return row | {name: mean(name) for name in RECENT_FIGURES}


class _Callback(BaseCallback):
    """Stable-Baselines3's callback: one call a round."""

    def __init__(self, run: Run) -> None:
        super().__init__()
        self._run = run

    def _on_rollout_start(self) -> None:
        self._run.tick()

    def _on_step(self) -> bool:
        return True
