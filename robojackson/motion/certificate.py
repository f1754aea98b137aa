"""The feasibility certificate of a reference motion: what the robot cannot do in it, and where.

A step is feasible when contact forces inside the friction cones and torques inside their limits
together produce the motion, but for a tolerance. Seconds, metres, newtons.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

Cause = Literal["torque", "no contact", "support", "fall rule"]


@dataclass(frozen=True)
class Finding:
    """Steps [start, end) that fail for one reason.

    Attributes:
        start, end: Steps.
        cause: torque, no contact, support (the body is not over its feet) or fall rule.
        what: The mj_joint, or what is missing, in words.
        repair: The smallest change that repairs it, in words.
    """

    start: int
    end: int
    cause: Cause
    what: str
    repair: str

    def __str__(self) -> str:
        return f"steps {self.start}-{self.end - 1}: {self.what}; {self.repair}"


@dataclass(frozen=True)
class Certificate:
    """Feasibility of a motion, a row a step.

    Attributes:
        slack: What is left over, in tolerances: feasible up to 1.
        tempo: Fastest tempo, beside the motion's own, at which the step is feasible; 0 where none.
        findings: The steps that fail, in order.
    """

    slack: Float[np.ndarray, " S"]
    tempo: Float[np.ndarray, " S"]
    findings: tuple[Finding, ...] = ()
