"""The stages that every flow shares: from a clip to the motion that a robot shall do."""

from configs.pipeline import PipelineConfig
from robojackson.retarget.robot import RobotDescription
from storage.artifact import Artifact
from tasks.landmarks import landmarks
from tasks.mocap import mocap
from tasks.retarget import retarget


def to_reference(
    clip: dict[str, Artifact], robot: RobotDescription, settings: PipelineConfig
) -> dict[str, Artifact]:
    """`landmarks`, `smpl`, `reference` and `scorecard` of a clip; every stage cached.

    Args:
        clip: `video` and `info`, as `probe` left them.
    """
    track = landmarks(clip["video"], clip["info"], settings.detector, settings.dancer)
    if settings.network.hybrik:
        from tasks.network_mocap import network_mocap  # PyTorch: only with weights of one's own

        sequence = network_mocap(clip["video"], track, settings.network, settings.mocap)
    else:
        sequence = mocap(track, settings.mocap)
    return {"landmarks": track, "smpl": sequence, **retarget(sequence, robot, settings.retarget)}
