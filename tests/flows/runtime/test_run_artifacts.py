"""One artifact a run of a dance or study: verdict, figures, picture, and links that lead there."""

import asyncio
import json
import re
from pathlib import Path
from typing import Any

import pytest
from prefect import flow
from prefect.client.orchestration import get_client

from flows.runtime.result_server import results
from flows.runtime.run_artifacts import RESULTS, of_dance, of_study, show_dance
from flows.video_pass.inputs import name_of
from storage.artifact import Artifact
from storage.store import Store
from tests.flows.runtime.browser import Web

FIGURES: dict[str, Any] = {
    "survived_s": 10.0, "success": 1.0, "strict_success": 0.98, "skill": 0.7, "rollouts": 73,
    "site_error_m": 0.01, "limb_gain": 0.9, "drift_m": 0.1, "heading_error_deg": 1.0,
}  # fmt: skip
EVALUATION = {**FIGURES, "baselines": {"statue": {**FIGURES, "success": 0.0, "skill": 0.0}}}
NAMES = {
    "page": "index.html",
    "dance": "dance.mp4",
    "still": "still.png",
    "policy": "p.safetensors",
}
LINK = re.compile(r"\]\(([^)]+)\)")


def made(store: Store, folder: str = "dances/my dance-1234") -> dict[str, Artifact]:
    return {name: store.put(f"{folder}/{file}", b"x") for name, file in NAMES.items()}


def reach(store: Store, text: str) -> list[int]:
    """Follow every link of a text as the browser of the server's pages does."""
    web = Web(results(store))
    links = LINK.findall(text)
    assert links
    assert all(link.startswith(f"{RESULTS}/") for link in links)
    return [web.get(link.removeprefix(RESULTS)).status_code for link in links]


def test_every_link_of_a_dance_leads_somewhere(store_folder: Path) -> None:
    store = Store(store_folder)
    text = of_dance(store, "my dance", EVALUATION, made(store))
    assert set(reach(store, text)) == {200}
    assert len(LINK.findall(text)) == len(NAMES)


def test_the_text_of_a_dance_has_its_verdict_and_its_baselines(store_folder: Path) -> None:
    store = Store(store_folder)
    text = of_dance(store, "my dance", EVALUATION, made(store))
    assert "The trained robot finished 100% of 73 rollouts" in text
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    assert [row.split(" | ")[0] for row in rows] == [
        "| policy",
        "| ---",
        "| trained robot",
        "| statue",
    ]
    assert str(store_folder / "dances") in text


def test_a_study_shows_what_became_of_its_claims(store_folder: Path) -> None:
    store = Store(store_folder)
    claims = [{"text": "Pretraining helps", "sentence": "Holds here: 3."}]
    files = {
        "page": store.put("studies/s/index.html", b"x"),
        "table": store.put("studies/s/table.csv", b"x"),
        "results": store.put("studies/s/results.json", json.dumps({"claims": claims}).encode()),
        "Skill": store.put("studies/s/skill.png", b"x"),
    }
    text = of_study(store, "s", files)
    assert "**Pretraining helps** Holds here: 3." in text
    assert set(reach(store, text)) == {200}


@pytest.mark.medium
def test_a_dance_has_a_key_of_its_own_and_keeps_its_history(
    records: None, store_folder: Path
) -> None:
    store = Store(store_folder)

    @flow
    async def shown(name: str) -> None:
        await show_dance(store, name, EVALUATION, made(store))

    for name in ("hip shake", "walk", "hip shake"):
        asyncio.run(shown(name))
    with get_client(sync_client=True) as client:
        keys = [artifact.key for artifact in client.read_artifacts()]
    assert (keys.count("dance-hip-shake"), keys.count("dance-walk")) == (2, 1)


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("APT dance", "APT-dance"),
        ("clips/hip_shake.mp4", "hip_shake"),
        ("/mnt/videos/12:30 Tänzer.mp4", "12-30-Tanzer"),
        ("clips/", "clips"),
        ("https://www.youtube.com/watch?v=abc_123", "v-abc_123"),
        ("https://host/shorts/xyz", "shorts-xyz"),
    ],
)
def test_a_run_is_named_after_its_dance_and_not_after_a_path(source: str, name: str) -> None:
    assert name_of(source) == name
