"""The page: complete, escaped, offline; and what it says is what was measured."""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.clips.quality.advice import Advice
from robojackson.clips.quality.stability import Stability
from robojackson.clips.video import VideoInfo
from robojackson.files.json_types import to_json
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.pages.evaluation_text import beat_rows, headline, next_step
from robojackson.report.pages.page_content import (
    TO_COME,
    Results,
    page_content,
    versions,
)
from robojackson.report.pages.run_page import PageContent, render, write_page
from robojackson.report.plots import run_plots
from robojackson.report.quantities import format_value, quantity

POLICIES = ("trained", "statue")
FIGURES = {
    "survived_s": 8.25, "success": 0.62, "strict_success": 0.5, "skill": 0.31,
    "site_error_m": 0.048, "limb_gain": 0.9, "limb_gain_left_hand": 0.93,
    "limb_gain_left_foot": float("nan"), "rollouts": 73.0,
    "baselines": {"statue": {"survived_s": 1.0, "success": 0.03, "rollouts": 73.0}},
}  # fmt: skip
SUMMARY = json.loads(to_json(FIGURES))
"""The figures as a page reads them: null where there is no number."""


@pytest.fixture
def results(sequence: SmplSequence, reference: ReferenceMotion) -> Results:
    rows = [
        {"policy": policy, "phase": phase, "reset": reset, "survived_s": 3.0 * (1 + reset),
         "clip_fraction": (1 + reset) / 4}
        for policy in POLICIES for phase in (0, 9, 18) for reset in range(3)
    ]  # fmt: skip
    episodes = [
        {"step": 100 * k, "episode": k, "episode_return": 2.0 * k, "episode_length": k}
        for k in range(1, 40)
    ]
    return Results(
        title="hip shake",
        info=VideoInfo(Path("a/hip <i>shake.mp4"), 640, 480, 30.0, 12, 0.4, 0),
        stability=Stability(12, 12, 3, 0.1, 3.1, 0.25, 0.01, 7.8),
        sequence=sequence,
        reference=reference,
        training={"trainer": "sbx", "steps": 1200, "training_s": 90.0},
        episodes=episodes,
        evaluation=SUMMARY,
        evaluations=rows,
    )


@pytest.mark.medium
def test_page_shows_every_stage(results: Results) -> None:
    html = render(page_content(results, "dance.mp4"))
    headings = re.findall(r"<h[23]>(.*?)</h[23]>", html)
    for title in ("Evaluation", "Source clip", "Stability", "Motion capture", "Retargeting"):
        assert title in headings


@pytest.mark.medium
def test_page_shows_the_advice_about_the_clip(results: Results) -> None:
    advised = replace(results, advice=(Advice("frame_rate", 10.0, 20.0),))
    html = render(page_content(advised, "dance.mp4"))
    assert "<li>10 frames a second: film at 30</li>" in html
    assert "advice" not in render(page_content(results, "dance.mp4"))


@pytest.mark.medium
def test_a_page_without_its_video_says_that_it_is_to_come(results: Results) -> None:
    early = render(page_content(results, None))
    assert TO_COME in early
    assert "The video</a>" not in early
    assert TO_COME not in render(page_content(results, "dance.mp4"))


@pytest.mark.medium
def test_page_shows_every_plot_inside_itself(results: Results) -> None:
    html = render(page_content(results, "dance.mp4"))
    assert html.count('src="data:image/png;base64,') == 4


@pytest.mark.medium
def test_page_requests_nothing_but_the_video(results: Results) -> None:
    html = render(page_content(results, "my dance.mp4"))
    addresses = set(re.findall(r'(?:src|href)="((?!data:)[^"]*)"', html))
    assert addresses == {"my%20dance.mp4"}


@pytest.mark.medium
def test_markup_in_names_is_text(results: Results) -> None:
    html = render(page_content(replace(results, title="<script>alert(1)</script>"), None))
    assert "<script>" not in html
    assert "hip <i>shake" not in html


def test_beats_are_a_table_and_a_tile_beside_chance() -> None:
    figures = {"beats": 9, "precision": 0.5, "recall": 0.25, "f1": 0.33, "bas": 0.4}
    report = {"person": figures, "robot": figures, "control": {**figures, "f1": 0.05}}
    html = render(PageContent(title="x", beats=beat_rows({"figures": report})))
    assert "<b>0.33</b><span>on the beat (F1)</span>" in html
    assert "robot in simulation; half a beat later 0.05" in html
    assert "<h2>On the beat</h2>" in html


