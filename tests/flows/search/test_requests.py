"""What `find` is asked for, before anything is searched."""

from pathlib import Path

import pytest

from configs.find_config import FindConfig
from flows.search.requests import ALL, find_dance


def test_a_list_of_addresses_needs_no_query(tmp_path: Path) -> None:
    (tmp_path / "list.txt").write_text("https://example.org/a.mp4\n")
    listed = str(tmp_path / "list.txt")
    dance = find_dance("", "urls", listed, None, FindConfig())
    assert (dance.name, dance.full_query, dance.address) == ("urls", "", listed)


def test_a_query_that_the_book_knows_is_that_dance() -> None:
    assert find_dance("apt", "youtube", "", None, FindConfig()).full_query.startswith("APT dance")


@pytest.mark.parametrize(("top", "judged"), [(None, ALL), (2, 2)])
def test_a_folder_is_judged_whole_unless_a_number_is_given(top, judged, tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_text("")
    assert find_dance(str(tmp_path), "folder", "", top, FindConfig()).top == judged
