"""What single stages say to people: a verdict last, and a command that can be typed."""

import json
from pathlib import Path

import pytest

from robojackson.cli import cards
from robojackson.cli.lifetime import interruption
from robojackson.files.json_types import to_json
from robojackson.retarget.scorecard_gate import BARS

VIDEO = {"missing_joints": 3, "jitter": 0.5, "frames": 60, "fps": 30.0, "detected": 60}
SCORED = {
    "videos": [
        {"video": "a/steady.mp4", "score_per_second": 0.1, **VIDEO},
        {"video": "a/shaky.mp4", "score_per_second": 2.0, **VIDEO},
        {"video": "a/broken.mp4", "error": "a/broken.mp4: not a video"},
    ],
    "verdict": {"kind": "steadiest", "sentence": "steady.mp4 is tracked most steadily."},
    "next": "robojackson dance a/steady.mp4",
}
CARD = dict.fromkeys(BARS, 0.0) | {"tempo_mean": 0.78, "keypoint_leaned_mm": 6.8, "bone_deg": 4.7}
RETARGETED = {"robot": "humanoid", "steps": 266, "dt": 0.015, "cyclic": True, "reference": "r"}


def test_the_steadiest_video_is_marked_and_what_cannot_be_read_is_reported() -> None:
    lines = cards.score_lines(SCORED)
    assert [line.split()[1] for line in lines if line.startswith("►")] == ["steady.mp4"]
    assert "lower is steadier" in "\n".join(lines)
    assert lines[-3:] == [
        "! a/broken.mp4: not a video",
        "steady.mp4 is tracked most steadily.",
        "next: robojackson dance a/steady.mp4",
    ]


def test_advice_stands_a_line_each_in_its_words() -> None:
    facts = {"advice": [{"kind": "dark", "words": "more light"}, {"words": "nearer"}]}
    assert cards.advice_lines(facts) == ["advice    more light", "advice    nearer"]
    assert cards.advice_lines({}) == []


def test_the_card_has_a_bar_for_every_gated_figure_and_ends_with_the_verdict() -> None:
    answer = RETARGETED | {"scorecard": CARD, "verdict": cards.retarget_verdict(CARD)}
    lines = cards.retarget_lines(answer)
    assert len([line for line in lines if "at most" in line]) == len(cards.ROWS)
    assert lines[-1] == "The robot can do this motion at 0.78 of the dancer's tempo."


def test_a_tempo_that_was_given_counts() -> None:
    result = cards.retarget_verdict(CARD | {"tempo": 0.5, "tempo_mean": 1.0})
    assert result["sentence"].endswith("at 0.50 of the dancer's tempo.")


def test_a_motion_over_a_bar_is_refused_by_the_name_of_the_figure() -> None:
    result = cards.retarget_verdict(CARD | {"planted_slip_cm_s": 7.0})
    assert result["kind"] == "refused"
    assert "planted slip cm s is 7, at most 1" in result["sentence"]


def test_a_figure_that_is_no_number_is_refused_by_its_name_from_a_file_too() -> None:
    card = json.loads(to_json(CARD | {"fallen_share": float("nan")}))
    result = cards.retarget_verdict(card)
    assert "fallen share is nan, at most 0" in result["sentence"]


@pytest.mark.parametrize(
    ("value", "limit", "full"), [(0, 5, 0), (0.01, 5, 0), (2.5, 5, 5), (9, 5, 10), (1, 0, 10)]
)
def test_a_bar_shows_the_share_of_the_limit(value: float, limit: float, full: int) -> None:
    assert cards.bar(value, limit).count(cards.FULL) == full
    assert len(cards.bar(value, limit)) == cards.CELLS


def test_a_training_without_an_update_learnt_nothing() -> None:
    assert cards.train_verdict(0, 512, [1.0])["kind"] == "untrained"
    assert "lasted 2.0 s" in cards.train_verdict(5, 512, [1.0, 3.0])["sentence"]


def test_a_command_can_be_copied_into_a_shell() -> None:
    assert cards.command_line("dance", "my clip.mp4") == "robojackson dance 'my clip.mp4'"


def test_a_command_names_the_path_where_the_shell_does_not_know_the_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.setattr(interruption.sys, "argv", [".venv/bin/robojackson", "dance", "a b.mp4"])
    assert interruption.same_command() == ".venv/bin/robojackson dance 'a b.mp4'"
    assert cards.command_line("doctor") == ".venv/bin/robojackson doctor"
    assert interruption.python() == interruption.sys.executable
    for name in ("robojackson", "python3"):
        (tmp_path / "bin").mkdir(exist_ok=True)
        (tmp_path / "bin" / name).touch(0o755)
    assert interruption.same_command() == "robojackson dance 'a b.mp4'"
    assert interruption.python() == "python3"


@pytest.mark.parametrize("words", [["--minutes", "3"], ["--minutes=3"], []])
def test_an_option_takes_the_place_of_its_earlier_value(
    words: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interruption.sys, "argv", ["robojackson", "dance", "a.mp4", *words])
    result = interruption.with_option("--minutes", "15")
    assert result == "robojackson dance a.mp4 --minutes 15"


@pytest.mark.parametrize(
    "words",
    [["--steps", "100"], ["--minutes=3", "--steps=100"], ["--set", "steps=100", "--set=minutes=5"]],
)
def test_another_budget_takes_the_place_of_one_that_was_too_small(
    words: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interruption.sys, "argv", ["robojackson", "train", "a.parquet", *words])
    result = interruption.with_option("--minutes", "10", ("--steps",), ("steps", "minutes"))
    assert result == "robojackson train a.parquet --minutes 10"
