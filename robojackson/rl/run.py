"""The bookkeeping of one training run: what is learnt, budget, checkpoints, episodes, progress."""

import json
import logging
import os
import shutil
import time
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from robojackson.errors import BadConfiguration, StoreError
from robojackson.motion.reference import ReferenceMotion, poses_sha256
from robojackson.retarget.robot import Robot
from robojackson.rl.config import TrainConfig
from robojackson.rl.policy import Policy
from robojackson.rl.tracking import TrackingCore
from robojackson.rl.trainer import Trainer

log = logging.getLogger(__name__)

Row = dict[str, float]
RECENT_EPISODES = 100


@dataclass(frozen=True)
class Task:
    """What is being learnt: a checkpoint of another one cannot be continued.

    Attributes:
        robot: Name of the robot.
        model_sha256: Digest of its MJCF.
        reference_sha256: Digest of the reference's poses.
    """

    robot: str
    model_sha256: str
    reference_sha256: str

    @staticmethod
    def of(reference: ReferenceMotion, robot: Robot) -> "Task":
        """The task of following a reference with a robot."""
        return Task(robot.description.name, robot.sha256, poses_sha256(reference))


@dataclass(frozen=True)
class TrainResult:
    """How a training run ended.

    Attributes:
        policy: The policy's file.
        steps, updates: Control steps and gradient updates in all.
        seconds: Wall time in all, resumptions included.
        stopped: `steps` or `minutes`: the budget that ended the run.
    """

    policy: Path
    steps: int
    updates: int
    seconds: float
    stopped: str


class Run:
    """The bookkeeping of one training run: budget, checkpoints, episodes, progress."""

    def __init__(
        self,
        out: Path,
        config: TrainConfig,
        core: TrackingCore,
        task: Task,
        progress: Callable[[Row], None],
        sink: Callable[[list[Row]], None],
    ) -> None:
        self.out, self.config, self.core, self.task = out, config, core, task
        self._progress, self._sink = progress, sink
        self._recent: deque[Row] = deque(maxlen=RECENT_EPISODES)
        self._episode, self._before = 0, 0.0
        self._began = self._saved = self._told = time.monotonic()
        self.callback = _Callback(self)

    def bind(self, trainer: Trainer) -> bool:
        """Attach the trainer; continue from a checkpoint and say so when there is one."""
        self.trainer = trainer
        folder = self._newest()
        if folder is None:
            self._first_step = 0
            return False
        state = json.loads((folder / "run.json").read_text())
        if state["configuration"] != self._identity():
            raise BadConfiguration(
                f"{folder} belongs to another configuration, reference motion or robot; "
                "remove it or choose another folder"
            )
        trainer.load(folder, state["steps"], state["updates"])
        self._before, self._episode = state["seconds"], state["episode"]
        self.core.rng.bit_generator.state = state["random"]
        self.core.starts.failures = np.array(state["failures"])
        self._first_step = state["steps"]
        log.info("resuming at %d steps", state["steps"])
        return True

    def seconds(self) -> float:
        return self._before + time.monotonic() - self._began

    def finished(self) -> str:
        """The budget that is used up, or an empty string."""
        if self.config.steps is not None and self.trainer.steps() >= self.config.steps:
            return "steps"
        if self.config.minutes is not None and self.seconds() >= 60 * self.config.minutes:
            return "minutes"
        return ""

    def episodes(self, rows: list[Row]) -> None:
        steps, seconds = self.trainer.steps(), self.seconds()
        for row in rows:
            self._episode += 1
            row |= {"step": steps, "episode": self._episode, "seconds": seconds}
        self._recent.extend(rows)
        self._sink(rows)

    def tick(self) -> bool:
        """Called every step; False when the budget is used up."""
        now = time.monotonic()
        if now - self._told >= self.config.progress_seconds:
            self._told = now
            self._progress(self._status())
        if now - self._saved >= self.config.checkpoint_seconds:
            self._saved = now
            self.checkpoint(with_replay=False)
        return not self.finished()

    def checkpoint(self, with_replay: bool) -> None:
        """Write the policy and everything needed to go on, whole or not at all."""
        fresh, final = self.out / "checkpoint.new", self.out / "checkpoint"
        part = self.out / "policy.safetensors.part"
        shutil.rmtree(fresh, ignore_errors=True)
        try:
            fresh.mkdir()
            self.trainer.save(fresh, with_replay)
            (fresh / "run.json").write_text(json.dumps(self._state()))
            part.write_bytes(self._policy().to_bytes())
        except OSError as error:
            shutil.rmtree(fresh, ignore_errors=True)
            part.unlink(missing_ok=True)
            raise StoreError(f"{self.out}: the checkpoint cannot be written ({error})") from error
        old = self.out / "checkpoint.old"
        shutil.rmtree(old, ignore_errors=True)
        if final.exists():
            final.rename(old)
        fresh.rename(final)
        shutil.rmtree(old, ignore_errors=True)
        os.replace(part, self.out / "policy.safetensors")

    def _newest(self) -> Path | None:
        """The last whole checkpoint: the one before when a crash came between two renames."""
        for name in ("checkpoint", "checkpoint.old"):
            if (self.out / name / "run.json").exists():
                return self.out / name
        return None

    def result(self) -> TrainResult:
        return TrainResult(
            self.out / "policy.safetensors",
            self.trainer.steps(),
            self.trainer.updates(),
            self.seconds(),
            self.finished(),
        )

    def _identity(self) -> dict[str, object]:
        """The configuration without the budget: what a checkpoint must share to be continued."""
        fields = asdict(self.config)
        for budget in ("steps", "minutes", "checkpoint_seconds", "progress_seconds"):
            del fields[budget]
        return json.loads(json.dumps(fields | {"task": asdict(self.task)}))

    def _state(self) -> dict[str, object]:
        return {
            "configuration": self._identity(),
            "steps": self.trainer.steps(),
            "updates": self.trainer.updates(),
            "seconds": self.seconds(),
            "episode": self._episode,
            "random": self.core.rng.bit_generator.state,
            "failures": self.core.starts.failures.tolist(),
        }

    def _policy(self) -> Policy:
        facts = {
            "robot": self.task.robot,
            "model_sha256": self.task.model_sha256,
            "reference_sha256": self.task.reference_sha256,
            "trainer": self.config.trainer,
            "seed": self.config.seed,
            "steps": self.trainer.steps(),
            "control": asdict(self.config.track.control),
        }
        return Policy(self.trainer.layers(), facts)

    def _status(self) -> Row:
        steps, seconds = self.trainer.steps(), self.seconds()
        rate = (steps - self._first_step) / max(seconds - self._before, 1e-9)
        left = [(60 * self.config.minutes) - seconds] if self.config.minutes else []
        if self.config.steps:
            left.append((self.config.steps - steps) / max(rate, 1e-9))
        recent = list(self._recent)
        mean = lambda key: float(np.mean([row[key] for row in recent])) if recent else np.nan  # noqa: E731
        return {
            "steps": steps,
            "updates": self.trainer.updates(),
            "seconds": seconds,
            "steps_per_s": rate,
            "seconds_left": max(0.0, min(left)),
            "survived_s": mean("survived_s"),
            "episode_return": mean("episode_return"),
            "site_error_m": mean("site_error_m"),
        }


class _Callback(BaseCallback):
    """Stable-Baselines3's hook: one call a step of all simulations."""

    def __init__(self, run: Run) -> None:
        super().__init__()
        self._run = run

    def _on_step(self) -> bool:
        return self._run.tick()
