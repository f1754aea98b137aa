"""Nothing that the web calls a video leaves its cell, its folder or its line."""

import unicodedata
from pathlib import PurePosixPath

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from robojackson.clips.web.untrusted_text import (
    TITLE_LENGTH,
    clean_text,
    in_markdown,
    isolated,
    safe_name,
    web_address,
)

ARABIC = "رقصة أبت"
HOSTILE = [
    "../../x",
    "..",
    ".",
    "",
    "/etc/passwd",
    "a/b\\c",
    "C:\\windows",
    "\x1b[2J\x1b[31mred",
    "a\x00b",
    "con\nfig",
    "x" * 300,
    "\u202eevil\u202c",
    ARABIC,
    "-rf",
    "${HOME}",
    "%(title)s",
    "💃" * 80,
]


@pytest.mark.parametrize("raw", HOSTILE)
def test_a_hostile_id_is_one_part_of_a_path(raw: str) -> None:
    name = safe_name(raw)
    assert PurePosixPath("store", name).parts == ("store", name)
    assert name not in ("", ".", "..")
    assert len(name) <= 64


@pytest.mark.medium
@given(st.text())
def test_any_id_is_made_of_letters_digits_and_two_signs(raw: str) -> None:
    assert all(c.isascii() and (c.isalnum() or c in "_-") for c in safe_name(raw))


@given(st.text(), st.text())
def test_two_ids_never_become_one(one: str, two: str) -> None:
    assert (safe_name(one) == safe_name(two)) == (one == two)


def test_an_id_of_youtube_stays_as_it_is() -> None:
    assert safe_name("-dQw4w9WgX_") == "-dQw4w9WgX_"


def test_ids_of_different_pages_differ() -> None:
    assert safe_name("clip", "http://a/clip") != safe_name("clip", "http://b/clip")


@given(st.text())
def test_a_title_is_one_short_line_without_control_characters(raw: str) -> None:
    title = clean_text(raw)
    assert len(title) <= TITLE_LENGTH
    assert not any(unicodedata.category(c)[0] == "C" for c in title)
    assert title.split() == title.strip().split(" ") or not title


@given(st.text())
def test_cleaning_twice_changes_nothing(raw: str) -> None:
    assert clean_text(clean_text(raw)) == clean_text(raw)


def test_a_title_of_300_letters_ends_in_dots() -> None:
    assert clean_text("x" * 300) == "x" * (TITLE_LENGTH - 1) + "…"


def test_an_escape_sequence_loses_its_power() -> None:
    assert clean_text("\x1b[31mred\x07\x9b2J") == "[31mred2J"


def test_marks_do_not_pile_up() -> None:
    assert clean_text("a" + "\u0301" * 50 + "b") == "a\u0301\u0301b"


def test_overrides_of_the_direction_go() -> None:
    assert clean_text("\u202eabc\u2066d") == "abcd"


def test_letters_from_right_to_left_are_set_apart_and_take_no_more_room() -> None:
    assert isolated(ARABIC) == f"\u2068{ARABIC}\u2069"
    assert cell_len(isolated(ARABIC)) == cell_len(ARABIC)


def test_other_letters_are_left_alone() -> None:
    assert isolated("APT. 아파트") == "APT. 아파트"


@pytest.mark.parametrize(
    "raw",
    [
        "file:///etc/passwd",
        "javascript:alert(1)",
        "ftp://host/x",
        "/local/path",
        "http://",
        "http://[::1",
        "data:text/html,x",
        None,
        7,
    ],
)
def test_only_http_is_an_address(raw: object) -> None:
    assert web_address(raw) == ""


def test_spaces_of_an_address_are_escaped_and_control_characters_go() -> None:
    raw = "  https://host/a b\n\x1b[0m?v=1&x=é\u00a0y%20z \n"
    assert web_address(raw) == "https://host/a%20b[0m?v=1&x=%C3%A9%C2%A0y%20z"


@pytest.mark.parametrize(
    ("raw", "expected"),
    [
        ("https://bücher.example/ä.mp4", "https://xn--bcher-kva.example/%C3%A4.mp4"),
        ("http://me@例え.jp:8080/a?x=1#b", "http://me@xn--r8jz45g.jp:8080/a?x=1#b"),
        ("https://" + "ü" * 70 + ".example/", ""),
    ],
)
def test_the_host_of_an_address_is_as_name_servers_know_it(raw: str, expected: str) -> None:
    assert web_address(raw) == expected


def test_an_address_with_a_space_in_its_host_is_none() -> None:
    assert web_address("https://my host/a") == ""


@given(st.text())
def test_markdown_is_escaped(raw: str) -> None:
    escaped = in_markdown(clean_text(raw))
    for sign in "<>":
        assert sign not in escaped
    for sign in "|[]*`":
        assert escaped.count(f"\\{sign}") == escaped.count(sign)
