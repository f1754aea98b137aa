"""How many people a clip shows, from the people in a few of its frames."""

import pytest

from robojackson.clips.people.person_count import People, PeopleConfig


@pytest.mark.parametrize(
    ("counts", "typical"),
    [([], 0), ([2], 2), ([1, 1, 1, 1, 2, 2], 2), ([1, 1, 1, 2], 1), ([3, 1, 2, 1, 1, 2], 2)],
)
def test_a_third_of_the_frames_decides(counts: list[int], typical: int) -> None:
    people = People(10, 30.0, None, PeopleConfig())
    people.counts += counts
    assert people.typical == typical
