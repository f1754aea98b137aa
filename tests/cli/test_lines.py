"""What commands say of their progress where every line stays: in files and in logs."""

import pytest

from robojackson.cli import console


def lines(capsys: pytest.CaptureFixture[str]) -> list[str]:
    with console.stages() as advance:
        for done in range(1, 21):
            advance("trained", done, 20)
    return capsys.readouterr().err.splitlines()


def test_a_part_that_is_quick_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert lines(capsys) == []


def test_a_part_that_is_slow_says_every_tenth_once(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(console, "SECONDS_BETWEEN_LINES", 0.0)
    assert lines(capsys) == [f"trained {tenth}0 %" for tenth in range(1, 11)]
