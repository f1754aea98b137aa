"""Training: one function for every trainer, resumable at any moment.

`out/checkpoint/` is the only state; the same call with the same configuration continues from it.
`out/policy.safetensors` is always the newest whole policy. What happens during training reaches
the caller as rows (episodes) and progress dictionaries; writing tables is the caller's affair.
"""

from collections.abc import Callable
from pathlib import Path

from robojackson.errors import BadConfiguration
from robojackson.motion.reference import ReferenceMotion
from robojackson.retarget.robot import Robot
from robojackson.rl.config import TrainConfig
from robojackson.rl.run import Row, Run, Task, TrainResult
from robojackson.rl.tracking import TrackingCore
from robojackson.rl.trainer import make_trainer
from robojackson.rl.vec_env import TrackingVecEnv

__all__ = ["TrainResult", "train"]


def train(
    reference: ReferenceMotion,
    robot: Robot,
    config: TrainConfig,
    out: Path,
    *,
    progress: Callable[[Row], None] = lambda row: None,
    sink: Callable[[list[Row]], None] = lambda rows: None,
) -> TrainResult:
    """Teach the robot to follow a reference motion.

    Args:
        progress: Called every few seconds with steps, rate, survival and the time left.
        sink: Called with one row for each episode that ended.
    Raises:
        BadConfiguration: neither `steps` nor `minutes` is given.
        KeyboardInterrupt: after a checkpoint with the replay buffer was written.
    """
    if config.steps is None and config.minutes is None:
        raise BadConfiguration("training needs a budget: steps, minutes or both")
    out.mkdir(parents=True, exist_ok=True)
    core = TrackingCore(robot, reference, config.track, config.tqc.n_envs, config.seed)
    task = Task.of(reference, robot)
    run = Run(out, config, core, task, progress, sink)
    env = TrackingVecEnv(core, run.episodes)
    trainer = make_trainer(config.trainer, env, config.tqc, config.seed)
    if run.bind(trainer):
        env.keep_random_state()
    try:
        if not run.finished():
            trainer.learn(run.callback)
        run.checkpoint(with_replay=False)
    except KeyboardInterrupt:
        run.checkpoint(with_replay=True)
        raise
    finally:
        env.close()
    return run.result()
