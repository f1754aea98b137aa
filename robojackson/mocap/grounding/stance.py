"""Put a body on the floor: contacts of its feet, the root that keeps them still, and the legs.

World axes before the shift to the floor: the camera is at the origin, z is up. Metres, seconds.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field

from robojackson.body import feet
from robojackson.body.smoothing import lowpass
from robojackson.config import config_dataclass
from robojackson.mocap.grounding import contacts, foot_pinning, leg_ik, pivots
from robojackson.mocap.grounding import flight as air
from robojackson.mocap.grounding import floor as ground
from robojackson.mocap.grounding.foot_pinning import FootPinningConfig
from robojackson.mocap.grounding.support import support_of
from robojackson.mocap.pose.posed_body import Body
from robojackson.motion.smpl_sequence import AIR, PLANTED, SLIDING

SHORTEST_FLIGHT = 3
LIFTS = 3
"""Iterations of the feet: a leg that is bent to lift its foot turns the foot a little."""
ABOVE = np.array([0.0, 0.0, 1.0])


@config_dataclass
class GroundingConfig:
    """Settings of the floor and the feet.

    Attributes:
        floor_cutoff_hz: Zero-phase low-pass of the height of the floor under the feet, hertz.
        contact, foot_pinning: Settings of the feet's states and of foot pinning.
    """

    floor_cutoff_hz: float = 3.0
    contact: contacts.ContactConfig = Field(default_factory=contacts.ContactConfig)
    foot_pinning: FootPinningConfig = Field(default_factory=FootPinningConfig)


@dataclass(frozen=True)
class Stance:
    """A body on the floor and the states of its foot points."""

    body: Body
    contact: Int[np.ndarray, "T 4"]


@dataclass(frozen=True)
class _Evidence:
    """Measurements that do not change while the body is moved.

    `soles`: foot points as they were seen; `elsewhere`: frames in which other parts than the feet
    carry the body.
    """

    fps: float
    speed: Float[np.ndarray, "T 4"]
    along: Float[np.ndarray, "T 4"]
    slope: Float[np.ndarray, " T"]
    falling: np.ndarray
    jumps: np.ndarray
    elsewhere: np.ndarray
    soles: Float[np.ndarray, "T 4 3"]
    config: GroundingConfig

    def states(self, body: Body) -> Int[np.ndarray, "T 4"]:
        height = body.feet[..., 2]
        unsupported = self.falling | self.elsewhere
        found = contacts.contacts(
            height, self.speed, unsupported, self.fps, self.config.contact, self.along
        )
        return np.where(self.jumps[:, None], AIR, found).astype(np.int8)

    def standing(self, planted: np.ndarray) -> np.ndarray:
        """Return the planted points of feet that do not turn."""
        turning = pivots.turning(self.soles, planted, self.fps)
        return np.asarray(planted & ~np.repeat(turning, 2, axis=1))

    def lowest(self, body: Body) -> Float[np.ndarray, " T"]:
        return ground.support_height(body.pose.points, body.feet, self.elsewhere)

    def dropped(self, body: Body, airborne: np.ndarray) -> Body:
        """Return the body with the floor under its lowest point moved to z = 0."""
        floor = ground.floor_height(
            self.lowest(body), airborne, self.fps, self.config.floor_cutoff_hz
        )
        return body.shifted(np.outer(-floor, ABOVE))


def ground_body(body: Body, fps: float, config: GroundingConfig) -> Stance:
    """Return the body on the floor, its feet level and pinned where planted, and the contacts."""
    height, lowest, falling, jumps, elsewhere = support_of(body.pose.points, body.feet, fps)
    flying = air.flight(lowest, height, falling, fps) | jumps
    speed, root = contacts.image_speed(body.feet, fps), body.pose.points[:, 0]
    along = contacts.ray_speed(body.feet, fps)
    slope = root[:, 1] / root[:, 0]
    evidence = _Evidence(fps, speed, along, slope, falling, jumps, elsewhere, body.feet, config)
    bias = np.full((len(falling), 2), feet.pitch_bias(body.feet[~elsewhere], fps))
    body = evidence.dropped(body.aimed(feet.turn_feet(body.pose.points, bias)), flying)
    planted = pinned = evidence.standing(evidence.states(body) == PLANTED)
    share = np.zeros((len(falling), 2))
    for _ in range(config.foot_pinning.rounds):
        body, share = _pinned(body, planted, evidence, flying)
        states = evidence.states(body)
        pinned, planted = planted, evidence.standing(planted | (states == PLANTED))
        airborne = (states == AIR).all(1) & ~elsewhere
        flying = jumps | air.flight(evidence.lowest(body), height, airborne, fps)
    body = evidence.dropped(body, flying)
    for _ in range(LIFTS):
        body = body.aimed(leg_ik.move_feet(body.pose.points, leg_ik.lift_offsets(body.feet)), share)
    body = body.shifted(-body.pose.points[0, 0] * [1.0, 1.0, 0.0])
    states = evidence.states(body)
    states = np.where((states == PLANTED) & ~pinned, SLIDING, states)
    states = np.where(pinned, PLANTED, states).astype(np.int8)
    return Stance(body, np.where(elsewhere[:, None], states, _carried(states, body, fps)))


def _carried(states: np.ndarray, body: Body, fps: float) -> Int[np.ndarray, "T 4"]:
    """Return states in which a flight lasts no longer than the resulting body's fall, or until the
    clip is cut."""
    height = ground.centre_of_mass(body.pose.points)[:, 2]
    if len(height) < SHORTEST_FLIGHT:
        return states
    height = lowpass(height, fps, air.FALL_CUTOFF_HZ)
    falls = np.gradient(np.gradient(height)) * fps**2 < -ground.GRAVITY / 2.0
    carried, lowest = np.array(states), body.feet[..., 2].argmin(1)
    for start, end in feet.stretches((states == AIR).all(1)):
        known = start + np.flatnonzero(falls[start:end])
        first, last = (known[0], known[-1] + 1) if len(known) else (end, end)
        if len(known) and start == 0:
            first = start
        if len(known) and end == len(states):
            last = end
        for frame in (*range(start, first), *range(last, end)):
            carried[frame, lowest[frame]] = SLIDING
    return carried


def _pinned(
    body: Body, planted: np.ndarray, evidence: _Evidence, flying: np.ndarray
) -> tuple[Body, Float[np.ndarray, "T 2"]]:
    """Run one round: level planted feet, move the root, tip toes, bend legs; also return the level
    share."""
    fps, pinning = evidence.fps, evidence.config.foot_pinning
    ramp = pinning.ramp_s * fps
    flat = feet.stands_flat(body.feet, planted)
    held, share = feet.level_feet(body.pose.points, body.rest, body.feet, flat, ramp)
    body = evidence.dropped(body.aimed(held, share), flying)
    body = body.shifted(
        foot_pinning.root_correction(body.feet, planted, evidence.slope, fps, pinning)
    )
    tips = foot_pinning.tip_angles(body.pose.points, body.feet, planted, fps, ramp)
    body = body.aimed(feet.turn_feet(body.pose.points, tips), share)
    pins = foot_pinning.pin_offsets(body.feet, planted, pinning.fade_s * fps)
    shared = foot_pinning.shared_height(pins, planted)
    settled = lowpass(shared, fps, evidence.config.floor_cutoff_hz)
    body = body.shifted(settled)
    pins = foot_pinning.within_reach(pins - settled[:, None], pinning.reach_m)
    return body.aimed(leg_ik.move_feet(body.pose.points, pins), share), share
