"""Artifact that a stage hands to the next: the key of a file in the store and its digest."""

from typing import Annotated

from pydantic import Field

from robojackson.config import config_dataclass


@config_dataclass
class Artifact:
    """A file in the store.

    Attributes:
        key: Path relative to the root of the store, `/` between its parts.
        sha256: Digest of the content, 64 hexadecimal digits.
    """

    key: Annotated[str, Field(min_length=1)]
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]

    @property
    def name(self) -> str:
        """The last part of the key."""
        return self.key.rsplit("/", 1)[-1]
