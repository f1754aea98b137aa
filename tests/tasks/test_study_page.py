"""The page of a study, from tables whose answer is known."""

import csv
import io
import json
import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from prefect import flow
from pydantic import ValidationError

from configs.study_config import Move, Study
from robojackson.files import tables
from robojackson.metrics.seed_statistics import estimate
from robojackson.pipeline.table_schemas import EPISODE_RECORD, EVALUATION_RECORD
from robojackson.pipeline.yaml_loader import load
from robojackson.report.pages import study_table
from robojackson.report.pages.study_page import cell
from storage import study_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks import write_study_page
from tasks.study_results import too_short_moves
from tasks.write_study_page import report

pytestmark = pytest.mark.xdist_group("study_page")

STUDY = Study(
    name="known", moves=("hip_shake", "walk"), setups=("scratch", "pretrain"), seeds=(0, 1, 2, 3)
)
WORTH = {"scratch": 1.0, "pretrain": 3.0}
DULL = {"statue": 0.99, "mean_pose": 1.0, "flail": 0.9, "zero_residual": 0.03}
PAID = {"scratch": DULL, "pretrain": DULL, "curiosity": DULL | {"flail": 1.57}}


def publish(store: Store, move: str, setup: str, seed: int) -> None:
    """Publish a cell that learns from nothing to the level of its setup."""
    place = study_tables.Place("known", move, setup, seed, f"{setup}-{move}-s{seed}")
    names = {"run_id": place.run_id, "move": move, "setup": setup, "seed": seed}
    share = np.linspace(0.0, 1.0, 50)
    episodes = [
        {**names, "step": int(50_000 * s), "episode": i, "episode_length": int(10 + 90 * s),
         "episode_return": float(s * WORTH[setup])}
        for i, s in enumerate(share)
    ]  # fmt: skip
    rows = [rollout(names, "trained", WORTH[setup] + 0.01 * seed), rollout(names, "statue", 0.5)]
    rows.append(rollout(names, "hold", 0.4))
    rows.append({**rollout(names, "regulator", 0.8), "strict_success": 1.0})
    rows.append({**rows[1], "phase": -1, "survived_s": 0.9})
    given = {
        "episodes": store.save("t", "e.parquet", tables.encode_rows(EPISODE_RECORD, episodes)),
        "evaluations": store.save("t", "v.parquet", tables.encode_rows(EVALUATION_RECORD, rows)),
    }
    study_tables.write(store, place, given)
    start = "scratch" if setup == "scratch" else "walker"
    facts = {"study": "known", "git_commit": "0123456789abcdef", "config": {"start": start}}
    study_tables.note(store, place, {**names, **facts})


def rollout(names: dict[str, Any], policy: str, worth: float) -> dict[str, Any]:
    return {
        **names, "policy": policy, "phase": 0, "reset": 0, "survived_s": worth, "fell": False,
        "clip_fraction": worth / 10, "success": 1.0, "strict_success": 0.5 * (policy == "trained"),
        "return_own": worth,
        "limb_gain_head": 0.5, "limb_gain_left_hand": 0.7,
    }  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("store")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROBOJACKSON_STORE", str(root))
        for move in STUDY.moves:
            for setup in STUDY.setups:
                for seed in STUDY.seeds:
                    publish(Store(root), move, setup, seed)
        moves = {name: load(Move, f"moves/{name}") for name in STUDY.moves}
        report(STUDY, moves, reward_audits={"walk": PAID})
    return root / "studies" / "known"


def results(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "results.json").read_text())


@pytest.mark.medium
def test_the_claims_are_about_the_yardstick_and_have_its_sign(folder: Path) -> None:
    record = {claim["text"]: claim for claim in results(folder)["claims"]}
    assert record["Pretraining helps"]["verdict"] == "holds"
    assert record["Pretraining helps"]["effect"]["difference"]["mean"] == pytest.approx(2.0)
    assert record["Curiosity helps on dances"]["verdict"] == "not measured"


