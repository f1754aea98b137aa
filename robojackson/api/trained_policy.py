"""Result of a training, with the table of its episodes."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from robojackson.api.arguments import FilePath
from robojackson.files import tables
from robojackson.files.file_tree import results_in
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.table_schemas import EPISODE_RECORD
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.policy import Policy

Audit = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, repr=False)
class TrainedPolicy:
    """Result of a training.

    Attributes:
        policy: The network as numpy arrays; `policy.act(observations)` gives actions, -1..1.
        reference: The motion that it follows.
        config: Configuration of the training.
        episodes: One row an episode: return, length, every reward term, tracking errors.
        steps, updates: Control steps and gradient updates in all.
        seconds: Wall time in all, resumptions included.
        stopped: `steps`, `minutes` or `cpu_minutes`: the budget that ended it.
        reward_audit: What the reward pays to bodies that do not dance, of a perfect dance's.
    """

    policy: Policy
    reference: ReferenceMotion
    config: TrainConfig
    episodes: list[dict[str, Any]]
    steps: int
    updates: int
    seconds: float
    stopped: str
    reward_audit: Audit

    def __repr__(self) -> str:
        return (
            f"TrainedPolicy(robot={self.reference.robot!r}, steps={self.steps:,}, "
            f"updates={self.updates:,}, {len(self.episodes)} episodes, {self.seconds:.0f} s, "
            f"stopped={self.stopped!r})"
        )

    def save(self, folder: FilePath) -> Path:
        """Write policy.safetensors, episodes.parquet, reference.parquet and training.json.

        Returns:
            The folder.

        Raises:
            StoreError: it cannot be written.
        """
        facts: dict[str, object] = {
            "steps": self.steps,
            "updates": self.updates,
            "seconds": self.seconds,
        }
        facts |= {"stopped": self.stopped, "seed": self.config.seed, "mode": self.config.mode}
        rows = tables.encode_rows(EPISODE_RECORD, self.episodes)
        with results_in(Path(folder)) as files:
            files.write("policy.safetensors", self.policy.to_bytes())
            files.write("episodes.parquet", rows)
            files.write("reference.parquet", self.reference.to_bytes())
            files.write("training.json", json.dumps(facts, indent=1).encode())
        return Path(folder)
