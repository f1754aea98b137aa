"""Run this deploy pack in MuJoCo: python run.py [--seconds S] [--view]. Ctrl-C damps and stops.

Feedback along a motion from an estimated root, and a network on top of it. Needs numpy, onnxruntime
and mujoco alone. README.md describes the interface of a real robot.
"""

import sys
from pathlib import Path

import numpy as np

from robojackson.formats.deploy.feedback_runner import Runner as FeedbackRunner
from robojackson.formats.deploy.runner import PARSER, main
from robojackson.formats.deploy.runner import Runner as NetworkRunner

PARSER.description = __doc__


class Runner(FeedbackRunner):
    """The network, the feedback and their motion; refuses parts that do not fit."""

    files = (*FeedbackRunner.files, "policy.onnx", "motion.npz")

    def load(self, folder: Path) -> None:
        """Load all three."""
        super().load(folder)
        NetworkRunner.load(self, folder)

    def aimed(self, ahead: dict[str, np.ndarray], *measured: np.ndarray) -> np.ndarray:
        """Return the targets of the network, which the feedback moves."""
        return self.act(*measured)


if __name__ == "__main__":
    sys.stdout.write(main(**vars(PARSER.parse_args()), kind=Runner) + "\n")
