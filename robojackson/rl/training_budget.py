"""The budget of a training in steps, wall time and processor time, over all of its sittings."""

import time

from robojackson.rl.config.train_config import TrainConfig


class TrainingBudget:
    """Limits and use of a training's budget; a sitting begins when this object is created.

    Args:
        config: Configuration of the training: `steps`, `minutes` and `cpu_minutes`, None if
            unlimited.
    """

    def __init__(self, config: TrainConfig) -> None:
        self._config = config
        self._steps_before, self._before, self._cpu_before = 0, 0.0, 0.0
        self._began, self._cpu_began = time.monotonic(), time.process_time()

    def resume(self, steps: int, seconds: float, cpu_seconds: float) -> None:
        """Add the use of the previous sittings."""
        self._steps_before, self._before, self._cpu_before = steps, seconds, cpu_seconds

    def seconds(self) -> float:
        """Return the wall time of all sittings, seconds."""
        return self._before + time.monotonic() - self._began

    def cpu_seconds(self) -> float:
        """Return the processor time of all sittings, all threads together, seconds."""
        return self._cpu_before + time.process_time() - self._cpu_began

    def used_up(self, steps: int) -> str:
        """Return the name of the budget that is used up, or an empty string.

        Args:
            steps: Control steps of all sittings.
        """
        config = self._config
        if config.steps is not None and steps >= config.steps:
            return "steps"
        if config.minutes is not None and self.seconds() >= 60 * config.minutes:
            return "minutes"
        if config.cpu_minutes and self.cpu_seconds() >= 60 * config.cpu_minutes:
            return "cpu_minutes"
        return ""

    def has_advanced(self, steps: int) -> bool:
        """Return whether this sitting has made a step."""
        return steps > self._steps_before

    def progress(self, steps: int) -> dict[str, float]:
        """Return the time used, the rate of this sitting and the least time that is left.

        Returns:
            `seconds`, `steps_per_s` and `seconds_left`.
        """
        config, seconds = self._config, self.seconds()
        rate = (steps - self._steps_before) / max(seconds - self._before, 1e-9)
        left = [60 * config.minutes - seconds] if config.minutes else []
        if config.cpu_minutes:
            left.append(60 * config.cpu_minutes - self.cpu_seconds())
        if config.steps:
            left.append((config.steps - steps) / max(rate, 1e-9))
        return {"seconds": seconds, "steps_per_s": rate, "seconds_left": max(0.0, min(left))}
