"""RoboJackson: a video of a dance in, a robot that dances it out.

    import robojackson as rj

    motion = rj.recover_motion("dance.mp4")          # SmplSequence: SMPL parameters, metres
    reference = rj.retarget_motion(motion, "humanoid")
    trained = rj.train_policy(reference, minutes=9, progress=True)
    print(rj.evaluate_policy(trained.policy, reference))

Each function takes a path or what an earlier one returned; each result has `save` and a repr that
says what it is. Importing the package opens no file, socket or clock, and loads no library until a
function is named.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from robojackson.api.evaluation import PolicyEvaluation as PolicyEvaluation
    from robojackson.api.evaluation import evaluate_policy as evaluate_policy
    from robojackson.api.evaluation import render_video as render_video
    from robojackson.api.motions import read_motion as read_motion
    from robojackson.api.motions import recover_motion as recover_motion
    from robojackson.api.motions import retarget_motion as retarget_motion
    from robojackson.api.motions import write_motion as write_motion
    from robojackson.api.performances import Performance as Performance
    from robojackson.api.performances import perform as perform
    from robojackson.api.policy_training import train_policy as train_policy
    from robojackson.api.robots import load_robot as load_robot
    from robojackson.api.trackers import load_tracker as load_tracker
    from robojackson.api.trained_policy import TrainedPolicy as TrainedPolicy
    from robojackson.api.videos import detect_landmarks as detect_landmarks
    from robojackson.api.videos import probe_video as probe_video
    from robojackson.clips.video import VideoInfo as VideoInfo
    from robojackson.errors import RoboJacksonError as RoboJacksonError
    from robojackson.motion.landmark_track import LandmarkTrack as LandmarkTrack
    from robojackson.motion.reference_motion import ReferenceMotion as ReferenceMotion
    from robojackson.motion.rollout import Rollout as Rollout
    from robojackson.motion.smpl_sequence import SmplSequence as SmplSequence
    from robojackson.rl.modes.rewards import RewardState as RewardState
    from robojackson.rl.policy import Policy as Policy
    from robojackson.robot.model import Robot as Robot

__version__ = "0.2.0"

_MODULES = {
    "api.evaluation": ("PolicyEvaluation", "evaluate_policy", "render_video"),
    "api.motions": ("read_motion", "recover_motion", "retarget_motion", "write_motion"),
    "api.robots": ("load_robot",),
    "api.performances": ("Performance", "perform"),
    "api.policy_training": ("train_policy",),
    "api.trackers": ("load_tracker",),
    "api.trained_policy": ("TrainedPolicy",),
    "api.videos": ("detect_landmarks", "probe_video"),
    "clips.video": ("VideoInfo",),
    "errors": ("RoboJacksonError",),
    "motion.landmark_track": ("LandmarkTrack",),
    "motion.reference_motion": ("ReferenceMotion",),
    "motion.rollout": ("Rollout",),
    "motion.smpl_sequence": ("SmplSequence",),
    "rl.modes.rewards": ("RewardState",),
    "rl.policy": ("Policy",),
    "robot.model": ("Robot",),
}
_PUBLIC = {name: module for module, names in _MODULES.items() for name in names}
__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used."""
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_PUBLIC[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
