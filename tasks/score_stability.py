"""How steady the dancer of a clip is seen."""

from robojackson.clips.quality.stability import StabilityConfig
from robojackson.clips.quality.stability import stability as score
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.pipeline import tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.stage import stage


@stage()
def stability(landmarks: Artifact, config: StabilityConfig) -> Artifact:
    """StabilityScore."""
    store = Store.from_environment()
    track = tables.read(LandmarkTrack, store, landmarks)
    return tables.keep(store, "stability", "stability.parquet", score(track, config))
