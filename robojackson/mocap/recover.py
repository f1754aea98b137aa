"""From a landmark track to a motion that stands on the floor (HybrIK without its network).

landmarks -> repair -> before the camera -> 29 keypoints -> person's skeleton -> solve -> up and
floor -> contacts -> root lock -> feet pinned -> solve -> SmplSequence in the world frame.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from pydantic import Field

from robojackson.body import analytic_solve
from robojackson.body.forward_kinematics import apply
from robojackson.body.smoothing import lowpass
from robojackson.clips.quality.visibility import weigh_visibility
from robojackson.config import config_dataclass
from robojackson.mocap.grounding import up_direction as up
from robojackson.mocap.grounding.scene_lines import SceneEvidence, scene_evidence
from robojackson.mocap.grounding.stance import GroundingConfig, ground_body
from robojackson.mocap.landmarks import pinhole_camera
from robojackson.mocap.landmarks.blazepose import BODY, Landmarks, repair
from robojackson.mocap.landmarks.bone_lengths import fit_skeleton
from robojackson.mocap.landmarks.covariance import certainty
from robojackson.mocap.landmarks.refinement import RefineConfig, gather, refine
from robojackson.mocap.pose.posed_body import Body, pose_landmarks
from robojackson.mocap.recovered_sequence import (
    camera_facts,
    camera_of,
    sequence_of,
    swap_notes,
)
from robojackson.mocap.reprojection import leaving_out_weak
from robojackson.mocap.temporal.ground_evidence import GroundEvidence
from robojackson.mocap.temporal.temporal_lift import TemporalConfig, lift
from robojackson.motion.landmark_track import LandmarkTrack, evenly
from robojackson.motion.smpl_sequence import SmplSequence


@config_dataclass
class MocapConfig:
    """Settings of the recovery of a motion from landmarks.

    Attributes:
        method: HybrIK's solve, adaptive or naive.
        focal_px: Focal length of the camera, pixels; None guesses from the image size.
        cutoff_hz: Zero-phase low-pass of the landmarks, hertz.
        depth_cutoff_hz: Low-pass of the distance of the body from the camera, hertz.
        bone_trust: Share of the clip's medians in the proportions; the rest is from the rest
            skeleton.
        leave_out_weak: Whether stretches in which the body lies off the picture are left out: the
            motion is recovered again without them, and interpolated there.
        temporal: Settings of the network that corrects the detector.
        refine: Settings of the whole-clip refinement.
        gravity: Settings of the direction of up.
        grounding: Settings of the floor and the feet.
    """

    method: analytic_solve.Method = "adaptive"
    focal_px: float | None = Field(default=None, gt=0)
    cutoff_hz: float = Field(default=4.0, gt=0)
    depth_cutoff_hz: float = Field(default=1.5, gt=0)
    bone_trust: float = Field(default=0.6, ge=0, le=1)
    leave_out_weak: bool = False
    temporal: TemporalConfig = Field(default_factory=TemporalConfig)
    refine: RefineConfig = Field(default_factory=RefineConfig)
    gravity: up.GravityConfig = Field(default_factory=up.GravityConfig)
    grounding: GroundingConfig = Field(default_factory=GroundingConfig)


@dataclass(frozen=True)
class View:
    """The person before one camera.

    Attributes:
        track: What was detected, at even frames.
        landmarks: The same, repaired.
        pinhole: The camera.
        points: Landmarks in the camera frame, metres.
        depth_m: Standard deviation of the depths of the body, metres; None where they are unknown.
        ground: What the temporal network found of gravity.
        scene: What straight edges of the scene show.
    """

    track: LandmarkTrack
    landmarks: Landmarks
    pinhole: pinhole_camera.Pinhole
    points: Float[np.ndarray, "T 33 3"]
    depth_m: Float[np.ndarray, "T 12"] | None
    ground: GroundEvidence | None = None
    scene: SceneEvidence | None = None

    def in_image(self) -> Float[np.ndarray, "T 33 3"]:
        """Return the points at their depths on the rays of the detected landmarks."""
        depth = self.points[..., 2:]
        return np.concatenate([self.pinhole.rays(self.landmarks.image) * depth, depth], -1)


def recover_motion(track: LandmarkTrack, config: MocapConfig) -> SmplSequence:
    """Return the motion of the person in a track.

    Raises:
        TrackTooShort, NoPersonFound: no motion can be recovered.
    """

    def recovered(given: LandmarkTrack) -> SmplSequence:
        return finish_motion(view_track(given, config), config)

    return leaving_out_weak(recovered, track, config.leave_out_weak)


def view_track(track: LandmarkTrack, config: MocapConfig) -> View:
    """Repair a track and lift it before the camera, corrected by the temporal network.

    Raises:
        TrackTooShort, NoPersonFound: nothing to recover.
    """
    track = evenly(weigh_visibility(track))
    landmarks = repair(track)
    view = _placed(track, landmarks, focal_of(track, None, config), config)
    scene = scene_of(track, view.ground, config)
    if scene is None:
        return view
    known = up.known_up(scene, config.gravity)
    focal_px = focal_of(track, scene, config)
    if known is not None or focal_px != view.pinhole.focal_px:
        view = _placed(track, landmarks, focal_px, config, known)
    return replace(view, scene=scene)


def _placed(
    track: LandmarkTrack,
    landmarks: Landmarks,
    focal_px: float,
    config: MocapConfig,
    known: Float[np.ndarray, "3"] | None = None,
) -> View:
    """Lift landmarks before a camera of a focal length, whose up may be known."""
    pinhole = pinhole_camera.Pinhole(focal_px, track.width, track.height)
    seen = pinhole_camera.place(landmarks, pinhole, track.fps, config.depth_cutoff_hz)
    if not config.temporal.enabled:
        return View(track, landmarks, pinhole, seen, None)
    found = lift(seen, landmarks.local, landmarks.visibility, track.fps, config.temporal, known)
    depth_m = found.depth_sd(config.temporal.depth_floor_m)
    return View(track, landmarks, pinhole, found.points, depth_m, found.ground)


def scene_of(
    track: LandmarkTrack, ground: GroundEvidence | None, config: MocapConfig
) -> SceneEvidence | None:
    """Return what straight edges of the scene show; None without edges."""
    if track.edges is None or not config.gravity.scene:
        return None
    near = up.CAMERA_UP if ground is None else ground.up
    return scene_evidence(track.edges, track.width, track.height, near)


def focal_of(track: LandmarkTrack, scene: SceneEvidence | None, config: MocapConfig) -> float:
    """Return the focal length: that of the configuration, that of the scene where it is known
    closely enough, or a typical one; pixels."""
    if config.focal_px is not None:
        return config.focal_px
    if scene is not None and scene.focal_sd <= config.gravity.scene_focal_sd:
        return scene.focal_px
    return pinhole_camera.guess_focal(track.width, track.height)


def finish_motion(view: View, config: MocapConfig) -> SmplSequence:
    """Refine the points of a view, solve them and stand the body on the floor."""
    track, landmarks, seen = view.track, view.landmarks, view.points
    rest = fit_skeleton(seen[landmarks.valid], config.bone_trust)  # filled in: no measurement
    sure = landmarks.visibility
    if config.refine.enabled:
        evidence = gather(seen, sure, rest, track.fps, config.refine, view.depth_m)
        seen = refine(seen, sure, rest, track.fps, config.refine, view.depth_m)
        sure = certainty(seen[:, BODY], evidence, sure, config.refine)
    seen = lowpass(seen, track.fps, config.cutoff_hz)

    def posed(marks: np.ndarray) -> Body:
        return pose_landmarks(marks, sure, rest, config.method)

    sequence = recover_points(
        seen, posed, landmarks.valid, view.pinhole, track.fps, config, view.ground, view.scene
    )
    notes = (*track.notes, *sequence.notes, *swap_notes(landmarks))
    return replace(
        sequence, person=track.person, notes=notes, camera=camera_facts(sequence.camera, track)
    )


def recover_points(
    points: Float[np.ndarray, "T N 3"],
    posed: Callable[[np.ndarray], Body],
    valid: np.ndarray,
    pinhole: pinhole_camera.Pinhole,
    fps: float,
    config: MocapConfig,
    ground: GroundEvidence | None = None,
    scene: SceneEvidence | None = None,
) -> SmplSequence:
    """Return the motion of points before the camera, from any detector.

    Args:
        points: Points without gaps, metres, camera axes.
        posed: Function that solves the points.
        valid: Whether the frame was detected.
        pinhole: The camera.
        fps: Frames a second.
        config: Settings of the floor and the feet.
        ground: What the temporal network found of gravity.
        scene: What straight edges of the scene show.
    """
    body = posed(points)
    gravity = up.find_up(body.pose.points, body.feet, fps, config.gravity, ground, scene)
    to_world = up.camera_to_world(gravity.up)
    body = posed(apply(to_world, points))
    start = body.pose.points.mean((0, 1))
    stance = ground_body(body, fps, config.grounding)
    body = stance.body
    start = body.pose.points.mean((0, 1)) - start
    camera = camera_of(pinhole, gravity, to_world, start)
    return sequence_of(fps, body, valid, stance.contact, camera)
