"""Inverse dynamics of many steps at once, with analytic derivatives.

Spatial vectors about the world's origin, angular part first; a step's cost is linear in the number
of degrees of freedom for the force and quadratic for its derivatives (Singh, Russo and Wensing,
"Efficient analytical derivatives of rigid-body dynamics using spatial vector algebra", 2022). With
psi' = v x S, psi'' = a x S + v x psi' of the parent's velocity and acceleration:

    d tau_j / d q_i  = S_j . (I_j psi''_i + B_j psi'_i)                   i above j, or j itself
                     = S_j . (S_i x* f_i + I_i psi''_i + B_i psi'_i)      j above i
    d tau_j / d q'_i = S_j . (I_m (psi'_i + S'_i) + B_m S_i)              m the lower of the two
    d tau_j / d q''_i = S_j . I_m S_i

I, B and f are those of all bodies that a degree of freedom moves. Tangent space of MuJoCo; metres,
radians, seconds, newtons.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from robojackson.retarget.feasibility.force_model import ForceModel
from robojackson.retarget.feasibility.spatial_vectors import (
    Pair,
    Vector,
    add_diagonal,
    added,
    apply,
    cross,
    cross_force,
    cross_motion,
    dot,
    product,
)
from robojackson.robot.tree_kinematics import Posed

_CHUNK = 200  # steps whose matrices stay in the cache


@dataclass(frozen=True)
class Slopes:
    """Force of inverse dynamics and its derivatives, one matrix a step; row: force, column: dof."""

    force: Float[np.ndarray, "N nv"]
    position: Float[np.ndarray, "N nv nv"]
    velocity: Float[np.ndarray, "N nv nv"]
    acceleration: Float[np.ndarray, "N nv nv"]


@dataclass(frozen=True)
class Dynamics:
    """Inverse dynamics of many steps: the force, and what its derivatives are computed from.

    Attributes:
        force: In free space (`mj_inverse` without constraints).
    """

    force: Float[np.ndarray, "N nv"]
    _model: ForceModel
    _parts: list[tuple[slice, "_Moving", "_Load"]]

    def slopes(self) -> Slopes:
        """Return the force and its derivatives."""
        model, (count, unknowns) = self._model, self.force.shape
        square = (count, unknowns, unknowns)
        out = Slopes(self.force, np.empty(square), np.empty(square), np.empty(square))
        for rows, moving, load in self._parts:
            _differentiate(model, moving, load, out, rows)
        unit = np.arange(unknowns)
        out.position[:, unit, unit] += model.stiffness
        out.velocity[:, unit, unit] += model.damping
        out.acceleration[:, unit, unit] += model.armature
        return out


def dynamics(
    model: ForceModel,
    posed: Posed,
    hinges: Float[np.ndarray, "N J"],
    speed: Float[np.ndarray, "N nv"],
    rate: Float[np.ndarray, "N nv"],
) -> Dynamics:
    """Return the inverse dynamics of steps at generalised velocities and accelerations."""
    force = np.empty(speed.shape)
    parts = []
    for start in range(0, len(speed), _CHUNK):
        rows = slice(start, min(start + _CHUNK, len(speed)))
        moving = _moving(model, posed, rows, speed[rows], rate[rows])
        load = _loads(model, _bodies(model, posed, rows, moving))
        force[rows] = (dot(moving.axis, load.moment) + dot(moving.arm, load.push)).T
        parts.append((rows, moving, load))
    force += model.damping * speed + model.armature * rate
    force[:, 6:] += model.stiffness[6:] * (hinges - model.spring)
    return Dynamics(force, model, parts)


class _Moving(NamedTuple):
    """Screws of the dofs, velocity and acceleration of their links and of those above them."""

    axis: Vector
    arm: Vector
    velocity: Pair
    acceleration: Pair
    velocity_above: Pair
    acceleration_above: Pair

    @property
    def screws(self) -> Pair:
        """Axes and moments about the origin."""
        return self.axis, self.arm


class _Load(NamedTuple):
    """First moment, inertia about the origin, B, momentum and force of every body, or of all
    bodies that a dof moves."""

    mass: np.ndarray
    first: Vector
    inertia: np.ndarray
    bend: np.ndarray
    momentum: Vector
    moment: Vector
    push: Vector

    def times(self, motion: Pair) -> Pair:
        """Return the inertia times a motion."""
        turn, shift = motion
        return (
            apply(self.inertia, turn) + cross(self.first, shift),
            self.mass * shift - cross(self.first, turn),
        )

    def bends(self, turn: Vector) -> Pair:
        """Return B times a motion: only its angular part counts."""
        return apply(self.bend, turn), -2 * cross(self.momentum, turn)


def _differentiate(
    model: ForceModel, moving: _Moving, load: _Load, out: Slopes, rows: slice
) -> None:
    screws = moving.screws
    first = cross_motion(moving.velocity_above, screws)
    second = added(
        cross_motion(moving.acceleration_above, screws),
        cross_motion(moving.velocity_above, first),
    )
    turning = added(first, cross_motion(moving.velocity, screws))
    inertia = load.times(screws)
    bent = apply(load.bend.swapaxes(0, 1), moving.axis) + 2 * cross(load.momentum, moving.arm)
    down = added(added(cross_force(screws, (load.moment, load.push)), load.times(second)),
                load.bends(first[0]))  # fmt: skip
    spun = added(load.times(turning), load.bends(moving.axis))
    left, screw = _wide(*inertia, bent).swapaxes(1, 2), _wide(*screws).swapaxes(1, 2)
    position, velocity, mass = out.position[rows], out.velocity[rows], out.acceleration[rows]
    np.matmul(left, _wide(*second, first[0]), out=position)
    position *= model.above.T
    position += (screw @ _wide(*down)) * model.below
    np.matmul(left, _wide(*turning, moving.axis), out=velocity)
    velocity *= model.above.T
    velocity += (screw @ _wide(*spun)) * model.below
    found = (screw @ _wide(*inertia)) * model.upper
    np.add(found, found.swapaxes(1, 2) * model.below.T, out=mass)


def _moving(
    model: ForceModel, posed: Posed, rows: slice, speed: np.ndarray, rate: np.ndarray
) -> _Moving:
    axis, arm = (np.ascontiguousarray(part[rows].transpose(1, 2, 0)) for part in posed.screws)
    still, weight = np.zeros((3, 1)), -model.gravity[:, None]
    pace, gain = speed.T, rate.T
    velocity = _summed(model, (axis * pace, arm * pace), (still, still))
    turned = cross_motion(velocity, (axis, arm))
    steps = (axis * gain + turned[0] * pace, arm * gain + turned[1] * pace)
    acceleration = _summed(model, steps, (still, weight))
    return _Moving(
        axis,
        arm,
        velocity,
        acceleration,
        _above(model, velocity, (still, still)),
        _above(model, acceleration, (still, weight)),
    )


def _summed(model: ForceModel, parts: Pair, start: Pair) -> Pair:
    """Return the sums down the tree: of each link, what its own and all dofs above it add."""
    out = (np.empty_like(parts[0]), np.empty_like(parts[1]))
    for total, part, first in zip(out, parts, start, strict=True):
        total[:, :3] = (first + part[:, :3].sum(axis=1))[:, None]
        total[:, 3:6] = total[:, :1] + part[:, 3:6].sum(axis=1)[:, None]
        for dof in range(6, part.shape[1]):
            np.add(total[:, model.parent[dof]], part[:, dof], out=total[:, dof])
    return out


def _above(model: ForceModel, moving: Pair, start: Pair) -> Pair:
    """Return the value of the link above each dof's own."""
    out = (moving[0][:, model.parent], moving[1][:, model.parent])
    for part, first in zip(out, start, strict=True):
        part[:, :3] = first[:, None]
    return out


