"""The licence passport: the strictest licence counts, and what no one recorded is unknown."""

import ast
import hashlib
import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from robojackson.api.policy_ingredients import (
    clip_ingredient,
    motion_ingredient,
    policy_ingredients,
)
from robojackson.cli.exporting import export
from robojackson.cli.importing import import_motion
from robojackson.errors import BadConfiguration
from robojackson.formats.deploy.licence_passport import (
    KINDS,
    OF_CLIP,
    RIGHTS,
    RUNNER_NEEDS,
    Ingredient,
    robot_ingredient,
    together,
    with_declared,
)
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.rl.policy import Policy
from tests.fixtures.person import person
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
    assert robot_ingredient(description("g1"), "0").licence == "Apache-2.0 AND BSD-3-Clause"
    assert "Unitree" in robot_ingredient(description("g1"), "0").note
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


def person_file(folder: Path) -> Path:
    path = folder / "smpl.parquet"
    path.write_bytes(person(legs=0.1, speed=0.0).to_bytes())
    return path


def ingredients(pack: Pack, folder: Path, **facts: object) -> dict[str, str]:
    file = folder / "reference.parquet"
    if not file.exists():
        pack.reference.save(file)
    policy = Policy(pack.policy.layers, {**pack.policy.facts, **facts})
    path = policy.save(folder / "policy.safetensors")
    return {one.name: one.licence for one in policy_ingredients(policy, path, file, pack.robot)}


@pytest.mark.parametrize(
    ("start", "name", "licence"),
    [
        ("walker", "start: walker", "Apache-2.0"),
        ("dancer", "start: dancer", "Apache-2.0"),
        ("them/theirs", "start: theirs", "unknown"),
        ("them/dancer", "start: them/dancer", "unknown"),
    ],
)
def test_the_weights_that_a_training_began_with_are_listed(
    pack: Pack, tmp_path: Path, start: str, name: str, licence: str
) -> None:
    assert ingredients(pack, tmp_path, start=start)[name] == licence
    assert not any(one.startswith("start") for one in ingredients(pack, tmp_path, start="scratch"))


@pytest.mark.parametrize("said", ["unknown", "Creative Commons Attribution license"])
def test_a_licence_that_says_nothing_is_declared_by_the_user(said: str) -> None:
    clip = Ingredient("clip", "a.mp4", said, "its info.json")
    assert not clip.is_known
    (declared,) = with_declared([clip], {"clip": "CC-BY-4.0"})
    assert (declared.name, declared.licence, declared.is_known) == ("a.mp4", "CC-BY-4.0", True)


def test_a_declared_licence_keeps_the_digest_and_reaches_what_has_it_from_the_clip() -> None:
    given = [
        Ingredient("clip", "m.bvh", "unknown", "imported", "2d71"),
        Ingredient("motion", "reference motion", "unknown", f"retargeted from m.bvh, {OF_CLIP}"),
    ]
    clip, motion = with_declared(given, {"clip": "CC-BY-4.0"})
    assert (clip.licence, clip.sha256) == ("CC-BY-4.0", "2d71")
    assert motion.licence == "CC-BY-4.0"
    assert together([clip, motion])["sell"] == "notice"
    both = with_declared(given, {"clip": "CC-BY-NC-4.0", "motion": "MIT"})
    assert [(one.kind, one.licence) for one in both] == [
        ("clip", "CC-BY-NC-4.0"),
        ("motion", "MIT"),
    ]


def test_several_licences_allow_what_the_strictest_does() -> None:
    both = Ingredient("robot model", "g1", "Apache-2.0 AND CC-BY-NC-4.0")
    assert both.allows == {"use": "notice", "change": "notice", "pass_on": "notice", "sell": "no"}
    assert not Ingredient("robot model", "g1", "Apache-2.0 AND mine").is_known


def test_what_the_runner_imports_is_listed_and_nothing_else(pack: Pack) -> None:
    own = sorted(pack.folder.glob("*.py"))
    assert [path.name for path in own] == ["run.py", "simulated_robot.py"]
    tree = ast.parse("".join(path.read_text() for path in own))
    names = {n.name for each in ast.walk(tree) if isinstance(each, ast.Import) for n in each.names}
    names |= {each.module for each in ast.walk(tree) if isinstance(each, ast.ImportFrom)}
    packages = {name.split(".")[0] for name in names if name} - sys.stdlib_module_names
    packages -= {path.stem for path in own}
    assert packages == set(RUNNER_NEEDS)
    found = json.loads((pack.folder / "licences.json").read_text())["inputs"]
    software = {one["name"]: one["licence"] for one in found if one["kind"] == "software"}
    assert {name: software[name] for name in packages} == dict(RUNNER_NEEDS)
    assert "unknown" not in RUNNER_NEEDS.values()


@pytest.mark.parametrize("licence", ["", "CC-BY-NC-4.0"])
def test_an_imported_motion_has_the_licence_of_its_file(tmp_path: Path, licence: str) -> None:
    file = tmp_path / "theirs.bvh"
    export(person_file(tmp_path), "bvh", file)
    if licence:
        file.with_name("theirs.bvh.license").write_text(f"SPDX-License-Identifier: {licence}")
    import_motion(file, tmp_path / "in", None, None, "base", {})
    reference = tmp_path / "in" / "reference.parquet"
    clip, motion = clip_ingredient(reference), motion_ingredient(reference, "0")
    assert (clip.name, clip.licence) == ("theirs.bvh", licence or "unknown")
    assert clip.sha256 == hashlib.sha256(file.read_bytes()).hexdigest()
    assert "imported, bvh" in clip.note
    assert motion.licence == clip.licence
    assert "theirs.bvh" in motion.note


def test_a_motion_is_our_own_where_a_video_is_recorded_and_unknown_where_nothing_is(
    tmp_path: Path,
) -> None:
    reference = tmp_path / "run" / "reference.parquet"
    assert motion_ingredient(reference, "0").licence == "unknown"
    (tmp_path / "source.json").write_text("[1]")
    assert motion_ingredient(reference, "0").licence == "unknown"
    (tmp_path / "source.json").write_text(json.dumps({"video": "dance.mp4"}))
    assert motion_ingredient(reference, "0").licence == "own"


def test_networks_of_a_users_own_that_recovered_the_motion_are_unknown(
    pack: Pack, tmp_path: Path
) -> None:
    (tmp_path / "landmarks.parquet").touch()
    found_person: SmplSequence = human("hip_shake")
    found_person.save(tmp_path / "smpl.parquet")
    found = ingredients(pack, tmp_path)
    assert found["MediaPipe's pose landmarker"] == "Apache-2.0"
    assert found["temporal network and skeleton of RoboJackson"] == "Apache-2.0"
    note = "pose by the network HybrIK (theirs.pth)"
    replace(found_person, notes=(note,)).save(tmp_path / "smpl.parquet")
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
