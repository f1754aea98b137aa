"""Why a clip is danced, or not, in the words of the page."""

from typing import cast

import pytest

from flows.video_pass import scored_candidates
from flows.video_pass.scored_candidates import Candidate
from robojackson.clips.quality.stability import Stability
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load


def candidate(name: str, score: float, detected: int = 12) -> Candidate:
    stability = Stability(12, detected, 0, score, score, score, 0.0, score)
    return cast(Candidate, Candidate(name, {}, None, stability))  # type: ignore[arg-type]


BEST, OTHER = candidate("a.mp4", 0.05), candidate("b.mp4", 0.4)
NO_PERSON = candidate("c.mp4", 0.0, detected=0)


@pytest.mark.parametrize(
    ("clip", "alone", "reason"),
    [
        (BEST, True, "danced: the only clip, stability score 0.05 a second"),
        (BEST, False, "danced: the steadiest, stability score 0.05 a second"),
        (OTHER, False, "not danced: stability score 0.40 a second, 0.05 is steadier"),
        (NO_PERSON, False, "no person is visible in it"),
    ],
)
def test_every_clip_has_its_reason(clip: Candidate, alone: bool, reason: str) -> None:
    assert scored_candidates._reason(clip, BEST, alone) == reason


@pytest.mark.parametrize(
    ("overrides", "options"),
    [({"minutes": 12}, "--minutes 24"), ({"train.steps": 9000}, "--set train.steps=18000")],
)
def test_the_page_advises_what_makes_the_training_longer(
    overrides: dict[str, int], options: str
) -> None:
    settings = load(PipelineConfig, "base", overrides)
    assert scored_candidates.longer_options(settings) == options
