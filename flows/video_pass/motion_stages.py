"""The stages that every flow shares: from a clip to the motion that a robot shall do."""

from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.robot.model import RobotDescription
from storage.artifact import Artifact
from tasks.detect_landmarks import detect_landmarks
from tasks.recover_motion import recover_motion
from tasks.retarget_motion import retarget_motion


def to_reference(
    clip: dict[str, Artifact], robot: RobotDescription, settings: PipelineConfig
) -> dict[str, Artifact]:
    """Return `landmarks`, `smpl`, `reference` and `scorecard` of a clip; every stage cached.

    Args:
        clip: `video` and `info`, as `probe_video` left them.
    """
    track = detect_landmarks(clip["video"], clip["info"], settings.detector, settings.dancer)
    if settings.network.hybrik:
        from tasks.recover_motion_by_networks import (
            recover_motion_by_networks,  # PyTorch: only with weights of one's own
        )

        sequence = recover_motion_by_networks(
            clip["video"], track, settings.network, settings.mocap
        )
    else:
        sequence = recover_motion(track, settings.mocap)
    return {
        "landmarks": track,
        "smpl": sequence,
        **retarget_motion(sequence, robot, settings.retarget),
    }
