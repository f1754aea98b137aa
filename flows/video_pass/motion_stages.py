"""The stages that every flow shares: from a clip to the motion that a robot shall do."""

from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.robot.model import RobotDescription
from storage.artifact import Artifact
from tasks.detect_landmarks import landmarks
from tasks.recover_motion import mocap
from tasks.retarget_motion import retarget


def to_reference(
    clip: dict[str, Artifact], robot: RobotDescription, settings: PipelineConfig
) -> dict[str, Artifact]:
    """`landmarks`, `smpl`, `reference` and `scorecard` of a clip; every stage cached.

    Args:
        clip: `video` and `info`, as `probe` left them.
    """
    track = landmarks(clip["video"], clip["info"], settings.detector, settings.dancer)
    if settings.network.hybrik:
        from tasks.recover_motion_by_networks import (
            network_mocap,  # PyTorch: only with weights of one's own
        )

        sequence = network_mocap(clip["video"], track, settings.network, settings.mocap)
    else:
        sequence = mocap(track, settings.mocap)
    return {"landmarks": track, "smpl": sequence, **retarget(sequence, robot, settings.retarget)}
