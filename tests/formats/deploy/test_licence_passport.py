"""The licence passport: the strictest licence counts, and what no one recorded is unknown."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from robojackson.api.policy_ingredients import clip_ingredient, policy_ingredients
from robojackson.errors import BadConfiguration
from robojackson.formats.deploy.licence_passport import (
    KINDS,
    RIGHTS,
    Ingredient,
    robot_ingredient,
    together,
    with_declared,
)
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.rl.policy import Policy
from tests.fixtures.robots import description, human
from tests.formats.deploy.conftest import Pack

FREE = Ingredient("motion", "ours", "own")


def test_the_strictest_licence_counts_right_by_right() -> None:
    found = together(
        [FREE, Ingredient("clip", "film", "CC-BY-NC-4.0"), Ingredient("software", "x", "MIT")]
    )
    assert found == {"use": "notice", "change": "notice", "pass_on": "notice", "sell": "no"}


@pytest.mark.parametrize("licence", ["unknown", "All rights reserved", ""])
def test_a_licence_that_no_one_knows_makes_the_whole_unknown(licence: str) -> None:
    assert together([FREE, Ingredient("clip", "film", licence)]) == dict.fromkeys(RIGHTS, "unknown")


def test_what_is_forbidden_is_not_hidden_by_what_is_unknown() -> None:
    given = [Ingredient("clip", "film"), Ingredient("tracker", "x", "CC-BY-NC-4.0")]
    assert together(given)["sell"] == "no"


def test_a_declared_licence_fills_what_is_unknown_and_nothing_else() -> None:
    known = Ingredient("weights", "w", "MIT", "its file")
    found = with_declared(
        [Ingredient("clip", "film"), known], {"clip": "CC0-1.0", "weights": "own"}
    )
    licences = {(one.kind, one.name): (one.licence, one.note) for one in found}
    assert licences[("clip", "film")] == ("CC0-1.0", "declared by the user")
    assert licences[("weights", "w")] == ("MIT", "its file")


def test_a_kind_that_is_none_is_refused_with_those_that_are() -> None:
    with pytest.raises(BadConfiguration, match=f"film=MIT: kinds are {', '.join(KINDS)}"):
        with_declared([FREE], {"film": "MIT"})


def test_the_robots_licence_is_its_packages_and_unknown_for_a_file() -> None:
    own = description("humanoid")
    assert robot_ingredient(own, "0").licence == "MIT"
    assert robot_ingredient(description("g1"), "0").licence == "Apache-2.0"
    assert robot_ingredient(replace(own, mjcf="robot.xml"), "0").licence == "unknown"


def test_the_pack_names_the_clip_as_unknown_and_brings_the_robots_licence(pack: Pack) -> None:
    found = json.loads((pack.folder / "licences.json").read_text())
    clip = next(one for one in found["inputs"] if one["kind"] == "clip")
    assert clip["licence"] == "unknown"
    assert found["together"] == dict.fromkeys(RIGHTS, "unknown")
    texts = list((pack.folder / "licences").iterdir())
    assert "MIT" in texts[0].read_text()
    table = (pack.folder / "LICENCES.md").read_text()
    assert table.count("\n| ") == len(found["inputs"]) + 2


def ingredients(pack: Pack, folder: Path, **facts: object) -> dict[str, str]:
    file = folder / "reference.parquet"
    if not file.exists():
        pack.reference.save(file)
    policy = Policy(pack.policy.layers, {**pack.policy.facts, **facts})
    path = policy.save(folder / "policy.safetensors")
    return {one.name: one.licence for one in policy_ingredients(policy, path, file, pack.robot)}


@pytest.mark.parametrize(
    ("start", "name", "licence"),
    [("walker", "start: walker", "Apache-2.0"), ("them/theirs", "start: theirs", "unknown")],
)
def test_the_weights_that_a_training_began_with_are_listed(
    pack: Pack, tmp_path: Path, start: str, name: str, licence: str
) -> None:
    assert ingredients(pack, tmp_path, start=start)[name] == licence
    assert not any(one.startswith("start") for one in ingredients(pack, tmp_path, start="scratch"))


def test_a_tracker_that_was_polished_is_listed_as_unknown(pack: Pack, tmp_path: Path) -> None:
    assert ingredients(pack, tmp_path, tracker="twist2")["tracker twist2"] == "unknown"


def test_networks_of_a_users_own_that_recovered_the_motion_are_unknown(
    pack: Pack, tmp_path: Path
) -> None:
    (tmp_path / "landmarks.parquet").touch()
    person: SmplSequence = human("hip_shake")
    person.save(tmp_path / "smpl.parquet")
    found = ingredients(pack, tmp_path)
    assert found["MediaPipe's pose landmarker"] == "Apache-2.0"
    assert found["temporal network and skeleton of RoboJackson"] == "Apache-2.0"
    note = "pose by the network HybrIK (theirs.pth)"
    replace(person, notes=(note,)).save(tmp_path / "smpl.parquet")
    assert ingredients(pack, tmp_path)[note] == "unknown"


@pytest.mark.parametrize(
    ("sidecar", "text", "licence"),
    [
        ("dance.mp4.license", "# note\nSPDX-License-Identifier: CC-BY-4.0\n", "CC-BY-4.0"),
        ("dance.mp4.license", "no such line", "unknown"),
        ("dance.info.json", '{"license": "CC0-1.0"}', "CC0-1.0"),
        ("dance.info.json", '{"license": null}', "unknown"),
        ("dance.info.json", "[", "unknown"),
    ],
)
def test_the_clips_licence_is_what_a_file_beside_it_states(
    tmp_path: Path, sidecar: str, text: str, licence: str
) -> None:
    (tmp_path / "source.json").write_text(json.dumps({"video": str(tmp_path / "dance.mp4")}))
    (tmp_path / sidecar).write_text(text)
    found = clip_ingredient(tmp_path / "run" / "reference.parquet")
    assert (found.name, found.licence) == ("dance.mp4", licence)
    assert ("not stated" in found.note) == (licence == "unknown")


def test_a_motion_without_a_video_has_a_clip_that_is_not_stated(tmp_path: Path) -> None:
    assert "not stated" in clip_ingredient(tmp_path / "reference.parquet").note
