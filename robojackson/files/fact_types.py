"""Types for the metadata of a table schema, checked by pydantic.

Numbers are finite and physically plausible; text and lists are bounded.
"""

from typing import Annotated, Any

from pydantic import Field, Strict, StringConstraints

MOST_NAMES = 10_000
Count = Annotated[int, Strict(), Field(ge=0, le=2**31 - 1)]
Flag = Annotated[bool, Strict()]
Rate = Annotated[float, Strict(), Field(ge=0.01, le=1000.0)]
"""Frames a second."""
Step = Annotated[float, Strict(), Field(ge=1e-4, le=1.0)]
"""Seconds a control step."""
Pixels = Annotated[int, Strict(), Field(ge=1, le=2**16)]
Metres = Annotated[float, Strict(), Field(ge=-1e4, le=1e4)]
Number = Annotated[float, Strict(), Field(ge=-1e9, le=1e9)]
Text = Annotated[str, StringConstraints(strict=True, max_length=4096)]
Texts = Annotated[list[Text], Field(max_length=MOST_NAMES)]
Point = Annotated[list[Metres], Field(min_length=3, max_length=3)]
Segment = Annotated[list[Number], Field(min_length=4, max_length=4)]
"""Ends of a line, x0 y0 x1 y1."""
Numbers = Annotated[list[Number], Field(max_length=1_000_000)]
Matrix = Annotated[
    list[Annotated[list[Number], Field(min_length=3, max_length=3)]],
    Field(min_length=3, max_length=3),
]
Figures = dict[Text, Number | None]


def many(kind: Any, count: int) -> object:
    """Return the type of a list of exactly `count` values."""
    return Annotated[list[kind], Field(min_length=count, max_length=count)]