def test_headline_names_the_best_baseline() -> None:
    html = render(PageContent(title="x", evaluation=SUMMARY))
    assert "finished 62% of 73 rollouts without a fall; the best baseline (statue) 3%." in html


@pytest.mark.parametrize("nothing", [None, math.nan])
def test_a_baseline_without_a_figure_is_left_out(nothing: float | None) -> None:
    baselines = {"statue": {"success": nothing}, "random": {"success": 0.25}, "mean_pose": {}}
    evaluation = {"success": 0.5, "rollouts": 73.0, "baselines": baselines}
    assert headline(evaluation).endswith("without a fall; the best baseline (random) 25%.")
    alone = {**evaluation, "baselines": {"statue": {"success": nothing}}}
    assert headline(alone).endswith("of 73 rollouts without a fall.")


@pytest.mark.parametrize("nothing", [None, math.nan])
def test_a_robot_without_a_figure_is_neither_better_nor_worse(nothing: float | None) -> None:
    evaluation = {
        "success": nothing,
        "rollouts": 0.0,
        "verdict": {"sentence": "Too short."},
        "baselines": {"statue": {"success": 0.5}},
    }
    assert headline(evaluation) == "Too short."


@pytest.mark.parametrize(
    ("success", "message"),
    [(0.62, "(statue) does as well: 62%."), (0.9, "(statue) does better: 90%.")],
)
def test_headline_says_when_learning_gained_nothing(success: float, message: str) -> None:
    baselines = {"statue": {**SUMMARY["baselines"]["statue"], "success": success}}
    html = render(PageContent(title="x", evaluation={**SUMMARY, "baselines": baselines}))
    assert message in html


@pytest.mark.parametrize(
    ("evaluation", "option"),
    [
        ({"verdict": {"kind": "falls"}}, "--minutes 24"),
        ({"verdict": {"kind": "falls"}, "tracker": "regulator"}, "--instant"),
        ({"verdict": {"kind": "too_short"}}, "--start, --end"),
        ({"verdict": {"kind": "dances"}}, ""),
        ({}, ""),
    ],
)
def test_a_robot_that_does_not_dance_has_its_next_step(
    evaluation: dict[str, object], option: str
) -> None:
    assert next_step(evaluation, "--minutes 24")[1] == option


def test_the_next_step_is_below_the_verdict() -> None:
    verdict = {"verdict": {"kind": "falls", "sentence": "The robot falls after 1 s."}}
    html = render(PageContent(title="x", evaluation=verdict, next_step=("Train", "--minutes 15")))
    lead = re.search(r'<p class="lead">(.*?)</p>', html)
    assert lead is not None
    assert lead.group(1).startswith("The robot falls after 1 s.")
    assert "Train <code>--minutes 15</code>" in lead.group(1)


def test_the_robot_is_named_above_the_dance_and_in_the_window() -> None:
    html = render(PageContent(title="hip shake", robot="g1"))
    assert "<title>hip shake, g1 · RoboJackson</title>" in html
    assert '<p class="kicker">RoboJackson · g1</p>' in html


def test_the_survival_of_a_motion_that_ends_is_beside_what_is_left_of_it(results: Results) -> None:
    rows = [{**row, "clip_fraction": 0.5} for row in results.evaluations]
    axes = run_plots.survival_by_phase(rows, 0.02).axes[0]
    up = [bar.get_height() for bar in axes.patches]
    np.testing.assert_allclose(up, 6.0)  # the mean of 3, 6 and 9 s
    marks = [line[0, 1] for part in axes.collections for line in part.get_segments()]
    np.testing.assert_allclose(marks, 3 * [18.0])


@pytest.mark.parametrize("figure", ["lean_deg", "keypoint_leaned_mm"])
def test_the_lean_of_the_targets_is_shown(figure: str) -> None:
    html = render(PageContent(title="x", scorecard={figure: 4.25}))
    assert f"<dd>{format_value(figure, 4.25)}</dd>" in html


