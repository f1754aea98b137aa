"""From a landmark track to a motion that stands on the floor (issue: HybrIK without its network).

landmarks -> repair -> before the camera -> 29 keypoints -> person's skeleton -> solve -> up and
floor -> contacts -> root lock -> feet pinned -> solve -> SmplSequence in the world frame.
"""

import numpy as np
from jaxtyping import Int
from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass
from scipy.spatial.transform import Rotation

from robojackson.clips.track import LandmarkTrack
from robojackson.mocap import camera as cameras
from robojackson.mocap import contacts as contact_states
from robojackson.mocap import feet, ground, hybrik
from robojackson.mocap import lock as locks
from robojackson.mocap.blazepose import Landmarks, repair
from robojackson.mocap.body import Body, pose_landmarks
from robojackson.mocap.bones import fit_skeleton
from robojackson.mocap.kinematics import apply
from robojackson.mocap.refine import RefineConfig, refine
from robojackson.mocap.smooth import lowpass
from robojackson.motion.smpl import PLANTED, SLIDING, SmplSequence


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class MocapConfig:
    """How landmarks become a motion.

    Attributes:
        method: HybrIK's solve, adaptive or naive.
        focal_px: Focal length of the camera, pixels; None guesses from the image size.
        cutoff_hz: Zero-phase low-pass of the landmarks, hertz.
        depth_cutoff_hz: The same for the distance of the body from the camera, hertz.
        floor_cutoff_hz: The same for the height of the floor under the feet, hertz.
        bone_trust: 0 takes the proportions of the rest skeleton, 1 the medians of the clip.
        refine: Of the whole-clip refinement.
        gravity, contact, lock: Of the ground and the feet.
    """

    method: hybrik.Method = "adaptive"
    focal_px: float | None = None
    cutoff_hz: float = 4.0
    depth_cutoff_hz: float = 1.5
    floor_cutoff_hz: float = 3.0
    bone_trust: float = 0.5
    refine: RefineConfig = Field(default_factory=RefineConfig)
    gravity: ground.GravityConfig = Field(default_factory=ground.GravityConfig)
    contact: contact_states.ContactConfig = Field(default_factory=contact_states.ContactConfig)
    lock: locks.LockConfig = Field(default_factory=locks.LockConfig)


def recover(track: LandmarkTrack, config: MocapConfig) -> SmplSequence:
    """The motion of the person in a track.

    Raises:
        TrackTooShort, NoPersonFound: nothing to recover.
    """
    landmarks = repair(track)
    pinhole = cameras.Pinhole(
        config.focal_px or cameras.guess_focal(track.width, track.height), track.width, track.height
    )
    seen = cameras.place(landmarks, pinhole, track.fps, config.depth_cutoff_hz)
    rest = fit_skeleton(seen, config.bone_trust)
    if config.refine.enabled:
        seen = refine(seen, landmarks.visibility, rest, track.fps, config.refine)
    seen = lowpass(seen, track.fps, config.cutoff_hz)
    body = pose_landmarks(seen, landmarks.visibility, rest, config.method)
    gravity = ground.find_up(body.pose.points, body.feet, track.fps, config.gravity)
    to_world = ground.camera_to_world(gravity.up)
    body = pose_landmarks(apply(to_world, seen), landmarks.visibility, rest, config.method)
    start = body.pose.points.mean((0, 1))
    body, states = stand(body, track.fps, config)
    start = body.pose.points.mean((0, 1)) - start
    camera = _camera(pinhole, gravity, to_world, start)
    return _sequence(track.fps, body, landmarks, states, camera)


def stand(body: Body, fps: float, config: MocapConfig) -> tuple[Body, Int[np.ndarray, "T 4"]]:
    """The body on the floor, its feet level and pinned where they stand, and the contacts."""
    falling = ground.free_fall(body.pose.points[:, 0, 2], fps)
    flying = ground.flight(body.feet[..., 2].min(1), falling, fps)

    def touching(person: Body) -> np.ndarray:
        return contact_states.contacts(person.feet, flying, fps, config.contact)

    def dropped(person: Body) -> Body:
        lowest = person.feet[..., 2].min(1)
        floor = ground.floor_height(lowest, flying, fps, config.floor_cutoff_hz)
        return person.shifted(np.outer(-floor, [0.0, 0.0, 1.0]))

    bias = feet.pitch_bias(body.feet, fps)
    body = dropped(body.aimed(feet.turn_feet(body.pose.points, np.full((len(falling), 2), bias))))
    planted = touching(body) == PLANTED
    for _ in range(config.lock.rounds):
        flat = feet.standing(body.feet, planted)
        held, share = feet.hold_flat(
            body.pose.points, body.rest, body.feet, flat, config.lock.ramp_s * fps
        )
        body = dropped(body.aimed(held, share))
        body = body.shifted(locks.root_correction(body.feet, planted, fps, config.lock))
        pins = locks.pin_offsets(body.feet, planted)
        settled = lowpass(locks.shared_height(pins, planted), fps, config.floor_cutoff_hz)
        body, pins = body.shifted(settled), pins - settled[:, None]
        body = body.aimed(locks.move_feet(body.pose.points, pins), share)
        pinned, planted = planted, planted | (touching(body) == PLANTED)
    body = dropped(body)
    body = body.aimed(locks.move_feet(body.pose.points, locks.lift_offsets(body.feet)), share)
    body = body.shifted(-body.pose.points[0, 0] * [1.0, 1.0, 0.0])
    states = touching(body)
    loose = (states == PLANTED) & ~pinned
    return body, np.where(pinned, PLANTED, np.where(loose, SLIDING, states)).astype(np.int8)


def _camera(
    pinhole: cameras.Pinhole,
    gravity: ground.Gravity,
    to_world: np.ndarray,
    origin: np.ndarray,
) -> dict[str, object]:
    """What is known of the camera; point_w = rotation @ point_c + position."""
    return {
        "focal_px": pinhole.focal_px,
        "width": pinhole.width,
        "height": pinhole.height,
        "rotation_w": to_world.tolist(),
        "position_w": origin.tolist(),
        "gravity": gravity.source,
        "tilt_deg": gravity.tilt_deg,
    }


def _sequence(
    fps: float,
    body: Body,
    landmarks: Landmarks,
    states: np.ndarray,
    camera: dict[str, object],
) -> SmplSequence:
    vectors = Rotation.from_matrix(body.local.reshape(-1, 3, 3)).as_rotvec().reshape(-1, 24, 3)
    points = body.pose.points
    return SmplSequence(
        fps=fps,
        global_orient=vectors[:, 0],
        body_pose=vectors[:, 1:].reshape(-1, 69),
        transl=points[:, 0] - body.rest[0],
        joints=points[:, :24],
        keypoints_w=points,
        confidence=np.where(landmarks.valid[:, None], body.targets.confidence, 0.0),
        contact=states,
        valid=landmarks.valid,
        betas=np.zeros(10),
        rest_joints=body.rest,
        camera=camera,
        notes=_notes(landmarks, camera),
    )


def _notes(landmarks: Landmarks, camera: dict[str, object]) -> tuple[str, ...]:
    notes = []
    if missed := int((~landmarks.valid).sum()):
        notes.append(f"no person in {missed} of {len(landmarks.valid)} frames: interpolated")
    if landmarks.swapped:
        notes.append(f"left and right exchanged in {landmarks.swapped} frames: put back")
    if camera["gravity"] == "camera":
        notes.append("gravity taken from the camera: the feet contradict it too much")
    return tuple(notes)
