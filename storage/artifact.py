"""What a stage hands to the next: the key of a file in the store and its digest."""

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

from robojackson.errors import StoreError

if TYPE_CHECKING:
    from storage.store import Store


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
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

    def verify(self, store: "Store") -> "Artifact":
        """The artifact itself, if its file is there and unaltered.

        Raises:
            StoreError: the file is gone or has another content.
        """
        found = store.sha256(self.key)
        if found != self.sha256:
            raise StoreError(
                f"{store.address(self.key)} was altered: "
                f"sha256 {found[:12]}..., expected {self.sha256[:12]}..."
            )
        return self


def sha256_of(data: bytes) -> str:
    """Digest of bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def sha256_of_file(path: Path) -> str:
    """Digest of a local file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
