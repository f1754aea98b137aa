"""Each search and study ends with a sentence about its result and a command to type next."""

import shlex
from typing import Any

import pytest

from flows.cli.verdicts import (
    ablation_verdict,
    catalogue_verdict,
    deploy_verdict,
    find_verdict,
    metrics_verdict,
    refresh_lines,
    refresh_verdict,
)


def row(decision: str, **more: Any) -> dict[str, Any]:
    usual = {"title": "APT cover", "url": "https://example.org/a b", "reason": "two people"}
    usual |= {"source": "youtube", "video_id": decision}
    return {**usual, "decision": decision, "score_per_second": 3.456, **more}


def found(*rows: dict[str, Any], dropped: int = 0) -> dict[str, Any]:
    chosen = next((each for each in rows if each["decision"] == "chosen"), None)
    left_out = [{"title": "x", "reason": "not among the 3 most watched"}] * dropped
    return {"dance": "APT", "chosen": chosen, "candidates": list(rows), "dropped": left_out}


def refreshed(**made: bool) -> dict[str, Any]:
    dances = {
        name: {"is_new": is_new, "chosen": row("chosen"), "reference": f"store/{name}.parquet"}
        for name, is_new in made.items()
    }
    return {"dances": dances, "failed": {}, "not_due": []}


def test_a_chosen_video_is_assessed_and_danced_next() -> None:
    result = find_verdict(found(row("chosen"), row("accepted"), row("rejected")))
    assert "APT cover is the steadiest of 3, 3.46 a second" in result["verdict"]["sentence"]
    assert "2 may be danced" in result["verdict"]["sentence"]
    assert shlex.split(result["next"]) == ["robojackson", "dance", "https://example.org/a b"]


def test_a_search_without_a_dance_names_the_commonest_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.argv", ["robojackson", "find", "APT", "--top", "3"])
    rows = [row("rejected"), row("rejected"), row("failed", reason="no video")]
    result = find_verdict(found(*rows, dropped=9))
    assert result["verdict"]["sentence"].endswith("of 2 the reason is: two people.")
    assert result["next"] == "robojackson find APT --top 6"
    assert find_verdict(found(*rows))["next"] == ""  # there is no more to assess


def test_a_search_that_finds_nothing_says_what_to_type() -> None:
    result = find_verdict(found())
    assert result["verdict"]["sentence"] == "The search found no video: other words may."
    assert result["next"] == "robojackson find 'APT tutorial'"


def test_a_search_whose_videos_were_all_dropped_does_not_say_that_there_was_none() -> None:
    sentence = find_verdict(found(dropped=40))["verdict"]["sentence"]
    assert sentence == "None of the 40 videos found was worth a download: other words may."


def test_the_words_of_a_title_are_no_words_of_ours() -> None:
    result = find_verdict(found(row("chosen", title="a\x1b[31mb\nc")))
    assert "\x1b" not in result["verdict"]["sentence"]
    assert "\n" not in result["verdict"]["sentence"]


def test_a_refresh_trains_a_new_video_next() -> None:
    result = refresh_verdict(refreshed(old=False, fresh=True))
    assert result["verdict"]["sentence"] == "2 of 2 dances have a motion, 1 of a new video."
    assert result["next"] == "robojackson train store/fresh.parquet -o fresh"


def test_a_refresh_into_an_object_store_advises_what_reads_from_it() -> None:
    done = refreshed(fresh=True)
    done["dances"]["fresh"]["reference"] = "s3://bucket/store/fresh.parquet"
    assert refresh_verdict(done)["next"] == "robojackson dance fresh"
    assert refresh_verdict(done, "g1")["next"] == "robojackson dance fresh --robot g1"


def test_a_refresh_that_failed_is_given_again() -> None:
    done = refreshed(a=True) | {"failed": {"b c": "no network"}}
    assert refresh_verdict(done)["next"] == "robojackson refresh 'b c'"
    assert refresh_verdict(done, "g1")["next"] == "robojackson refresh 'b c' --robot g1"
    assert refresh_lines(done)[-1] == "b c: failed, no network"


def test_a_refresh_with_nothing_due_says_what_waits() -> None:
    done = refreshed() | {"not_due": ["a", "b"]}
    assert refresh_verdict(done)["verdict"]["sentence"] == "No dance is due: a, b."


@pytest.mark.parametrize(
    ("steps", "seeds", "kind", "words"),
    [
        (400, 1, "meaningless", "mean nothing"),
        (50_000, 3, "few_seeds", "3 seeds can show no difference"),
        (50_000, 10, "evaluated", "which claims hold"),
    ],
)
def test_a_study_says_what_its_numbers_are_worth(
    steps: int, seeds: int, kind: str, words: str
) -> None:
    result = ablation_verdict({"cells": 9, "page": "p.html"}, steps, seeds, 10_000)
    assert result["verdict"]["kind"] == kind
    assert words in result["verdict"]["sentence"]
    assert result["next"]


def test_a_catalogue_counts_what_may_be_danced_and_dances_the_first() -> None:
    rows = [row("rejected", dance="APT"), row("accepted", dance="moonwalk", url="https://x.org/m")]
    result = catalogue_verdict(rows)
    assert result["verdict"]["sentence"] == "2 videos of 2 dances were assessed, 1 may be danced."
    assert shlex.split(result["next"]) == ["robojackson", "dance", "https://x.org/m"]
    again = catalogue_verdict([*rows, *rows])  # another search assessed the same two
    assert again["verdict"] == result["verdict"]
    none = catalogue_verdict([row("rejected", dance="APT")])
    assert shlex.split(none["next"]) == ["robojackson", "find", "APT"]


def test_the_overview_of_studies_counts_what_can_be_evaluated() -> None:
    rows = [{"study": "smoke", "strict_success": None}, {"study": "smoke", "strict_success": 0.5}]
    result = metrics_verdict(rows)
    assert result["verdict"]["sentence"] == "2 cells of 1 study; 1 can be evaluated."
    assert shlex.split(result["next"])[:3] == ["robojackson", "metrics", "--sql"]


def test_what_is_registered_needs_a_worker() -> None:
    result = deploy_verdict({"deployments": ["a", "b"], "pools": ["flows"], "automations": []})
    assert result["verdict"]["sentence"].startswith("2 deployments")
    assert result["next"] == "prefect worker start --pool flows"
