"""The motion of a robot in simulation, one row a control step."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robojackson.files.table_file import Columns, Facts, TableFile, numbered
from robojackson.files.table_types import F64, I32, WORLD, Column, TableSchema

ROLLOUT = TableSchema(
    "Rollout",
    "step",
    (
        Column("step", I32),
        Column("time_s", F64, "s"),
        Column("qpos", F64, "m, wxyz, rad", WORLD, None),
    ),
    ("dt",),
)


@dataclass(frozen=True, repr=False)
class Rollout(TableFile):
    """One run of a policy in simulation, world frame.

    Attributes:
        dt: Seconds a control step.
        qpos: MuJoCo positions, metres, wxyz, radians.
    """

    SCHEMA = ROLLOUT

    dt: float
    qpos: Float[np.ndarray, "S nq"]

    def __repr__(self) -> str:
        return f"Rollout({len(self.qpos)} steps of {1000 * self.dt:g} ms)"

    def to_columns(self) -> tuple[Columns, Facts]:
        """Return the columns and the metadata of the table."""
        columns = numbered("step", len(self.qpos), self.dt)
        return columns | {"qpos": self.qpos}, {"dt": self.dt}

    @classmethod
    def from_columns(cls, columns: Columns, facts: Facts) -> "Rollout":
        """Build the object from columns and metadata."""
        return cls(dt=float(facts["dt"]), qpos=columns["qpos"])
