"""How steady the dancer of a clip is seen."""

from robojackson.clips.stability import StabilityConfig
from robojackson.clips.stability import stability as score
from robojackson.clips.track import LandmarkTrack
from storage import tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.caching import stage


@stage()
def stability(landmarks: Artifact, config: StabilityConfig) -> Artifact:
    """StabilityScore."""
    store = Store.from_environment()
    track = tables.read(LandmarkTrack, store, landmarks)
    return tables.keep(store, "stability", "stability.parquet", score(track, config))
