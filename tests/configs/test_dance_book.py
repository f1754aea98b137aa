"""The list of dances, and the keys and values that it accepts."""

import pytest

from configs.dance_book import DanceBook
from configs.find_config import FindConfig
from robojackson.clips.sources import names
from robojackson.errors import BadConfiguration, UnknownName
from robojackson.pipeline.yaml_loader import build, load


@pytest.fixture(scope="module")
def book() -> DanceBook:
    return load(DanceBook, "dances")


def test_there_are_ten_dances_and_apt_is_one(book: DanceBook) -> None:
    assert len(book.dances) >= 10
    assert "APT" in {dance.name for dance in book.dances}


def test_every_dance_has_a_source_that_exists(book: DanceBook) -> None:
    assert {dance.source for dance in book.dances} <= set(names())


def test_the_words_are_added_to_the_query(book: DanceBook) -> None:
    assert book.pick(["APT"])[0].full_query == "APT dance rose bruno mars shorts"


def test_a_dance_is_known_by_its_name_or_query_however_written(book: DanceBook) -> None:
    assert [book.find(words).name for words in ("apt", "APT DANCE", "Apt dance")] == ["APT"] * 3


def test_other_words_are_a_dance_of_their_own(book: DanceBook) -> None:
    made = book.find("tango")
    assert (made.name, made.full_query, made.source) == ("tango", "tango", "youtube")


def test_an_unknown_dance_is_refused_with_the_known_ones(book: DanceBook) -> None:
    with pytest.raises(UnknownName, match="Macarena"):
        book.pick(["Tango"])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"name": "x", "query": "y", "languge": "en"}, "languge"),
        ({"name": "x", "query": "y", "top": 0}, "top"),
        ({"name": "x"}, "query"),
        ({"name": "x", "query": " "}, "x: the query is empty"),
        ({"name": "x", "query": "", "source": "youtube", "address": "ytsearch"}, "query is empty"),
        ({"name": "x", "query": "y", "language": "english"}, "language"),
    ],
)
def test_a_wrong_key_or_value_is_named(given: dict[str, object], message: str) -> None:
    with pytest.raises(BadConfiguration, match=message):
        build(DanceBook, {"dances": [given]}, "dances.yaml")


def test_a_dance_stands_once() -> None:
    twice = [{"name": "APT", "query": "a"}, {"name": "apt", "query": "b"}]
    with pytest.raises(BadConfiguration, match="twice"):
        build(DanceBook, {"dances": twice}, "dances.yaml")


def test_the_file_of_the_search_says_what_the_code_does() -> None:
    """Every value that stands in the file is the default beside the code."""
    assert load(FindConfig, "finding") == FindConfig()
