"""Author the bundled hip-shake: a cyclic dance of one cycle, written as a DeepMimic motion file.

    python -m tools.render.hip_shake -o hip_shake.txt
    python -m tools.render.render_dancer hip_shake.txt -o clips/hip_shake

The pelvis sways from foot to foot and rolls, the chest leans and turns against it, the arms swing
lightly with bent elbows, both feet stay planted: hips and feet are given and the legs follow by
two-bone inverse kinematics on the body that will be filmed. Every curve is a smooth function of
phases that grow by whole turns in a cycle, so the last frame continues in the first with every
derivative.

The figures are chosen for a robot with ball feet, hips that close by 5 degrees, shoulders of two
hinges and arms of 10 Nm: on the filmed body (segment masses of Winter) the zero moment point stays
within 0.13 m of the middle with the ankles 0.25 m out, a thigh never closes by more than 4 degrees,
and Humanoid-v5's arms reach every pose within 10 degrees, 5 in the mean.

World: x forward, y left, z up; metres, radians, seconds. In a motion file y is up and z right.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from tools.render import deepmimic

if TYPE_CHECKING:
    from tools.render.anny_body import Body

WORLD_TO_DEEPMIMIC = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
ANNY_TO_WORLD = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
LEFT, RIGHT = 1.0, -1.0
"""Sign of y."""


@dataclass(frozen=True)
class Dance:
    """The choreography; degrees where noted, else metres and seconds.

    Attributes:
        lap_s: Length of a cycle.
        sways: Left-right sways in a cycle.
        fps: Frames a second of the file.
        rubato: Radians by which the sway runs ahead of and behind the beat within a cycle.
        swell: Share by which the sway's width grows and shrinks within a cycle.
        sway: Half the way of the pelvis between the feet.
        roll_deg: Pelvis roll at the end of a sway, the loaded hip up.
        pelvis_yaw_deg, chest_yaw_deg: Turn of the pelvis, and of the chest against it.
        chest_roll_deg: Lean of the chest against the sway.
        lean_deg: Forward lean of the trunk.
        bounce: Rise of the pelvis over a foot above the middle of the sway, half of it.
        dip: Half the slow change of the knee bend within a cycle.
        half_stance: Distance from the middle to an ankle.
        toe_out_deg: Outward turn of each foot.
        knee_deg: Mean bend of the knees at the middle of the sway.
        abduction_deg, abduction_swing_deg: Upper arm away from the trunk, mean and half the swing;
            an arm rises while the hips are on the other side. A single camera sees this swing
            well, and a swing to the front badly.
        flexion_deg, flexion_swing_deg: Upper arm to the front.
        forearm_out_deg, forearm_out_swing_deg: Heading of the forearm, 0 is straight ahead.
        forearm_up_deg, forearm_up_swing_deg: Rise of the forearm over the horizontal.
    """

    lap_s: float = 4.0
    sways: int = 4
    fps: float = 30.0
    rubato: float = 0.12
    swell: float = 0.12
    sway: float = 0.06
    roll_deg: float = 8.0
    pelvis_yaw_deg: float = 4.0
    chest_yaw_deg: float = 4.0
    chest_roll_deg: float = 7.5
    lean_deg: float = 4.0
    bounce: float = 0.005
    dip: float = 0.008
    half_stance: float = 0.25
    toe_out_deg: float = 8.0
    knee_deg: float = 36.0
    abduction_deg: float = 38.0
    abduction_swing_deg: float = 14.0
    flexion_deg: float = 2.0
    flexion_swing_deg: float = 4.0
    forearm_out_deg: float = 32.0
    forearm_out_swing_deg: float = 10.0
    forearm_up_deg: float = -30.0
    forearm_up_swing_deg: float = 7.0


@dataclass(frozen=True)
class Measures:
    """Measures of the body for the choreography, metres.

    Attributes:
        hips: Hips from the root to the left and the right hip, upright.
        thigh, shin: Lengths.
        ankle_height: Height of the ankle over the floor.
        scale: Size of the body over that of the motion file's humanoid.
    """

    hips: dict[float, Float[np.ndarray, "3"]]
    thigh: float
    shin: float
    ankle_height: float
    scale: float


def measure(body: "Body") -> Measures:
    """Return the lengths of a body, in world axes."""
    knee, ankle, root = (body.head_of(bone) for bone in ("lowerleg01.L", "foot.L", "root"))
    hips = {
        side: ANNY_TO_WORLD @ (body.head_of(f"upperleg01.{name}") - root)
        for side, name in ((LEFT, "L"), (RIGHT, "R"))
    }
    thigh = float(np.linalg.norm(knee - body.head_of("upperleg01.L")))
    ankle_height = float(ankle[2] - body.rest_vertices[:, 2].min())
    return Measures(hips, thigh, float(np.linalg.norm(ankle - knee)), ankle_height, body.scale)


def author(dance: Dance, measures: Measures) -> deepmimic.Motion:
    """Return one cycle of the dance; the frame after the last equals the first."""
    lap = 2.0 * np.pi * np.arange(round(dance.lap_s * dance.fps)) / (dance.lap_s * dance.fps)
    beat = dance.sways * lap + dance.rubato * np.sin(lap)
    width = 1.0 + dance.swell * np.sin(lap + 0.6)
    pelvis = _pelvis_rotation(dance, beat, width)
    root = _root_position(dance, measures, lap, beat, width)
    rotations = {"root": pelvis, **_trunk(dance, beat, width)}
    for side, name in ((LEFT, "left"), (RIGHT, "right")):
        hip = root + pelvis.apply(measures.hips[side])
        rotations |= _leg(dance, measures, side, name, hip)
        rotations |= _arm(dance, side, name, lap, beat, rotations["chest"])
    turned = {name: _to_deepmimic(rotation) for name, rotation in rotations.items()}
    position = root @ WORLD_TO_DEEPMIMIC.T / measures.scale
    return deepmimic.Motion(dance.fps, position, turned)


def solve_leg(
    hip: Float[np.ndarray, "T 3"], ankle: Float[np.ndarray, "3"], toe: Float[np.ndarray, "3"],
    thigh: float, shin: float,
) -> tuple[Rotation, Rotation]:  # fmt: skip
    """Return the world rotations of thigh and shin that reach from hip to ankle, the knee towards
    the toe.

    Raises:
        ValueError: the ankle is out of reach.
    """
    reach = np.linalg.norm(ankle - hip, axis=1)
    if reach.max() >= thigh + shin:
        raise ValueError(f"a leg of {thigh + shin:.3f} m cannot reach {reach.max():.3f} m")
    down = (ankle - hip) / reach[:, None]
    right = _unit(np.cross(down, toe))
    swing = np.arccos((thigh**2 + reach**2 - shin**2) / (2.0 * thigh * reach))
    bend = np.pi - np.arccos((thigh**2 + shin**2 - reach**2) / (2.0 * thigh * shin))
    upper = Rotation.from_rotvec(swing[:, None] * right).apply(down)
    hip_rotation = _limb_rotation(upper, right)
    knee_rotation = hip_rotation * Rotation.from_rotvec(bend[:, None] * np.array([0.0, 1.0, 0.0]))
    return hip_rotation, knee_rotation


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    from tools.render.anny_body import Body

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--out", type=Path, required=True)
    for name, default in vars(Dance()).items():
        parser.add_argument(f"--{name}", type=type(default), default=default)
    options = vars(parser.parse_args(arguments))
    deepmimic.write(options.pop("out"), author(Dance(**options), measure(Body())))
    return 0


def _pelvis_rotation(dance: Dance, beat: np.ndarray, width: np.ndarray) -> Rotation:
    """Roll with the sway, turn a little later, so that the hips draw an eight."""
    roll = dance.roll_deg * width * np.sin(beat)
    yaw = dance.pelvis_yaw_deg * np.sin(beat - np.pi / 3)
    return _yaw_pitch_roll(yaw, np.full_like(beat, dance.lean_deg), roll)


def _root_position(
    dance: Dance, measures: Measures, lap: np.ndarray, beat: np.ndarray, width: np.ndarray
) -> Float[np.ndarray, "T 3"]:
    """Return the sway, bounce and slow dip around the height at which the knees have their mean
    bend."""
    hip = measures.hips[LEFT]
    bend = np.radians(dance.knee_deg)
    reach_squared = (
        measures.thigh**2 + measures.shin**2 + 2 * measures.thigh * measures.shin * np.cos(bend)
    )
    drop = np.sqrt(reach_squared - (dance.half_stance - hip[1]) ** 2)
    height = measures.ankle_height + drop - hip[2]
    rise = -dance.bounce * np.cos(2.0 * beat) + dance.dip * np.sin(lap - 0.9)
    sideways = dance.sway * width * np.sin(beat)
    return np.stack([np.full_like(lap, -hip[0]), sideways, height + rise], -1)


def _trunk(dance: Dance, beat: np.ndarray, width: np.ndarray) -> dict[str, Rotation]:
    """Return the trunk: the chest leans and turns against the pelvis; the head stays nearly
    level."""
    lean = np.full_like(beat, dance.lean_deg)
    roll = dance.chest_roll_deg * width * np.sin(beat)
    chest = _yaw_pitch_roll(-dance.chest_yaw_deg * np.sin(beat - np.pi / 3), lean, roll)
    head = _yaw_pitch_roll(1.5 * np.sin(beat / dance.sways), 0.5 * lean, -0.5 * roll)
    return {"chest": chest, "neck": head}


def _leg(
    dance: Dance, measures: Measures, side: float, name: str, hip: Float[np.ndarray, "T 3"]
) -> dict[str, Rotation]:
    """Return a leg from a moving hip to a planted foot."""
    toe_out = side * np.radians(dance.toe_out_deg)
    ankle = np.array([0.0, side * dance.half_stance, measures.ankle_height])
    toe = np.array([np.cos(toe_out), np.sin(toe_out), 0.0])
    thigh, shin = solve_leg(hip, ankle, toe, measures.thigh, measures.shin)
    foot = Rotation.from_rotvec(np.tile([0.0, 0.0, toe_out], (len(hip), 1)))
    return {f"{name}_hip": thigh, f"{name}_knee": shin, f"{name}_ankle": foot}


def _arm(
    dance: Dance, side: float, name: str, lap: np.ndarray, beat: np.ndarray, chest: Rotation
) -> dict[str, Rotation]:
    """Return an arm that rises to the side while the hips are on the other side."""
    swing = -side * (1.0 + 0.2 * np.cos(lap)) * np.sin(beat - 0.4)
    abduction = np.radians(dance.abduction_deg + dance.abduction_swing_deg * swing)
    flexion = np.radians(dance.flexion_deg + dance.flexion_swing_deg * swing)
    heading = np.radians(dance.forearm_out_deg + dance.forearm_out_swing_deg * swing)
    rise = np.radians(dance.forearm_up_deg + dance.forearm_up_swing_deg * swing)
    upper = np.stack(
        [np.sin(flexion), side * np.sin(abduction) * np.cos(flexion),
         -np.cos(abduction) * np.cos(flexion)], -1,
    )  # fmt: skip
    fore = np.stack(
        [np.cos(rise) * np.cos(heading), side * np.cos(rise) * np.sin(heading), np.sin(rise)], -1
    )
    upper, fore = chest.apply(upper), chest.apply(fore)
    axis = _unit(np.cross(upper, fore))
    return {
        f"{name}_shoulder": _limb_rotation(upper, axis),
        f"{name}_elbow": _limb_rotation(fore, axis),
    }


def _limb_rotation(along: Float[np.ndarray, "T 3"], right: Float[np.ndarray, "T 3"]) -> Rotation:
    """Return the rotation that takes a limb hanging down with its hinge to the right to `along`."""
    up, left = -along, -right
    return Rotation.from_matrix(np.stack([np.cross(left, up), left, up], -1))


def _yaw_pitch_roll(yaw_deg: np.ndarray, pitch_deg: np.ndarray, roll_deg: np.ndarray) -> Rotation:
    return Rotation.from_euler("ZYX", np.stack([yaw_deg, pitch_deg, roll_deg], -1), degrees=True)


def _to_deepmimic(rotation: Rotation) -> Rotation:
    return Rotation.from_matrix(WORLD_TO_DEEPMIMIC @ rotation.as_matrix() @ WORLD_TO_DEEPMIMIC.T)


def _unit(vectors: Float[np.ndarray, "T 3"]) -> Float[np.ndarray, "T 3"]:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


if __name__ == "__main__":
    sys.exit(main())
