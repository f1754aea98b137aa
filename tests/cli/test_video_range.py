"""A range of a video is looked at alone; an impossible one leaves nothing."""

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flows.cli.commands import app
from robojackson.api.policy_ingredients import clip_ingredient
from robojackson.cli.video_range import video_range
from robojackson.clips.people.tracked_people import Person
from robojackson.clips.quality.advice import Advice
from robojackson.clips.video import VideoLimits, probe
from robojackson.errors import BadConfiguration

CLIP = Path(__file__).parents[2] / "clips" / "walk.mp4"


def test_without_a_range_the_video_itself_is_taken(tmp_path: Path) -> None:
    with video_range(CLIP, None, tmp_path / "out", (None, None), "base", {}) as shown:
        assert shown == CLIP
    assert not (tmp_path / "out").exists()


@pytest.mark.medium
def test_a_range_is_a_file_beside_the_results(tmp_path: Path) -> None:
    with video_range(CLIP, None, tmp_path, (0.5, 1.5), "base", {}) as shown:
        assert shown == tmp_path / "walk-0.5-1.5s.mp4"
    assert probe(shown, VideoLimits()).duration_s == pytest.approx(1.0, abs=0.05)


@pytest.mark.medium
def test_what_fails_on_a_range_leaves_no_file(tmp_path: Path) -> None:
    out = tmp_path / "out"

    def fail() -> None:
        with video_range(CLIP, None, out, (None, 1.0), "base", {}) as shown:
            assert shown.exists()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert not out.exists()


@pytest.mark.medium
def test_what_fails_keeps_the_range_of_an_earlier_run(tmp_path: Path) -> None:
    with video_range(CLIP, None, tmp_path, (0.5, 1.5), "base", {}) as shown:
        pass
    with (
        pytest.raises(KeyboardInterrupt),
        video_range(CLIP, None, tmp_path, (0.5, 1.5), "base", {}),
    ):
        raise KeyboardInterrupt
    assert probe(shown, VideoLimits()).duration_s == pytest.approx(1.0, abs=0.05)


@pytest.mark.medium
def test_a_list_of_people_leaves_no_range(tmp_path: Path) -> None:
    """The figures are of the video that was given, at its moments."""
    words = ["mocap", str(CLIP), "-o", str(tmp_path), "--people", "--start", "0.4", "--end", "0.8"]
    found = CliRunner().invoke(app, [*words, "--json"])
    assert found.exit_code == 0, found.output
    assert [path.name for path in tmp_path.iterdir()] == ["people.png"]
    data = json.loads(found.stdout)
    assert data["video"] == str(CLIP)
    assert data["people"][0]["from_s"] == pytest.approx(0.4, abs=0.05)


@pytest.mark.parametrize(
    ("more", "named"),
    [
        ([str(CLIP)], "a second clip"),
        (["--hypotheses", "2", "--video"], "--hypotheses and --video"),
    ],
)
def test_a_list_of_people_refuses_what_it_would_leave_out(
    tmp_path: Path, more: list[str], named: str
) -> None:
    out = tmp_path / "out"
    found = CliRunner().invoke(app, ["mocap", str(CLIP), *more, "-o", str(out), "--people"])
    assert found.exit_code == 1
    assert f"--people only lists the people: omit {named}" in " ".join(found.output.split())
    assert not out.exists()


@pytest.mark.medium
def test_the_licence_of_a_range_is_that_of_its_video(tmp_path: Path) -> None:
    clip, out = tmp_path / "walk.mp4", tmp_path / "out"
    shutil.copy(CLIP, clip)
    (tmp_path / "walk.mp4.license").write_text("SPDX-License-Identifier: CC-BY-4.0\n")
    words = ["mocap", str(clip), "-o", str(out), "--config", "smoke", "--start", "1", "--end", "2"]
    assert CliRunner().invoke(app, words).exit_code == 0
    found = clip_ingredient(out / "reference.parquet")
    assert (found.name, found.licence) == ("walk-1-2s.mp4", "CC-BY-4.0")


def test_two_cameras_have_no_range(tmp_path: Path) -> None:
    with (
        pytest.raises(BadConfiguration, match=r"two cameras exclude --start and --end"),
        video_range(CLIP, CLIP, tmp_path, (1.0, None), "base", {}),
    ):
        pass


@pytest.mark.medium
def test_a_range_beyond_the_video_is_one_line(tmp_path: Path) -> None:
    with (
        pytest.raises(BadConfiguration, match="long: nothing is shown from 9 s on"),
        video_range(CLIP, None, tmp_path / "out", (9.0, None), "base", {}),
    ):
        pass
    assert not (tmp_path / "out").exists()


@pytest.mark.medium
def test_a_range_of_one_frame_names_the_video_and_the_range(tmp_path: Path) -> None:
    with (
        pytest.raises(
            BadConfiguration, match=r"walk\.mp4: 1 frame from 1 s to 1\.02 s, at least 2"
        ),
        video_range(CLIP, None, tmp_path / "out", (1.0, 1.02), "base", {}),
    ):
        pass
    assert not (tmp_path / "out").exists()


def test_moments_are_those_of_the_whole_video() -> None:
    """Advice on a range is for `--start` and `--end`, which count from the video's beginning."""
    advice = Advice("person_missing", 0.5, 0.9, (1.0, 5.0)).later(2.0)
    assert "in sight from 3.0 to 7.0 s" in str(advice.record["words"])
    person = Person(1, 200.0, 1.0, 0.5, 3.0, 0.5)
    assert "2.5-5.0 s" in str(person.later(2.0))
