"""The dances that are looked for every night."""

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.errors import BadConfiguration, UnknownName


@config_dataclass
class Dance:
    """One dance.

    Attributes:
        name: What it is called here and in the catalogue.
        query: What is searched for; may be empty where a source needs no more than an address.
        added_words: Added to the query.
        language: Language of the titles, two letters; empty is the site's own choice.
        top: How many videos are assessed; None is the default number.
        every_days: Days between two searches.
        source: A file of robojackson/clips/sources.
        address: Address of the folder, list, site or server; empty is the source's usual one.
    """

    name: Annotated[str, Field(min_length=1, max_length=60)]
    query: str
    added_words: tuple[str, ...] = ()
    language: Annotated[str, Field(pattern="^([a-z]{2}(-[A-Za-z]{2,4})?)?$")] = ""
    top: Annotated[int, Field(ge=1)] | None = None
    every_days: Annotated[float, Field(ge=0)] = 1.0
    source: str = "youtube"
    address: str = ""

    def __post_init__(self) -> None:
        if not self.query.strip() and (self.source == "youtube" or not self.address):
            raise BadConfiguration(
                f"{self.name}: the query is empty; it takes words to look for, or the address of "
                "a folder, list, site or server"
            )

    @property
    def full_query(self) -> str:
        """The whole query."""
        return " ".join((self.query, *self.added_words))


@config_dataclass
class DanceBook:
    """All dances.

    Attributes:
        dances: Dances in the order in which they are searched.
    """

    dances: tuple[Dance, ...]

    def __post_init__(self) -> None:
        names = [dance.name.casefold() for dance in self.dances]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise BadConfiguration(f"dances: {', '.join(twice)} is listed twice")

    def pick(self, names: Sequence[str] | None) -> tuple[Dance, ...]:
        """Return the dances of these names in their order; all of them when no names are given.

        Raises:
            UnknownName: one is not in the book; the message lists those that are.
        """
        if names is None:
            return self.dances
        return tuple(self._of(name) for name in names)

    def find(self, words: str) -> Dance:
        """Return the dance with this name or query, or one that is made of the words."""
        for dance in self.dances:
            if words.casefold() in (dance.name.casefold(), dance.query.casefold()):
                return dance
        return Dance(name=words[:60], query=words)

    def _of(self, name: str) -> Dance:
        for dance in self.dances:
            if dance.name.casefold() == name.casefold():
                return dance
        known = (dance.name for dance in self.dances)
        raise UnknownName("dance", name, "configs/dances.yaml", known)
