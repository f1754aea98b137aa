"""From landmarks to the motion of the person."""

from robojackson.clips.track import LandmarkTrack
from robojackson.mocap.recover import MocapConfig, recover
from storage import tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.caching import stage


@stage()
def mocap(landmarks: Artifact, config: MocapConfig) -> Artifact:
    """SmplSequence."""
    store = Store.from_environment()
    track = tables.read(LandmarkTrack, store, landmarks)
    return tables.keep(store, "mocap", "smpl.parquet", recover(track, config))
