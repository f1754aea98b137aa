"""The paper's reward, term by term: pure functions of states and their reference.

    r = -lambda sum_j w_j |p_j - p_ref_j|^2 / sum_j w_j  +  3.0 max(0, z . g)
        + 2.0 / (1 + |COM_xy - pelvis_xy|)  +  beta sum_i |q'_i|  -  200 at a fall

Distances in metres, speeds in rad/s. The paper does not define whether the points are compared in
the world or relative to the root; this changes the task, so both are computed.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from robojackson.rl.config.paper_config import BETA, PaperConfig


@dataclass(frozen=True)
class PaperState:
    """State of N robots that the reward uses.

    Attributes:
        points: The named points, world, metres.
        root: Positions of the pelvis body, world, metres.
        com: Centres of mass, world, metres.
        upright: z . g, the torso's axis against gravity.
        height: Height of the torso, metres.
        hinge_speed: Speeds of the hinges, rad/s.
        spin: Sum over bodies of their angular speeds, rad/s.
    """

    points: Float[np.ndarray, "N P 3"]
    root: Float[np.ndarray, "N 3"]
    com: Float[np.ndarray, "N 3"]
    upright: Float[np.ndarray, " N"]
    height: Float[np.ndarray, " N"]
    hinge_speed: Float[np.ndarray, "N J"]
    spin: Float[np.ndarray, " N"]


@dataclass(frozen=True)
class Miss:
    """Weighted mean squared distance of the points, m^2, in both readings of the paper."""

    root: Float[np.ndarray, " N"]
    world: Float[np.ndarray, " N"]


def ramp(episode: int, config: PaperConfig) -> float:
    """Return lambda of an episode: max(lambda_min, lambda_max * min(1, episode / 1000))."""
    share = min(1.0, episode / config.ramp_episodes)
    return max(config.lambda_min, config.lambda_max * share)


def miss(
    state: PaperState,
    target: Float[np.ndarray, "N P 3"],
    target_root: Float[np.ndarray, "N 3"],
    weights: Float[np.ndarray, " P"],
) -> Miss:
    """Return the distances of the points from the reference's."""
    apart = state.points - target
    carried = apart - (state.root - target_root)[:, None]

    def mean(distance: np.ndarray) -> np.ndarray:
        found: np.ndarray = np.sum(distance**2, -1) @ weights / weights.sum()
        return found

    return Miss(mean(carried), mean(apart))


def has_fallen(state: PaperState, config: PaperConfig) -> Bool[np.ndarray, " N"]:
    """Return whether robots have fallen: the torso below 0.7 m or tilted over 60 degrees."""
    tilted = state.upright < np.cos(min(config.fall_tilt, np.pi)) - 1e-12
    result: np.ndarray = (
        (state.height < config.fall_height) | tilted | (state.height > config.highest)
    )
    return result


def paper_terms(
    state: PaperState,
    apart: Miss,
    fell: Bool[np.ndarray, " N"],
    lambda_: float,
    config: PaperConfig,
) -> dict[str, Float[np.ndarray, " N"]]:
    """Return named terms whose sum is the reward without Humanoid-v5's own."""
    chosen = apart.root if config.relative == "root" else apart.world
    offset = np.linalg.norm(state.com[:, :2] - state.root[:, :2], axis=-1)
    terms = {
        "imitation": -lambda_ * config.imitation * chosen,
        "upright": config.upright * np.maximum(0.0, state.upright),
        "balance": config.balance / (1.0 + offset),
        "fall": -config.fall_penalty * fell,
    }
    if config.curiosity != "off":
        terms["curiosity"] = BETA[config.curiosity] * speed(state, config)
    return terms


def speed(state: PaperState, config: PaperConfig) -> Float[np.ndarray, " N"]:
    """Return the speed that curiosity rewards: summed absolute hinge speeds, or angular body
    speeds."""
    if config.curiosity_of == "bodies":
        return state.spin
    result: np.ndarray = np.abs(state.hinge_speed).sum(-1)
    return result
