"""From a body on the floor to a motion with the metadata of its camera."""

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from robojackson.mocap.grounding.up_direction import Gravity
from robojackson.mocap.landmarks.blazepose import Landmarks
from robojackson.mocap.landmarks.pinhole_camera import Pinhole
from robojackson.mocap.pose.posed_body import Body
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence


def camera_facts(camera: Mapping[str, object], track: LandmarkTrack) -> dict[str, object]:
    """Return the camera's metadata; of a moving camera that of the first frame."""
    return {**camera, **({} if track.to_first is None else {"moved": True})}


def camera_of(
    pinhole: Pinhole,
    gravity: Gravity,
    to_world: np.ndarray,
    origin: np.ndarray,
) -> dict[str, object]:
    """Return the camera's metadata; point_w = rotation @ point_c + position."""
    return {
        "focal_px": pinhole.focal_px,
        "width": pinhole.width,
        "height": pinhole.height,
        "rotation_w": to_world.tolist(),
        "position_w": origin.tolist(),
        "gravity": gravity.source,
        "tilt_deg": gravity.tilt_deg,
        "gravity_sure": gravity.sure,
        **({} if gravity.sd_deg is None else {"gravity_sd_deg": gravity.sd_deg}),
    }


def sequence_of(
    fps: float,
    body: Body,
    valid: np.ndarray,
    states: np.ndarray,
    camera: dict[str, object],
) -> SmplSequence:
    """Return the motion of a body on the floor.

    Args:
        fps: Frames a second.
        body: The body, world.
        valid: Whether the frame was detected.
        states: States of the foot points.
        camera: The camera's metadata.
    """
    vectors = Rotation.from_matrix(body.local.reshape(-1, 3, 3)).as_rotvec().reshape(-1, 24, 3)
    points = body.pose.points
    return SmplSequence(
        fps=fps,
        global_orient=vectors[:, 0],
        body_pose=vectors[:, 1:].reshape(-1, 69),
        transl=points[:, 0] - body.rest[0],
        joints=points[:, :24],
        keypoints_w=points,
        confidence=np.where(valid[:, None], body.targets.confidence, 0.0),
        contact=states,
        valid=valid,
        betas=np.zeros(10),
        rest_joints=body.rest,
        camera=camera,
        notes=_notes(valid, camera),
    )


def _notes(valid: np.ndarray, camera: dict[str, object]) -> tuple[str, ...]:
    notes = []
    if missed := int((~valid).sum()):
        notes.append(f"no person in {missed} of {len(valid)} frames: interpolated")
    if camera["gravity"] == "camera":
        notes.append("gravity taken from the camera: the feet contradict it too much")
    elif not camera["gravity_sure"]:
        spread = camera.get("gravity_sd_deg")
        within = "" if spread is None else f", to about {spread:.0f} degrees"
        few = "few" if camera["gravity"] == "scene" else "no"
        notes.append(f"gravity is not sure{within}: {few} straight edges of the scene show it")
    return tuple(notes)


def swap_notes(landmarks: Landmarks) -> tuple[str, ...]:
    """Return a note on exchanged sides, if any were."""
    if not landmarks.swapped:
        return ()
    frames = f"{landmarks.swapped} of {len(landmarks.valid)} frames"
    return (f"left and right exchanged in {frames}: corrected",)
