"""The trainers by name: `sbx_trainer` (JAX, fast) and `sb3_trainer` (torch, the reference).

Configuration, tables and the policy file are equal. Importing this module imports neither.
"""

from typing import TYPE_CHECKING

from robojackson.errors import MissingDependency
from robojackson.rl.config.tqc_config import TqcConfig
from robojackson.rl.tqc.trainer import Trainer

if TYPE_CHECKING:
    from stable_baselines3.common.vec_env.base_vec_env import VecEnv


def make_trainer(
    name: str, env: "VecEnv", config: TqcConfig, seed: int, seen: int | None = None
) -> Trainer:
    """Return the named trainer.

    Args:
        seen: Number of first inputs of an observation that the actor sees; all when None. The
            critics see all.

    Raises:
        MissingDependency: JAX is not installed; the message has the remedy.
    """
    if name == "sb3":
        from robojackson.rl.tqc.sb3_trainer import Sb3Trainer

        return Sb3Trainer(env, config, seed, seen)
    try:
        from robojackson.rl.tqc.sbx_trainer import SbxTrainer
    except ImportError as error:
        raise MissingDependency(
            f"trainer 'sbx' needs JAX ({error}): pip install 'robojackson[fast]', or "
            "choose trainer sb3"
        ) from error
    return SbxTrainer(env, config, seed, seen)
