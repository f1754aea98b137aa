"""Score how steadily the dancer of a clip is tracked."""

from robojackson.clips.quality.stability import StabilityConfig, stability
from robojackson.motion.landmark_track import LandmarkTrack
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.stage import stage


@stage()
def score_stability(landmarks: Artifact, config: StabilityConfig) -> Artifact:
    """Return the StabilityScore of a track."""
    store = Store.from_environment()
    track = artifact_tables.read(LandmarkTrack, store, landmarks)
    return artifact_tables.save(store, "stability", "stability.parquet", stability(track, config))
