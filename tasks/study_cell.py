"""One training of a study and its evaluation, as data that can go to a worker."""

from configs.study_config import Name, Seed, Setup
from robojackson.config import config_dataclass
from robojackson.rl.config.train_config import EvaluateConfig, TrainConfig
from storage.artifact import Artifact


@config_dataclass
class Cell:
    """A cell of the grid moves x setups x seeds.

    Attributes:
        study, move, setup, seed: What its rows are known by.
        reference: The motion.
        robot: Name of a configuration, or path of one where the cell runs.
        train, evaluate: Whole configurations.
        timeout_minutes, retries: As in `Study`.
    """

    study: Name
    move: Name
    setup: Setup
    seed: Seed
    reference: Artifact
    robot: str
    train: TrainConfig
    evaluate: EvaluateConfig
    timeout_minutes: float = 240.0
    retries: int = 2

    @property
    def name(self) -> str:
        """As runs and tables call it."""
        return f"{self.setup}-{self.move}-s{self.seed}"
