"""Configuration of searches: selection, downloads and assessment."""

from pydantic import Field

from robojackson.clips.quality.assessment import AssessmentConfig
from robojackson.clips.quality.candidate_ranking import FilterConfig
from robojackson.clips.web.candidate_selection import SelectionConfig
from robojackson.clips.web.download_formats import FormatConfig
from robojackson.clips.web.yt_dlp_client import WebConfig
from robojackson.config import config_dataclass


@config_dataclass
class FindConfig:
    """Configuration of a search.

    Attributes:
        selection, web, formats, assessment, filters: Configurations of the steps, in their order.
    """

    selection: SelectionConfig = Field(default_factory=SelectionConfig)
    web: WebConfig = Field(default_factory=WebConfig)
    formats: FormatConfig = Field(default_factory=FormatConfig)
    assessment: AssessmentConfig = Field(default_factory=AssessmentConfig)
    filters: FilterConfig = Field(default_factory=FilterConfig)
