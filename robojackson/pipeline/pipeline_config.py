"""Configuration of the whole pipeline: one section a stage, each defined beside its code."""

from typing import Annotated

from pydantic import Field

from robojackson.clips.people.dancer import DancerConfig
from robojackson.clips.pose_detector import Size
from robojackson.clips.quality.stability import StabilityConfig
from robojackson.clips.video import VideoLimits
from robojackson.config import config_dataclass
from robojackson.mocap.landmarks.landmark_pipeline import Quality
from robojackson.mocap.networks.network_config import NetworkConfig
from robojackson.mocap.recover import MocapConfig
from robojackson.report.video.side_by_side import VideoConfig
from robojackson.retarget.retargeting import RetargetConfig
from robojackson.rl.config.train_config import EvaluateConfig, TrainConfig


@config_dataclass
class PipelineConfig:
    """One pass from a video to a robot that dances.

    Attributes:
        robot: Name of the robot description (`configs/robots/<robot>.yaml`), or path of the YAML of
            another, from the working directory of the process that runs the stages.
        setup: Name under which the training is recorded.
        minutes: Wall time of the whole pass, minutes; training gets what the other stages leave.
        scoring_detector: Size of the pose model that scores candidates.
        detector: Pose model that feeds mocap; best lets two vote.
        dancer: Which of several people to follow.
        instant: Whether a tracker dances at once and nothing is trained.
        instant_tempos: Tempos, ratio to the clip's, that an instant dance tries one after the other
            while the tracker falls from half of its starts; none keeps the motion's own, and so
            does a `retarget.tempo` that is not `auto`.
        tracker: Name of the tracker (`configs/trackers`) whose dance is on the page first; null is
            the first for the robot whose file is here, of those that may be selected so
            (`by_default` in their YAML), `none` is no tracker.
        gate: Refuse to train on a reference motion that breaks a hard bar of its score card.
        network: Published networks whose weights the user supplies; none by default.
        video, stability, mocap, retarget, train, evaluate, render: Configurations of the stages.
    """

    robot: str = "humanoid"
    setup: str = "scratch"
    minutes: float = Field(default=12.0, gt=0)
    scoring_detector: Size = "lite"
    detector: Quality = "full"
    dancer: DancerConfig = Field(default_factory=DancerConfig)
    instant: bool = False
    instant_tempos: tuple[Annotated[float, Field(ge=0.25, lt=1.0)], ...] = (0.87,)
    tracker: str | None = None
    gate: bool = True
    video: VideoLimits = Field(default_factory=VideoLimits)
    stability: StabilityConfig = Field(default_factory=StabilityConfig)
    network: NetworkConfig = Field(default_factory=NetworkConfig)
    mocap: MocapConfig = Field(default_factory=MocapConfig)
    retarget: RetargetConfig = Field(default_factory=RetargetConfig)
    train: TrainConfig = Field(default_factory=TrainConfig)
    evaluate: EvaluateConfig = Field(default_factory=EvaluateConfig)
    render: VideoConfig = Field(default_factory=VideoConfig)
