"""Dictionaries of the shape that yt-dlp returns, written by hand from its documentation."""

from datetime import UTC, datetime
from typing import Any

import pytest

from robojackson.clips.sources.site import candidates
from robojackson.clips.web.candidate_selection import SelectionConfig, select
from robojackson.clips.web.video_candidate import VideoCandidate, from_info
from robojackson.clips.web.yt_dlp_client import entries

NOW = datetime(2026, 11, 21, tzinfo=UTC)


def flat(video_id: str = "AbCdEfGhIjK", **more: Any) -> dict[str, Any]:
    """Return one entry of a flat search of YouTube."""
    return {
        "_type": "url",
        "ie_key": "Youtube",
        "id": video_id,
        "url": f"https://www.youtube.com/watch?v={video_id}",
        "title": "APT dance cover",
        "description": None,
        "duration": 21.0,
        "channel": "Somebody",
        "channel_id": "UC0000000000000000000000",
        "thumbnails": [
            {"url": "https://i.ytimg.com/vi/x/small.jpg", "height": 94, "width": 168},
            {"url": "https://i.ytimg.com/vi/x/large.jpg", "height": 188, "width": 336},
        ],
        "timestamp": None,
        "availability": None,
        "view_count": 1234567,
        "live_status": None,
        **more,
    }


def search(*entries: dict[str, Any]) -> dict[str, Any]:
    """Return what `ytsearchN:` returns."""
    return {"_type": "playlist", "id": "APT dance", "title": "APT dance", "entries": list(entries)}


def one(**more: Any) -> VideoCandidate:
    found = from_info(flat(**more), "APT dance", NOW)
    assert found is not None
    return found


def test_a_flat_entry_becomes_a_candidate() -> None:
    assert one() == VideoCandidate(
        video_id="AbCdEfGhIjK",
        url="https://www.youtube.com/watch?v=AbCdEfGhIjK",
        title="APT dance cover",
        query="APT dance",
        source="youtube",
        duration_s=21.0,
        view_count=1234567,
        thumbnail="https://i.ytimg.com/vi/x/large.jpg",
    )


def test_a_full_entry_names_its_page_and_not_its_file() -> None:
    full = flat(
        _type="video",
        extractor_key="Youtube",
        webpage_url="https://www.youtube.com/watch?v=AbCdEfGhIjK",
        formats=[{"format_id": "18", "url": "https://r1.googlevideo.com/videoplayback"}],
    )
    found = from_info(full, "q", NOW)
    assert found is not None
    assert found.url == "https://www.youtube.com/watch?v=AbCdEfGhIjK"


def test_a_video_inside_a_page_is_known_by_its_file() -> None:
    embedded = {"id": "page-1", "title": "x", "formats": [{"url": "http://host/a.mp4"}]}
    other = {"id": "page-1", "title": "x", "formats": [{"url": "http://host/b.mp4"}]}
    found = candidates({"entries": [embedded, other]}, "q", NOW, "http://host/page")
    assert len({candidate.key for candidate in found}) == 2


@pytest.mark.parametrize("value", [None, "many", -1, float("nan"), float("inf"), True, [3], 2**70])
def test_a_count_that_is_none_is_unknown(value: Any) -> None:
    assert one(view_count=value).view_count is None


@pytest.mark.parametrize("value", [None, "0:21", float("nan"), -3])
def test_a_length_that_is_none_is_unknown(value: Any) -> None:
    assert one(duration=value).duration_s is None


def test_an_id_that_climbs_does_not() -> None:
    assert "/" not in one(video_id="../../x").video_id


def test_an_entry_without_an_address_is_none() -> None:
    assert from_info({"id": "x", "title": "y", "url": "file:///etc/passwd"}, "q", NOW) is None


def test_empty_entries_of_a_search_are_left_out() -> None:
    assert len(candidates({"entries": [None, flat(), {}]}, "q", NOW)) == 1


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        ({"duration": 60.0}, "60 s long, the limit is 60 s"),
        ({"duration": 3600}, "3600 s long, the limit is 60 s"),
        ({"live_status": "is_live"}, "a live stream"),
        ({"live_status": "is_upcoming"}, "a live stream"),
        ({"is_live": True}, "a live stream"),
    ],
)
def test_what_cannot_be_a_short_is_dropped_with_a_reason(more: dict[str, Any], reason: str) -> None:
    left = select([one(**more)], (), SelectionConfig())
    assert (left.selected, [str(why) for _, why in left.dropped]) == ((), [reason])


def test_a_video_of_unknown_length_is_kept() -> None:
    assert len(select([one(duration=None)], (), SelectionConfig()).selected) == 1


def test_a_video_that_is_found_twice_is_kept_once() -> None:
    left = select([one(), one(title="again")], (), SelectionConfig())
    assert ([c.title for c in left.selected], [str(r) for _, r in left.dropped]) == (
        ["APT dance cover"],
        ["found twice"],
    )


def test_a_video_that_was_assessed_is_dropped() -> None:
    left = select([one()], {("youtube", "AbCdEfGhIjK")}, SelectionConfig())
    assert [str(why) for _, why in left.dropped] == ["assessed before"]


def test_the_five_most_watched_are_kept_in_order() -> None:
    views = [5, None, 900, 70, 3, 800, 0]
    found = [one(video_id=f"v{i}", view_count=count) for i, count in enumerate(views)]
    left = select(found, (), SelectionConfig())
    assert [c.view_count for c in left.selected] == [900, 800, 70, 5, 3]
    assert len(left.dropped) == 2


def test_ties_keep_the_order_of_the_search() -> None:
    found = [one(video_id=f"v{i}", view_count=7) for i in range(4)]
    assert [c.video_id for c in select(found, (), SelectionConfig()).selected] == [
        "v0",
        "v1",
        "v2",
        "v3",
    ]


def test_entries_without_an_id_are_as_many_videos_as_addresses() -> None:
    entries = [flat(id=None, url=f"https://site/watch/{number}") for number in range(3)]
    found = [from_info(entry, "apt", NOW) for entry in entries]
    assert len({candidate.key for candidate in found if candidate}) == 3


def test_the_tabs_of_a_channel_are_its_videos() -> None:
    tabs = [search(flat("AAAAAAAAAAA"), flat("BBBBBBBBBBB")), search(flat("CCCCCCCCCCC"))]
    found = [entry["id"] for entry in entries(search(*tabs))]
    assert found == ["AAAAAAAAAAA", "BBBBBBBBBBB", "CCCCCCCCCCC"]


@pytest.mark.parametrize(
    ("views", "reason"), [(None, "not among the first 1"), (3, "not among the 1 most watched")]
)
def test_what_is_left_out_is_reported_by_what_is_known(views: int | None, reason: str) -> None:
    found = [from_info(flat(name, view_count=views), "apt", NOW) for name in ("a" * 11, "b" * 11)]
    ((_, rejection),) = select([one for one in found if one], (), SelectionConfig(top=1)).dropped
    assert str(rejection) == reason


def test_videos_that_failed_before_take_the_places_that_are_left() -> None:
    found = [one(video_id=f"v{i}", view_count=100 - i) for i in range(8)]
    failed = {("youtube", f"v{i}") for i in range(5)}
    left = select(found, (), SelectionConfig(), failed)
    assert [c.video_id for c in left.selected] == ["v5", "v6", "v7", "v0", "v1"]
