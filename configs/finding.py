"""How a dance is found: what is kept of a search, what is downloaded, how it is judged."""

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

from robojackson.clips.formats import FormatConfig
from robojackson.clips.judgement import JudgeConfig
from robojackson.clips.selection import SelectionConfig
from robojackson.clips.verdict import FilterConfig
from robojackson.clips.web import WebConfig


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class FindConfig:
    """Attributes:
    selection, web, formats, judge, filters: Of the steps, in their order.
    """

    selection: SelectionConfig = Field(default_factory=SelectionConfig)
    web: WebConfig = Field(default_factory=WebConfig)
    formats: FormatConfig = Field(default_factory=FormatConfig)
    judge: JudgeConfig = Field(default_factory=JudgeConfig)
    filters: FilterConfig = Field(default_factory=FilterConfig)
