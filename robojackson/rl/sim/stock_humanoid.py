"""Observation and reward of Gymnasium's Humanoid-v5, for every copy of a simulation.

The observation has 348 numbers for the humanoid: positions without the root's place over the floor,
velocities, inertias, body velocities, actuator forces and contact forces, with the original's lag
of one substep. Metres, radians, seconds, newtons.
"""

import numpy as np
from jaxtyping import Float

from robojackson.rl.sim.simulation import Simulation

FORWARD, HEALTHY, CONTROL, CONTACT, MOST_CONTACT = 1.25, 5.0, 0.1, 5e-7, 10.0
"""Weights of Humanoid-v5's reward, as gymnasium sets them."""
HEALTHY_HEIGHT = (1.0, 2.0)


def stock_observation(sim: Simulation) -> Float[np.ndarray, "N D"]:
    """Return the observation of Humanoid-v5 for every copy, float32."""
    rows = [
        np.concatenate(
            (
                data.qpos[2:],
                data.qvel,
                data.cinert[1:].ravel(),
                data.cvel[1:].ravel(),
                data.qfrc_actuator[6:],
                data.cfrc_ext[1:].ravel(),
            )
        )
        for data in sim.datas
    ]
    return np.array(rows, np.float32)


def stock_observation_size(nq: int, nv: int, bodies: int) -> int:
    """Return its length for a robot with given positions, velocities and bodies (world
    included)."""
    return nq - 2 + nv + 22 * (bodies - 1) + nv - 6


def own_reward(
    sim: Simulation, before: Float[np.ndarray, "N 3"], control: Float[np.ndarray, "N nu"]
) -> Float[np.ndarray, " N"]:
    """Return Humanoid-v5's reward of the last control step.

    Args:
        before: `sim.com` before the step.
        control: Controls that were written to `ctrl`.
    """
    low, high = HEALTHY_HEIGHT
    forward = FORWARD * (sim.com[:, 0] - before[:, 0]) / sim.dt
    healthy = HEALTHY * ((low < sim.qpos[:, 2]) & (sim.qpos[:, 2] < high))
    contact = CONTACT * np.array([np.sum(np.square(data.cfrc_ext)) for data in sim.datas])
    effort = CONTROL * np.sum(np.square(control), -1)
    result: np.ndarray = forward + healthy - effort - np.minimum(contact, MOST_CONTACT)
    return result


def bodies_now(sim: Simulation) -> Float[np.ndarray, "N nbody 3"]:
    """Return the origins of all bodies, the world's first, metres, world."""
    return np.array([data.xpos for data in sim.datas])


def mass_centres_now(sim: Simulation) -> Float[np.ndarray, "N 3"]:
    """Return centres of mass at the current `qpos`, metres, world."""
    mass = sim.model.body_mass / sim.model.body_mass.sum()
    result: np.ndarray = np.einsum("b,nbx->nx", mass, np.array([data.xipos for data in sim.datas]))
    return result


def spin_now(sim: Simulation) -> Float[np.ndarray, " N"]:
    """Return the sum over bodies of their angular speeds, rad/s."""
    spins = np.array([data.cvel[1:, :3] for data in sim.datas])
    result: np.ndarray = np.linalg.norm(spins, axis=-1).sum(-1)
    return result