@pytest.mark.medium
def test_an_effect_is_reported_for_every_move_alone(folder: Path) -> None:
    first, *_, last = results(folder)["comparisons"]
    assert (first["treated"], first["control"]) == ("pretrain", "scratch")
    means = {move: found["difference"]["mean"] for move, found in first["effects"].items()}
    assert means == pytest.approx({"hip_shake": 2.0, "walk": 2.0})
    assert last["effects"] == {"hip_shake": None, "walk": None}
    assert "<td>+2.0 [+2.0, +2.0]</td>" in (folder / "index.html").read_text()


@pytest.mark.medium
def test_the_table_has_a_line_a_move_and_setup_and_what_the_statue_does(folder: Path) -> None:
    rows = list(csv.DictReader(io.StringIO((folder / "table.csv").read_text())))
    found = {(row["move"], row["setup"]): row for row in rows}
    shown = ("scratch", "pretrain", "statue", "regulator")
    assert set(found) == {(m, s) for m in STUDY.moves for s in shown}
    assert float(found["walk", "regulator"]["strict_success"]) == 1.0
    assert float(found["walk", "scratch"]["strict_success"]) == 0.5, (
        "not a motion that anyone holds"
    )
    assert float(found["walk", "pretrain"]["return_own"]) == pytest.approx(3.015)
    assert float(found["walk", "statue"]["return_own"]) == pytest.approx(0.5)
    assert float(found["walk", "statue"]["survived_s"]) == pytest.approx(0.7)
    assert float(found["walk", "statue"]["stand_s"]) == pytest.approx(0.9)
    assert found["walk", "statue"]["survived_s_low"] == "", "a baseline has no interval"


@pytest.mark.medium
def test_steps_to_the_threshold_are_those_of_the_curve(folder: Path) -> None:
    line = next(line for line in results(folder)["lines"] if line["setup"] == "scratch")
    # Lengths grow from 10 to 100: 80 % of the last interval's mean comes at 0.77 of the budget.
    assert line["values"]["steps_to"]["mean"] == pytest.approx(0.77 * 50_000, rel=0.05)


@pytest.mark.medium
def test_the_page_stands_alone_and_says_how_few_seeds_there_are(folder: Path) -> None:
    page = (folder / "index.html").read_text()
    assert "no difference can have a p below 0.12" in page
    assert "http" not in page.replace("http-equiv", "")
    assert page.count("data:image/png;base64,") == 2 + 4


@pytest.mark.medium
def test_the_table_draws_how_each_setup_learnt_on_one_scale_a_move(folder: Path) -> None:
    page = (folder / "index.html").read_text()
    curves = re.findall(r'<polyline points="([^"]*)"', page)
    assert len(curves) == len(STUDY.moves) * len(STUDY.setups)
    heights = [[float(point.split(",")[1]) for point in curve.split()] for curve in curves[:2]]
    assert min(heights[0]) > min(heights[1]) == pytest.approx(1.0, abs=0.1)
    assert "return while learning: from 0 to 3" in page


@pytest.mark.medium
def test_what_is_to_be_known_first_stands_above_the_claims(folder: Path) -> None:
    page = (folder / "index.html").read_text()
    assert page.index('<p class="note">') < page.index('class="claims"')


def test_the_smoke_study_says_that_its_numbers_mean_nothing() -> None:
    (shown,) = write_study_page._meaningless(load(Study, "studies/smoke"))
    assert shown.endswith("its numbers mean nothing.")
    assert write_study_page._meaningless(load(Study, "studies/paper")) == []


@pytest.mark.medium
def test_what_setups_of_one_reward_pay_to_bodies_that_do_not_dance_is_reported_once(
    folder: Path,
) -> None:
    page = (folder / "index.html").read_text()
    assert page.count("<td>90</td>") == page.count("<td>157</td>") == 1
    assert '<th scope="row">scratch, pretrain</th><td>99</td><td>100</td><td>90</td>' in page


