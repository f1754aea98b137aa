"""When the dancer imitates its experts and when it learns from rewards."""

import math
from pathlib import Path

from tools.dancer.expert_advice import Experts
from tools.dancer.ppo import LEAST_RATE, Trainer

DEVIATION = 0.06
"""Standard deviation of the actions of an imitating dancer, full actions."""
FIRST_RATE, LAST_RATE = 1e-3, 1e-4
"""Steps of Adam at the begin and the end of the imitation."""
LED_SHARE, LED_TIME = 0.3, 0.5
"""Share of the robots that experts lead at first; falls to none in that share of the imitation."""
NEAR, LAST_NEAR = 1.0, 0.1
"""Weight of the squared distance from the experts' advice, full actions, in imitation; and at the
end of what follows."""
READ_S = 10.0
"""Time between looks for new experts."""


class Lessons:
    """The plan of a training.

    Args:
        trainer: Whose settings it changes.
        folder: Of the experts' files.
        imitation_s, seconds: Time of the imitation, and of all.
    """

    def __init__(
        self,
        trainer: Trainer,
        experts: Experts,
        folder: Path,
        imitation_s: float,
        seconds: float,
    ) -> None:
        self._trainer, self._experts, self._folder = trainer, experts, folder
        self._imitation_s, self._seconds = imitation_s, seconds
        self._read_at, trainer.learning = 0.0, imitation_s <= 0
        if not trainer.learning:
            trainer.dancer.log_deviation.data.fill_(math.log(DEVIATION))

    def plan(self, now_s: float) -> bool:
        """Set what the next round does, some time after the beginning; return whether the imitation
        has just ended."""
        if now_s >= self._read_at:
            count = self._experts.take(self._folder)
            print(f"{now_s:.0f} s: {count} motions have an expert", flush=True)
            self._read_at = now_s + READ_S
        if now_s < self._imitation_s:
            self._imitate(now_s / self._imitation_s)
            return False
        rest = (now_s - self._imitation_s) / max(1.0, self._seconds - self._imitation_s)
        return self._learn(rest)

    def _imitate(self, part: float) -> None:
        trainer = self._trainer
        trainer.imitation = NEAR
        fall = 0.5 + 0.5 * math.cos(math.pi * part)
        trainer.set_rate(LAST_RATE + (FIRST_RATE - LAST_RATE) * fall)
        trainer.lead(LED_SHARE * max(0.0, 1.0 - part / LED_TIME))

    def _learn(self, part: float) -> bool:
        trainer = self._trainer
        trainer.imitation = NEAR * (LAST_NEAR / NEAR) ** part
        if trainer.learning:
            return False
        trainer.set_rate(LEAST_RATE)
        trainer.lead(0.0)
        trainer.learning = True
        return True