def _bodies(model: ForceModel, posed: Posed, rows: slice, moving: _Moving) -> _Load:
    pick, last = model.bodies, model.last_dof
    turn = np.ascontiguousarray(posed.body_rot[rows, pick].transpose(2, 3, 1, 0))
    at = posed.body_pos[rows, pick].transpose(2, 1, 0) + apply(turn, model.com.T[..., None])
    mass = model.mass[:, None]
    first = mass * at
    own = model.inertia.transpose(1, 2, 0)[..., None]
    inertia = product(product(turn, own), turn.swapaxes(0, 1)) - first[:, None] * at[None]
    add_diagonal(inertia, dot(first, at))
    spin, drift = (part[:, last] for part in moving.velocity)
    turned, pushed = (part[:, last] for part in moving.acceleration)
    momentum = mass * drift - cross(first, spin)
    angular = apply(inertia, spin) + cross(first, drift)
    push = mass * pushed - cross(first, turned) + cross(spin, momentum)
    moment = apply(inertia, turned) + cross(first, pushed)
    moment += cross(spin, angular) + cross(drift, momentum)
    doubled = 2 * inertia
    add_diagonal(doubled, -(inertia[0, 0] + inertia[1, 1] + inertia[2, 2]))
    bend = np.stack([cross(spin, doubled[:, k]) for k in range(3)], axis=1)
    bend -= 2 * drift[:, None] * first[None]
    add_diagonal(bend, 2 * dot(first, drift))
    return _Load(mass, first, inertia, bend, momentum, moment, push)


def _loads(model: ForceModel, own: _Load) -> _Load:
    """Return the sums up the tree: of each dof, those of all bodies that it moves."""
    flat = [part.reshape(-1, *part.shape[-2:]) for part in own[1:]]
    joined = np.concatenate(flat)
    total = np.zeros((len(joined), len(model.parent), joined.shape[-1]))
    for body, dof in enumerate(model.last_dof):
        total[:, dof] += joined[:, body]
    for dof in range(len(model.parent) - 1, 5, -1):
        total[:, model.parent[dof]] += total[:, dof]
    total[:, :5] = total[:, 5:6]
    parts = np.split(total, np.cumsum([len(part) for part in flat])[:-1])
    for index in (1, 2):
        parts[index] = parts[index].reshape(3, 3, *total.shape[1:])
    return _Load(model.carried_mass[:, None], *parts)


def _wide(*parts: Vector) -> Float[np.ndarray, "N K nv"]:
    """Return the components as rows, dofs as columns of a matrix a step."""
    return np.ascontiguousarray(np.concatenate(parts).transpose(2, 0, 1))