@pytest.mark.medium
def test_the_code_that_made_the_rows_is_named(folder: Path) -> None:
    assert "0123456789" in (folder / "index.html").read_text()


@pytest.mark.medium
def test_what_the_walker_had_learnt_before_is_reported(folder: Path) -> None:
    page = (folder / "index.html").read_text()
    assert (
        "pretrain begins with networks (walker) that had learnt for 671,296 control steps" in page
    )


@pytest.mark.medium
def test_rows_of_other_runs_under_the_name_of_the_study_do_not_count(
    store_folder: Path,
) -> None:
    """Seeds of another day and cells that failed this time."""
    store = Store(store_folder)
    for seed in (0, 1, 2):
        publish(store, "walk", "scratch", seed)
    expected = {"scratch-walk-s0", "scratch-walk-s2"}
    report(STUDY, {"walk": load(Move, "moves/walk")}, runs=expected)
    answer = json.loads((store_folder / "studies/known/results.json").read_text())
    line = next(line for line in answer["lines"] if line["move"] == "walk")
    assert line["seeds"] == 2
    assert line["values"]["return_own"]["mean"] == pytest.approx(1.01)


def test_seeds_that_never_reach_the_threshold_are_counted_apart() -> None:
    rng = np.random.default_rng(0)
    figures = {"steps_to": {("walk", "scratch"): {0: 100.0, 1: 300.0, 2: np.inf, 3: np.inf}}}
    (line, *_) = study_table.table(figures, {}, ["walk"], ["scratch"], rng)
    assert cell(line.values["steps_to"], "steps_to", 4) == ("200", ["[100, 300]", "(2 of 4)"])
    never = estimate([np.inf, np.inf], rng)
    assert cell(never, "steps_to", 2) == ("never", [])


@pytest.mark.medium
def test_the_page_is_drawn_again_only_when_the_rows_change(
    records: None, store_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[str] = []

    def draw(study: Study, *given: Any) -> dict[str, Artifact]:
        drawn.append(study.name)
        return {"page": Store(store_folder).put("page.html", b"page")}

    monkeypatch.setattr(write_study_page, "report", draw)

    @flow(name="pages")
    def page() -> Any:
        return write_study_page.write_study_page(
            STUDY, {}, study_tables.files_of(Store(store_folder), "known"), {}, {}
        )

    publish(Store(store_folder), "walk", "scratch", 0)
    first, again = page(), page()
    assert (first, drawn) == (again, ["known"])
    publish(Store(store_folder), "walk", "scratch", 1)
    page()
    assert drawn == ["known"] * 2


def test_a_key_of_a_move_that_is_no_part_of_its_motion_is_refused() -> None:
    with pytest.raises(ValidationError, match=r"overrides\.evaluate\.seconds: is no part"):
        Move(clip="clips/walk.mp4", overrides={"evaluate.seconds": 3})


def test_robots_that_fall_early_do_not_make_a_move_too_short(tmp_path: Path) -> None:
    store, study = Store(tmp_path), Study(name="known", moves=("walk",), setups=("scratch",))
    place = study_tables.Place("known", "walk", "scratch", 0, "r")
    names = {"run_id": "r", "move": "walk", "setup": "scratch", "seed": 0}
    for share, short in ((0.1, []), (1.0, ["walk"])):
        row = {**rollout(names, "trained", 1.0), "success": 0.0, "clip_fraction": share}
        encoded = tables.encode_rows(EVALUATION_RECORD, [row])
        none = store.save("t", "e.parquet", tables.encode_rows(EPISODE_RECORD, []))
        made = {"evaluations": store.save("t", "v.parquet", encoded), "episodes": none}
        study_tables.write(store, place, made)
        assert too_short_moves(partial(study_tables.query, store), study, {}) == short