@pytest.mark.parametrize(
    ("figure", "message"), [("drift_m", "0.25 m"), ("heading_error_deg", "0.2 deg")]
)
def test_where_the_robot_ends_up_is_shown(figure: str, message: str) -> None:
    html = render(PageContent(title="x", evaluation={**SUMMARY, figure: 0.249}))
    assert f"<td>{message}</td>" in html


def test_missing_figure_is_a_dash() -> None:
    html = render(PageContent(title="x", evaluation=SUMMARY))
    row = re.search(r"statue.*?</tr>", html[html.index("<tbody>") :], re.S)
    assert row is not None
    assert row.group().count("<td>–</td>") == 6


def test_page_before_training_has_no_verdict() -> None:
    assert "<h2>Evaluation</h2>" not in render(PageContent(title="x"))


@pytest.mark.medium
def test_notes_are_reported(results: Results) -> None:
    assert '<p class="note">the camera moves</p>' in render(page_content(results, None))


@pytest.mark.medium
def test_written_page_is_whole(results: Results, tmp_path: Path) -> None:
    page = write_page(page_content(results, None), tmp_path / "index.html")
    assert page.read_text().rstrip().endswith("</html>")
    assert list(tmp_path.iterdir()) == [page]


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("site_error_m", 0.0482, "48 mm"),
        ("success", 0.625, "62%"),
        ("training_s", 90.0, "1.5 min"),
        ("steps", 1203456, "1,203,456"),
        ("skill", float("nan"), "–"),
        ("cyclic", 1.0, "yes"),
        ("trainer", "sbx", "sbx"),
        ("seed", 20261126, "20261126"),
        ("episodes", 1234567, "1,234,567"),
        ("learning_rate", 0.000123456, "0.0001235"),
        ("skill", -0.001, "0.00"),
        ("skill", -0.25, "\N{MINUS SIGN}0.25"),
    ],
)
def test_figures_are_written_with_their_units(key: str, value: object, text: str) -> None:
    assert format_value(key, value) == text


def test_unknown_figure_keeps_its_name() -> None:
    assert quantity("some_new_figure", 0.12345).label == "some new figure"


def test_versions_leave_out_what_is_not_installed() -> None:
    found = versions(("numpy", "no-such-program-of-ours"))
    assert found == {"numpy": np.__version__}


def test_survival_bars_are_means_over_resets(results: Results) -> None:
    axes = run_plots.survival_by_phase(results.evaluations, 0.015).axes[0]
    assert [bar.get_height() for bar in axes.patches] == [6.0, 6.0, 6.0]


def test_survival_bars_begin_at_their_phase(results: Results) -> None:
    rows = [row for row in results.evaluations if row["phase"] in (0, 18)]
    axes = run_plots.survival_by_phase(rows, 0.015).axes[0]
    np.testing.assert_allclose([bar.get_x() for bar in axes.patches], [0.0, 0.27])


def test_default_stand_is_no_phase(results: Results) -> None:
    stand = {"policy": "trained", "phase": -1, "reset": 0, "survived_s": 99.0}
    axes = run_plots.survival_by_phase([*results.evaluations, stand], 0.015).axes[0]
    assert len(axes.patches) == 3


def test_the_policy_under_another_law_is_not_drawn_as_a_baseline(results: Results) -> None:
    trained = list(results.evaluations)
    others = [{**row, "policy": name} for name in ("hold", "statue") for row in trained]
    axes = run_plots.survival_by_phase([*trained, *others], 0.015).axes[0]
    styles = {str(line.get_label()): line.get_linestyle() for line in axes.lines}
    assert styles == {"trained robot, torque held": "--", "statue": "-"}


def test_training_curve_is_the_median() -> None:
    rows = [{"step": 10, "episode_length": n, "episode_return": 0.0} for n in (100, 200, 900)]
    line = run_plots.training_curve(rows, 0.01).axes[0].lines[0]
    np.testing.assert_allclose(line.get_ydata(), [2.0])


@pytest.mark.parametrize("summary", [FIGURES, SUMMARY], ids=["measured", "read"])
def test_limb_that_does_not_move_is_reported_so(summary: Mapping[str, object]) -> None:
    texts = [text.get_text() for text in run_plots.limb_gains(summary).axes[0].texts]
    assert texts == [" 0.93", " does not move in the reference"]


def test_plot_is_a_png(results: Results) -> None:
    figure = run_plots.contact_strip(results.sequence, results.reference)
    assert run_plots.png(figure).startswith(b"\x89PNG")
